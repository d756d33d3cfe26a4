#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "import/graph_value.hpp"

namespace torsio::graph {

/// Follows a graph node by node. One method an operator; each gives the node's first output.
class Evaluator {
 public:
  explicit Evaluator(const Graph& graph);

  [[nodiscard]] static bool supports(std::string_view op);

  /// In the graph's order. @throws Error that names the node.
  void evaluate(const Node& node);
  /// The stages from the graph's input up to a value. @throws Error if it is not a signal.
  [[nodiscard]] ForeignNetwork network(const std::string& output);

 private:
  using Method = Value (Evaluator::*)(const Node&);
  static const std::map<std::string_view, Method>& methods();

  // graph_evaluator.cpp: what the value's place in the graph decides
  [[nodiscard]] const Value* find(const std::string& name) const;
  [[nodiscard]] const Value& input(const Node& node, std::size_t index) const;
  [[nodiscard]] static bool has_input(const Node& node, std::size_t index);
  [[nodiscard]] const Signal& signal(const Node& node, std::size_t index) const;
  [[nodiscard]] const Tensor& constant(const Node& node, std::size_t index) const;
  /// A list of whole numbers, from the input or, as in older operator sets, the attribute; none if
  /// neither is there.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> whole_numbers(
      const Node& node, std::size_t index, const std::string& attribute) const;
  [[nodiscard]] std::vector<std::int64_t> whole_numbers(const Node& node, std::size_t index) const;
  /// To be called before numbers are made from constants: a small file must not ask for much
  /// memory.
  void reserve(const Node& node, std::size_t count);
  [[nodiscard]] Tensor copy_of(const Node& node, const Tensor& tensor);
  [[nodiscard]] Tensor taken_from(const Node& node, const Tensor& tensor, std::size_t axis,
                                  const std::vector<std::size_t>& indices);
  [[nodiscard]] Signal appended(const Node& node, Signal signal, ForeignStage stage);

  // graph_shapes.cpp: operators that move numbers
  Value identity(const Node& node);
  Value cast(const Node& node);
  Value dropout(const Node& node);
  Value constant_node(const Node& node);
  Value constant_of_shape(const Node& node);
  Value shape(const Node& node);
  Value expand(const Node& node);
  Value gather(const Node& node);
  Value slice(const Node& node);
  Value concat(const Node& node);
  Value transpose(const Node& node);
  Value squeeze(const Node& node);
  Value unsqueeze(const Node& node);
  Value reshape(const Node& node);
  Value flatten(const Node& node);
  [[nodiscard]] Signal last_sample(const Node& node, Signal signal, std::size_t axis,
                                   std::int64_t index, bool keeps_axis) const;

  // graph_layers.cpp: what computes
  Value gemm(const Node& node);
  Value matmul(const Node& node);
  Value add(const Node& node);
  Value subtract(const Node& node);
  Value multiply(const Node& node);
  Value divide(const Node& node);
  Value magnitude(const Node& node);
  Value activation(const Node& node);
  Value recurrent(const Node& node);
  [[nodiscard]] Signal affine(const Node& node, const Signal& from, std::vector<double> gain,
                              std::vector<double> offset);
  /// A constant that is added to or multiplied with each feature, one number a feature.
  [[nodiscard]] std::vector<double> by_feature(const Node& node, Signal& from,
                                               const Tensor& tensor) const;
  [[nodiscard]] Signal dense(const Node& node, const Signal& from, Matrix weights,
                             std::vector<double> bias);
  [[nodiscard]] RecurrentStage recurrent_stage(const Node& node, std::size_t inputs) const;
  void check_recurrent(const Node& node) const;

  const Graph& graph_;
  std::map<std::string, Value> values_;
  std::vector<ForeignStage> stages_;
  std::optional<std::size_t> window_;
  bool starts_from_zeros_ = false;  ///< every window starts from zeros in the graph
  std::size_t folded_ = 0;          ///< numbers made from constants so far
};

/// @throws Error naming file, node and operator.
[[noreturn]] void refuse(const Graph& graph, const Node& node, const std::string& expected,
                         const std::string& found, const std::string& advice = {});
[[nodiscard]] std::string title(const Node& node);
[[nodiscard]] std::int64_t integer(const Node& node, const char* attribute, std::int64_t otherwise);
[[nodiscard]] double number(const Node& node, const char* attribute, double otherwise);
/// An axis counted from the end where it is negative. @throws Error if there is none.
[[nodiscard]] std::size_t axis_of(const Graph& graph, const Node& node, std::int64_t axis,
                                  std::size_t rank);

}  // namespace torsio::graph
