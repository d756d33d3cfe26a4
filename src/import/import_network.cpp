#include "torsio/import/import_network.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "data/byte_source.hpp"
#include "fit/common/guards.hpp"
#include "import/network_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 16;

void check_scale(double scale, const char* place) {
  if (std::isfinite(scale) && scale != 0.0) return;
  throw UsageError({.place = place,
                    .expected = "a finite number other than 0",
                    .found = fmt::format("{}", scale)});
}

/// The network with the scales that its program applied outside of it, and its biases as asked for.
ForeignNetwork as_wanted(ForeignNetwork network, const ImportOptions& options) {
  network.fold_biases = options.fold_biases;
  if (!options.input_scale.empty()) {
    if (options.input_scale.size() != network.inputs)
      throw UsageError({.place = "--input-scale",
                        .expected = fmt::format("{} numbers, one per input", network.inputs),
                        .found = fmt::format("{}", options.input_scale.size())});
    for (const double scale : options.input_scale) check_scale(scale, "--input-scale");
    network.stages.insert(
        network.stages.begin(),
        AffineStage{options.input_scale, std::vector<double>(network.inputs, 0.0)});
  }
  check_scale(options.output_scale, "--output-scale");
  if (options.output_scale != 1.0)
    network.stages.emplace_back(AffineStage{{options.output_scale}, {0.0}});
  return network;
}

void check_inputs(const ForeignNetwork& network, const ImportOptions& options) {
  if (options.features.inputs.size() == network.inputs) return;
  throw UsageError({.place = "--inputs",
                    .expected = fmt::format("{} expressions, one per input of {}, in its order",
                                            network.inputs, network.place),
                    .found = fmt::format("{} ({})", options.features.inputs.size(),
                                         fmt::join(options.features.inputs, ", "))});
}

EstimatorSettings open_settings(const ImportOptions& options) {
  EstimatorSettings settings;
  settings.features = options.features;
  settings.sample_rate_Hz = options.sample_rate_Hz;
  settings.target = options.target;
  const std::size_t inputs = options.features.inputs.size();
  settings.ranges.lowest.assign(inputs, -kOpenRange);
  settings.ranges.highest.assign(inputs, kOpenRange);
  settings.fallback.slope.assign(inputs, 0.0);
  return settings;
}

Dataset all_for_training(Dataset dataset) {
  for (DatasetRecord& record : dataset.records)
    for (Segment& segment : record.segments) segment.role = Role::train;
  return dataset;
}

/// Raw inputs that any of the recordings has with its zero taken: the ranges are then of such.
std::vector<std::string> zeroed_inputs(const Dataset& dataset, const EstimatorSettings& settings) {
  const FeaturePipeline pipeline(settings.features, settings.sample_rate_Hz);
  std::vector<std::string> zeroed;
  for (const std::string& channel : pipeline.raw_inputs())
    if (std::ranges::any_of(dataset.records, [&](const DatasetRecord& record) {
          return std::ranges::find(record.recording.zeros, channel, &ZeroRule::channel) !=
                 record.recording.zeros.end();
        }))
      zeroed.push_back(channel);
  return zeroed;
}

ModelCard card_of(const ImportOptions& options, const Source& source) {
  ModelCard card;
  card.fitted_as = "imported";
  card.options = {{"imported_from", source.file},
                  {"imported_sha256", source.sha256},
                  {"output_scale", fmt::format("{}", options.output_scale)}};
  if (!options.input_scale.empty())
    card.options["input_scale"] = fmt::format("{}", fmt::join(options.input_scale, ","));
  return card;
}

}  // namespace

ForeignFile read_foreign_file(const std::string& path, const Progress& progress) {
  const std::unique_ptr<ByteSource> source = open_bytes(path, progress);
  ForeignFile file;
  std::array<char, kChunk> chunk{};
  while (const std::size_t size = source->read(chunk.data(), chunk.size())) {
    const auto bytes = std::as_bytes(std::span(chunk).first(size));
    file.bytes.insert(file.bytes.end(), bytes.begin(), bytes.end());
    if (file.bytes.size() > kMaxForeignBytes)
      throw Error({.place = path,
                   .expected = fmt::format("at most {} MiB of weights", kMaxForeignBytes >> 20),
                   .found = "more"});
  }
  file.source = {path, source->sha256()};
  return file;
}

ImportedModel import_network(const ForeignNetwork& network, const Source& source,
                             const ImportOptions& options, const Dataset* guards) {
  check_inputs(network, options);
  if (!std::isfinite(options.sample_rate_Hz) || options.sample_rate_Hz <= 0.0)
    throw UsageError({.place = "--rate",
                      .expected = "the sample rate that the network was trained at",
                      .found = fmt::format("{} Hz", options.sample_rate_Hz)});
  // A window of one sample asks for no others.
  const std::size_t window = network.window.value_or(1);
  const std::size_t warm_up = options.warm_up_samples.value_or(window > 1 ? window : 0);
  ImportedModel imported{
      .file = {.card = card_of(options, source),
               .settings = open_settings(options),
               .parameters = network_parameters(as_wanted(network, options),
                                                1.0 / options.sample_rate_Hz, warm_up)},
      .notes = network.notes};
  const AnyModel model(imported.file.parameters);
  if (guards == nullptr) {
    imported.notes.emplace_back(
        "the file does not contain the range of the training data: there is no range guard and no "
        "error bar, and the fallback is 0; --guards RECORDING computes them from measured data");
    return imported;
  }
  const TrainingData data = training_data(all_for_training(*guards), options.features);
  imported.file.settings = guarded_settings(options.features, data, model);
  imported.file.settings.sample_rate_Hz = options.sample_rate_Hz;
  imported.file.settings.zeroed_channels = zeroed_inputs(*guards, imported.file.settings);
  return imported;
}

}  // namespace torsio
