#pragma once

#include <cstdint>
#include <string>

#include "torsio/export/step_graph.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// What an ONNX file contains.
enum class OnnxLayout : std::uint8_t {
  estimator,  ///< a tick of the estimator: a `StepGraph`
  network,    ///< the network of an mlp, gru or lstm alone, from its features
  newton,     ///< the same from position error and speed, as Newton's neural drives load it
};

struct OnnxOptions {
  OnnxLayout layout = OnnxLayout::estimator;
  GraphPrecision precision = GraphPrecision::twofold;  ///< for `estimator`
  std::string origin = {};                             ///< the model's file, for the description
};

/// A model as an ONNX file (library `torsio::onnx`): operator set 13, weights inside.
///
/// `estimator` has the inputs `inputs` (joints x raw inputs, SI) and `state` (joints x width; zeros are the state after a
/// reset) and, unless the model does not depend on time, `timestep_s` (1 x 1), and the outputs `value`, `std_dev`, `fault` (int32, as `Fault`) and `next_state`. Names, units and the sample rate
/// are in its metadata.
/// @throws UsageError for another family, or features that the layout does not have
[[nodiscard]] std::string onnx_bytes(const ModelFile& model, const OnnxOptions& options = {});

}  // namespace torsio
