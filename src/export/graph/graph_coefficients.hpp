#pragma once

#include "export/graph/graph_builder.hpp"
#include "model/common/schedule.hpp"

namespace torsio {

/// The coefficients of a model for these features: one row, a constant if they are not scheduled.
[[nodiscard]] Row coefficients(GraphBuilder& graph, const CoefficientSchedule& schedule, Row x);

}  // namespace torsio
