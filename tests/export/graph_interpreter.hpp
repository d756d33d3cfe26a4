#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/export/step_graph.hpp"

namespace torsio::test {

/// Evaluates a graph node by node, for one joint.
class GraphInterpreter {
 public:
  explicit GraphInterpreter(StepGraph graph)
      : graph_(std::move(graph)), rows_(graph_.nodes.size()), state_(graph_.state_width) {}

  Estimate step(const std::vector<double>& raw, double timestep_s = 0.0);
  [[nodiscard]] const StepGraph& graph() const noexcept { return graph_; }

 private:
  using Numbers = std::vector<double>;

  [[nodiscard]] Numbers rounded(std::size_t index, Numbers row) const;
  [[nodiscard]] Numbers row_of(std::size_t index, const Numbers& raw) const;
  [[nodiscard]] Numbers interpolated(const StepGraph::Node& node, double x) const;

  StepGraph graph_;
  std::vector<Numbers> rows_;
  Numbers state_;
  double timestep_s_ = 0.0;
};

}  // namespace torsio::test
