#include "torsio/export/onnx_file.hpp"

#include <fmt/format.h>

#include "export/onnx/onnx_estimator.hpp"
#include "export/onnx/onnx_network_file.hpp"
#include "torsio/core/version.hpp"
#include "torsio/export/step_graph.hpp"

namespace torsio {
namespace {

std::string description_of(const ModelFile& model, const OnnxOptions& options) {
  const char* const contents =
      options.layout == OnnxLayout::estimator
          ? "A tick of its estimator: pipeline, model, guards, fallback, error bar and fault. Use "
            "a value only where its fault "
            "is 0. There is no rule of jumps of a sensor; a tick without inputs is a long gap."
          : "Its network alone: no guards, no fault, no error bar, and no limit outside of its "
            "training.";
  return fmt::format(
      "Written by torsio {} from {} ({}). {} One evaluation is one tick at {:g} Hz: call it at no "
      "other rate.",
      kVersion, options.origin, model.parameters.family(), contents, model.settings.sample_rate_Hz);
}

}  // namespace

std::string onnx_bytes(const ModelFile& model, const OnnxOptions& options) {
  const std::string description = description_of(model, options);
  if (options.layout != OnnxLayout::estimator) return network_onnx(model, options, description);
  return estimator_onnx(step_graph(model, {.precision = options.precision}), description);
}

}  // namespace torsio
