#include "torsio/fit/common/inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "core/all_finite.hpp"
#include "core/did_you_mean.hpp"
#include "data/channel_names.hpp"
#include "data/mapping/canonical_channels.hpp"
#include "data/mapping/needed_definitions.hpp"
#include "data/recording_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

/// The cut-off of the filtered rates is 10 Hz, in slow logs a fifth of the sample rate.
std::vector<std::string> default_inputs(double sample_rate_Hz) {
  const double cut_off_Hz = std::min(10.0, 0.2 * sample_rate_Hz);
  return {"spring_deflection_rad",
          fmt::format("lowpass(spring_deflection_rate_rad_s, {:g}Hz)", cut_off_Hz),
          fmt::format("lowpass(joint_speed_rad_s, {:g}Hz)", cut_off_Hz)};
}

bool defines(const std::vector<ChannelDefinition>& definitions, std::string_view name) {
  return std::ranges::any_of(definitions,
                             [&](const ChannelDefinition& known) { return known.name == name; });
}

bool every_record_has(const Dataset& dataset, std::string_view channel) {
  return std::ranges::all_of(
      dataset.records, [&](const DatasetRecord& record) { return record.recording.has(channel); });
}

/// Whether `expression` can be computed from recorded channels and `definitions`.
bool is_computable(const Dataset& dataset, const std::vector<ChannelDefinition>& definitions,
                   std::string_view expression) {
  return std::ranges::all_of(channels_of(expression), [&](const std::string& channel) {
    return every_record_has(dataset, channel) || defines(definitions, channel);
  });
}

/// A name must have the same definition in every record.
void refuse_conflicts(const Dataset& dataset) {
  std::map<std::string, std::pair<std::string, std::string>> met;  // name: expression, record
  for (const DatasetRecord& record : dataset.records)
    for (const ChannelDefinition& definition : record.recording.definitions) {
      const auto& [expression, first] =
          met.try_emplace(definition.name, definition.expression, record.recording.name())
              .first->second;
      if (expression != definition.expression)
        throw Error({.place = record.recording.name() + ": " + definition.name,
                     .problem = "the recordings define this channel differently",
                     .expected = fmt::format("{}, as in {}", expression, first),
                     .found = definition.expression,
                     .advice = "Give both the same derive: in their mappings, or two names."});
    }
}

/// The mapping's definitions whose sources still exist, then the canonical channels that were not
/// recorded.
std::vector<ChannelDefinition> known_definitions(const Dataset& dataset) {
  refuse_conflicts(dataset);
  std::vector<ChannelDefinition> definitions;
  for (const ChannelDefinition& definition : dataset.records.front().recording.definitions)
    if (is_computable(dataset, definitions, definition.expression))
      definitions.push_back(definition);
  for (const CanonicalChannel& channel : kCanonicalChannels)
    if (!defines(definitions, channel.name) && !every_record_has(dataset, channel.name) &&
        is_computable(dataset, definitions, channel.expression))
      definitions.push_back({std::string(channel.name), std::string(channel.expression)});
  return definitions;
}

[[noreturn]] void refuse_missing(const Recording& recording, const std::string& channel,
                                 const std::vector<ChannelDefinition>& definitions) {
  std::vector<std::string> names = channel_names(recording.channels());
  const std::string found = fmt::format("{}", fmt::join(names, ", "));
  for (const ChannelDefinition& definition : definitions) names.push_back(definition.name);
  const std::string nearest = did_you_mean(channel, names);
  throw UsageError({.place = recording.name(),
                    .expected = "the channel " + channel + ", which an input needs",
                    .found = found,
                    .advice = nearest.empty()
                                  ? "Choose other --inputs, or bring the channel in with --mapping."
                                  : nearest});
}

/// Runs `parse` for expressions that the caller wrote.
template <class Parse>
auto as_asked(const Parse& parse) {
  try {
    return parse();
  } catch (const Error& error) {
    throw UsageError(error.report());
  }
}

}  // namespace

FeatureSpec resolve_inputs(const Dataset& dataset, const std::vector<std::string>& wanted) {
  if (dataset.records.empty()) throw Error({.problem = "the dataset has no recordings"});
  const std::vector<ChannelDefinition> definitions = known_definitions(dataset);
  std::vector<std::string> inputs = wanted;
  if (inputs.empty() && !dataset.input_sets.empty()) inputs = dataset.input_sets.front().second;
  if (const auto defaults = default_inputs(dataset.sample_rate_Hz());
      inputs.empty() && is_computable(dataset, definitions, defaults.front()))
    std::ranges::copy_if(defaults, std::back_inserter(inputs), [&](const std::string& input) {
      return is_computable(dataset, definitions, input);
    });
  const Recording& first = dataset.records.front().recording;
  if (inputs.empty())
    throw UsageError({.place = first.name(),
                      .expected = "spring_deflection_rad, or gear_angle_rad and joint_angle_rad",
                      .found = fmt::format("{}", fmt::join(channel_names(first.channels()), ", ")),
                      .advice = first.has("motor_angle_rad") && first.has("joint_angle_rad")
                                    ? "motor_angle_rad is before the gear. In the mapping, name it "
                                      "gear_angle_rad and state the ratio:  gear_angle_rad: {from: "
                                      "COLUMN, gear_ratio: N}"
                                    : "Name the model's inputs with --inputs, or bring the "
                                      "deflection in with "
                                      "--mapping: derive or rename it there."});
  FeatureSpec spec = as_asked([&] {
    std::vector<std::string> channels;
    for (const std::string& input : inputs)
      std::ranges::copy(channels_of(input), std::back_inserter(channels));
    return FeatureSpec{inputs, needed_definitions(definitions, channels)};
  });
  const FeaturePipeline pipeline =
      as_asked([&] { return FeaturePipeline(spec, dataset.sample_rate_Hz()); });
  for (const std::string& channel : pipeline.raw_inputs())
    for (const DatasetRecord& record : dataset.records)
      if (!record.recording.has(channel)) refuse_missing(record.recording, channel, definitions);
  if (std::ranges::find(pipeline.raw_inputs(), dataset.target) != pipeline.raw_inputs().end())
    throw UsageError(
        {.problem = "the target " + dataset.target + " is among the inputs of the model",
         .advice = "A model that is given its answer learns nothing: choose other --inputs."});
  return spec;
}

std::vector<double> first_feature(const Recording& recording, const FeatureSpec& spec) {
  FeaturePipeline pipeline(spec, recording.sample_rate_Hz());
  RecordingRows rows(recording, pipeline.raw_inputs());
  std::vector<double> values(recording.size(), kNotMeasured);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::span<const double> raw = rows.at(i);
    if (all_finite(raw)) values[i] = pipeline.step(raw).front();
  }
  return values;
}

}  // namespace torsio
