#pragma once

#include <string>

#include "torsio/export/step_graph.hpp"

namespace torsio {

[[nodiscard]] std::string estimator_onnx(const StepGraph& graph, const std::string& description);

}  // namespace torsio
