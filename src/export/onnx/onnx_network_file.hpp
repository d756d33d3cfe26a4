#pragma once

#include <string>

#include "torsio/export/onnx_file.hpp"

namespace torsio {

/// The network of an mlp, gru or lstm alone.
[[nodiscard]] std::string network_onnx(const ModelFile& model, const OnnxOptions& options,
                                       const std::string& description);

}  // namespace torsio
