#include <fmt/format.h>

#include <optional>
#include <utility>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/model_description.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/import/import_network.hpp"
#include "verbs.hpp"
#ifdef TORSIO_HAS_ONNX
#include "torsio/import/onnx_network.hpp"
#endif

namespace {

struct ImportFlags {
  std::string file;
  DataFlags data;  ///< its recordings are those from which the guards are computed
  std::vector<double> input_scale;
  double output_scale = 1.0;
  std::string activation;
  std::string graph_output;
  bool fold_biases = false;
  std::optional<std::size_t> warm_up;
  std::string output;
  std::string device_serial;
  JsonOutput json;
};

constexpr const char* kExample =
    "Example: torsio import anydrive.json --inputs \"joint_target_rad - joint_angle_rad, "
    "joint_speed_rad_s\" --rate 200Hz -o joint.safetensors";

torsio::ForeignNetwork read_graph(const ImportFlags& flags,
                                  [[maybe_unused]] const torsio::ForeignFile& file) {
  if (!flags.activation.empty())
    throw torsio::UsageError({.place = "--activation",
                              .problem = "an ONNX graph contains its activations",
                              .advice = "Omit --activation."});
#ifdef TORSIO_HAS_ONNX
  return torsio::parse_onnx(file.bytes, flags.file, flags.graph_output);
#else
  throw torsio::Error({.place = flags.file,
                       .expected = "weights as JSON",
                       .found = "another format",
                       .advice = "This torsio was built without ONNX: install libonnx-dev and "
                                 "libprotobuf-dev and build it again."});
#endif
}

torsio::ForeignNetwork read_weights(const ImportFlags& flags, const torsio::ForeignFile& file) {
  if (!flags.graph_output.empty())
    throw torsio::UsageError({.place = "--output-name",
                              .problem = "weights as JSON have no graph with outputs",
                              .advice = "Omit --output-name."});
  std::optional<torsio::Activation> activation;
  if (!flags.activation.empty()) activation = torsio::activation_of(flags.activation);
  return torsio::parse_weights_json(file.bytes, flags.file, activation);
}

torsio::ImportOptions options_of(const ImportFlags& flags) {
  // Not inside the braces below: if it throws there, g++ 12 destroys members that were never made.
  const double rate_Hz = torsio::signed_quantity_with_unit(flags.data.rate, "Hz", "--rate");
  return {.features = {.inputs = flags.data.wanted_inputs(), .definitions = {}},
          .target = flags.data.target.empty() ? "torque_Nm" : flags.data.target,
          .sample_rate_Hz = rate_Hz,
          .input_scale = flags.input_scale,
          .output_scale = flags.output_scale,
          .warm_up_samples = flags.warm_up,
          .fold_biases = flags.fold_biases};
}

void run(ImportFlags& flags) {
  if (flags.data.inputs.empty() || flags.data.rate.empty() || flags.output.empty())
    throw torsio::UsageError({.place = "torsio import",
                              .expected = "--inputs, --rate and -o: the file does not specify the "
                                          "inputs of its network, nor the sample rate",
                              .advice = kExample});
  flags.data.check_outputs({flags.output, flags.json.destination}, {flags.file});
  require_model_file(flags.output);
  ProgressBar progress;
  const torsio::ForeignFile file = torsio::read_foreign_file(flags.file, progress.listener());
  const torsio::ForeignNetwork network =
      torsio::is_weights_json(file.bytes) ? read_weights(flags, file) : read_graph(flags, file);
  std::optional<torsio::Dataset> guards;
  if (!flags.data.recordings.empty()) guards = flags.data.load({}, {}, progress.listener());
  torsio::ImportedModel imported =
      torsio::import_network(network, file.source, options_of(flags), guards ? &*guards : nullptr);
  imported.file.card.device_serial = flags.device_serial;
  const torsio::ModelFile model =
      torsio::parse_model(torsio::model_bytes(imported.file), flags.output);
  const torsio::SlowCycle cycle = torsio::slow_cycle(model, progress.listener());
  if (flags.json.wants_tables()) print(torsio::model_description(model, cycle));
  flags.json.write(torsio::model_description_json(model, cycle));
  torsio::save_model(flags.output, imported.file);  // last: untouched unless all else succeeded
  for (const std::string& note : imported.notes) remark_note(note);
  remark(flags.output + " written");
}

}  // namespace

void add_import(CLI::App& app) {
  auto flags = std::make_shared<ImportFlags>();
  CLI::App* verb = app.add_subcommand(
      "import", "convert a network that another program trained into a model file");
  verb->footer(kExample);
  verb->add_option("FILE", flags->file, "ONNX graph, or PyTorch weights by name as JSON")
      ->required();
  verb->add_option("--inputs", flags->data.inputs,
                   "inputs of the network, in its order: expressions of channels, separated by "
                   "commas");
  verb->add_option("--target", flags->data.target,
                   "channel that the network estimates (default torque_Nm)");
  verb->add_option("--rate", flags->data.rate,
                   "sample rate that the network was trained at; recordings are resampled to it");
  verb->add_option(
          "--input-scale", flags->input_scale,
          "factors by which its program multiplied the inputs, separated by commas (default 1)")
      ->delimiter(',');
  verb->add_option("--output-scale", flags->output_scale,
                   "factor by which its program multiplied the output (default 1)");
  verb->add_option(
      "--activation", flags->activation,
      "activation of the hidden dense layers of JSON weights: linear, relu, tanh, softsign or elu");
  verb->add_option("--output-name", flags->graph_output,
                   "the output of an ONNX graph that estimates the target (default: its first)");
  verb->add_option(
      "--warm-up", flags->warm_up,
      "samples after a reset before a network with memory is valid (default: the graph's "
      "window, else 0)");
  verb->add_flag(
      "--fold-biases", flags->fold_biases,
      "one bias per gate of an LSTM: a faster step, which is rounded differently than in PyTorch");
  verb->add_option("--guards", flags->data.recordings,
                   "recordings from which range guard, fallback and error bar are computed");
  verb->add_option("--mapping", flags->data.mapping,
                   "YAML file that renames and converts the columns of these recordings");
  verb->add_option("-o,--output", flags->output,
                   "model file; untouched unless the import succeeds");
  verb->add_option("--device-serial", flags->device_serial,
                   "serial number of the joint that the model belongs to");
  flags->json.add(*verb, "the model's description");
  verb->callback([flags] { run(*flags); });
}
