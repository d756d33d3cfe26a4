#include <utility>

#include "bindings.hpp"
#include "torsio/import/import_network.hpp"
#ifdef TORSIO_HAS_ONNX
#include "torsio/import/onnx_network.hpp"
#endif

namespace torsio::python {
namespace {

ForeignNetwork graph_of(const ForeignFile& file, const std::string& path,
                        const std::string& activation, const std::string& output_name) {
  if (!activation.empty())
    throw UsageError({.place = "activation",
                      .problem = "an ONNX graph contains its activations",
                      .advice = "Omit activation."});
#ifdef TORSIO_HAS_ONNX
  return parse_onnx(file.bytes, path, output_name);
#else
  throw Error({.place = path,
               .expected = "weights as JSON",
               .found = std::to_string(file.bytes.size()) + " bytes of another format",
               .advice = "This torsio was built without ONNX (" + output_name +
                         "): install libonnx-dev "
                         "and libprotobuf-dev and build it again."});
#endif
}

ForeignNetwork weights_of(const ForeignFile& file, const std::string& path,
                          const std::string& activation, const std::string& output_name) {
  if (!output_name.empty())
    throw UsageError({.place = "output_name",
                      .problem = "weights as JSON have no graph with outputs",
                      .advice = "Omit output_name."});
  std::optional<Activation> chosen;
  if (!activation.empty()) chosen = activation_of(activation);
  return parse_weights_json(file.bytes, path, chosen);
}

/// As `torsio import`.
Model import_file(const std::string& path, const ImportOptions& options,
                  const std::string& activation, const std::string& output_name,
                  const std::optional<Dataset>& guards, const std::string& serial) {
  return interruptible([&](const Progress& progress) {
    const ForeignFile file = read_foreign_file(path, progress);
    const ForeignNetwork network = is_weights_json(file.bytes)
                                       ? weights_of(file, path, activation, output_name)
                                       : graph_of(file, path, activation, output_name);
    ImportedModel imported =
        import_network(network, file.source, options, guards ? &*guards : nullptr);
    imported.file.card.device_serial = serial;
    return Model{std::make_shared<const ModelFile>(parse_model(model_bytes(imported.file), path)),
                 std::move(imported.notes)};
  });
}

}  // namespace

void bind_imports(py::module_& module) {
  module.def(
      "import_network",
      [](const py::object& path, std::vector<std::string> inputs, double rate_Hz,
         const std::string& target, std::vector<double> input_scale, double output_scale,
         const std::string& activation, const std::string& output_name,
         std::optional<std::size_t> warm_up_samples, bool folds_biases,
         const std::optional<Dataset>& guards, const std::string& serial) {
        return import_file(path_text(path),
                           {.features = {.inputs = std::move(inputs), .definitions = {}},
                            .target = target,
                            .sample_rate_Hz = rate_Hz,
                            .input_scale = std::move(input_scale),
                            .output_scale = output_scale,
                            .warm_up_samples = warm_up_samples,
                            .fold_biases = folds_biases},
                           activation, output_name, guards, serial);
      },
      py::arg("path"), py::arg("inputs"), py::arg("rate_Hz"), py::arg("target"),
      py::arg("input_scale"), py::arg("output_scale"), py::arg("activation"),
      py::arg("output_name"), py::arg("warm_up_samples"), py::arg("folds_biases"),
      py::arg("guards"), py::arg("serial"));
}

}  // namespace torsio::python
