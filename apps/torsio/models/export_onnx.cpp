#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/files/model_file.hpp"
#ifdef TORSIO_HAS_ONNX
#include "torsio/export/onnx_file.hpp"
#include "torsio/export/step_graph.hpp"
#endif

namespace {

#ifdef TORSIO_HAS_ONNX
torsio::OnnxLayout layout_of(const std::string& text) {
  if (text.empty() || text == "estimator") return torsio::OnnxLayout::estimator;
  if (text == "network") return torsio::OnnxLayout::network;
  if (text == "newton") return torsio::OnnxLayout::newton;
  if (text == "isaaclab")
    throw torsio::UsageError(
        {.place = "--layout isaaclab",
         .problem = "Isaac Lab loads TorchScript, not ONNX",
         .advice = "Write it with: python3 -m torsio.torch MODEL --layout isaaclab -o FILE.pt"});
  throw torsio::UsageError(
      {.place = "--layout", .expected = "estimator, network, newton or isaaclab", .found = text});
}

torsio::GraphPrecision precision_of_graph(const ExportFlags& flags, torsio::OnnxLayout layout) {
  if (layout != torsio::OnnxLayout::estimator && !flags.real.empty() && flags.real != "float")
    throw torsio::UsageError({.place = "--real " + flags.real,
                              .problem = "a network alone computes in float, as the model does",
                              .advice = "Remove it, or take --layout estimator."});
  return precision_of(flags, torsio::GraphPrecision::twofold);
}

/// What a program has to know that steps the graph.
void add_graph(nlohmann::json& document, const torsio::ModelFile& model,
               torsio::GraphPrecision precision) {
  const torsio::StepGraph graph = torsio::step_graph(model, {.precision = precision});
  nlohmann::json faults = nlohmann::json::array();
  for (std::size_t i = 0; i < torsio::kFaultCount; ++i)
    faults.push_back(std::string(name(static_cast<torsio::Fault>(i))));
  document["real"] = precision == torsio::GraphPrecision::single ? "float" : "double";
  document["inputs"] = graph.raw_inputs;
  document["zeroed_channels"] = graph.zeroed_channels;
  document["target"] = graph.target;
  document["sample_rate_Hz"] = graph.sample_rate_Hz;
  document["state_width"] = graph.state_width;
  document["faults"] = faults;
}
#endif

}  // namespace

void export_onnx([[maybe_unused]] ExportFlags& flags) {
#ifdef TORSIO_HAS_ONNX
  require_ending("-o", flags.output, {".onnx"});
  const torsio::OnnxLayout layout = layout_of(flags.layout);
  const torsio::GraphPrecision precision = precision_of_graph(flags, layout);
  const torsio::ModelFile model = torsio::load_model(flags.model);
  const std::string bytes =
      torsio::onnx_bytes(model, {.layout = layout,
                                 .precision = precision,
                                 .origin = std::filesystem::path(flags.model).filename().string()});
  require_new(flags, flags.output);
  write_text(flags.output, bytes);
  if (flags.json.wants_tables())
    print(fmt::format("{} written: {}, {}, {} B, one tick at {:g} Hz\n", flags.output,
                      model.parameters.family(), flags.layout.empty() ? "estimator" : flags.layout,
                      bytes.size(), model.settings.sample_rate_Hz));
  nlohmann::json document = export_document(model);
  document["file"] = flags.output;
  document["layout"] = flags.layout.empty() ? "estimator" : flags.layout;
  document["bytes"] = bytes.size();
  if (layout == torsio::OnnxLayout::estimator) add_graph(document, model, precision);
  flags.json.write(document.dump(2) + "\n");
#else
  throw torsio::Error({.place = "--onnx",
                       .problem = "this torsio was built without ONNX",
                       .advice = "Install libonnx-dev and libprotobuf-dev and build it again."});
#endif
}

void export_torchscript(ExportFlags& flags) {
  std::string options;
  if (!flags.layout.empty()) options += " --layout " + flags.layout;
  if (!flags.real.empty()) options += " --real " + flags.real;
  throw torsio::UsageError(
      {.place = "--torchscript",
       .problem = "TorchScript is written by PyTorch",
       .advice = fmt::format(
           "With the Python module and PyTorch installed: python3 -m torsio.torch {}{} -o {}",
           flags.model, options, flags.output)});
}
