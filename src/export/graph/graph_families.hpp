#pragma once

#include <string>

#include "export/graph/graph_models.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/fault.hpp"

namespace torsio {

[[nodiscard]] double fault_number(Fault fault) noexcept;
/// A value without an error bar and without a fault.
[[nodiscard]] GraphEstimate plain_estimate(Row value);

struct GraphMotion {
  Row change = {};       ///< since the last step of the model; 0 in the first one
  Row has_started = {};  ///< a truth: this is not the first one
};
[[nodiscard]] GraphMotion motion(GraphBuilder& graph, const std::string& name, Row x);

[[nodiscard]] GraphEstimate add_grey_box(GraphBuilder& graph, const GreyBox::Parameters& p, Row x);
[[nodiscard]] GraphEstimate add_network(GraphBuilder& graph, const Mlp::Parameters& p, Row x);
[[nodiscard]] GraphEstimate add_network(GraphBuilder& graph, const Gru::Parameters& p, Row x);
[[nodiscard]] GraphEstimate add_network(GraphBuilder& graph, const Lstm::Parameters& p, Row x);
[[nodiscard]] GraphEstimate add_parametric_gp(GraphBuilder& graph,
                                              const ParametricGp::Parameters& p, Row features);

/// Inputs about their centres, in units of their scales.
[[nodiscard]] Row standardised_row(GraphBuilder& graph, const NetworkScaling& scaling, Row x);

/// The value of the process alone.
[[nodiscard]] Row gp_mean_row(GraphBuilder& graph, const ParametricGp::Parameters& p, Row features);

/// The output of a static network for these inputs, without its scaling's fault.
[[nodiscard]] Row network_row(GraphBuilder& graph, const Mlp::Parameters& p, Row x);

}  // namespace torsio
