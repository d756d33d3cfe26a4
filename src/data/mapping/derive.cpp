#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "data/recording_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

std::vector<double> evaluated(const Recording& recording, FeaturePipeline& pipeline,
                              const std::string& name) {
  RecordingRows rows(recording, pipeline.raw_inputs());
  const bool has_memory = pipeline.settling_samples() > 0;
  std::vector<double> values(recording.size());
  pipeline.reset();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::span<const double> raw = rows.at(i);
    const auto missing = std::ranges::find_if_not(raw, [](double v) { return std::isfinite(v); });
    if (missing != raw.end() && has_memory) {
      const auto j = static_cast<std::size_t>(missing - raw.begin());
      throw Error(
          {.place = fmt::format("{}: {}, sample {}", recording.name(), rows.channels()[j]->name, i),
           .expected = "a number, for " + name + " is filtered from it",
           .found = "nan",
           .advice = "Hold the channel (hold:) or cut the gap out."});
    }
    values[i] = missing == raw.end() ? pipeline.step(raw)[0] : kNotMeasured;
  }
  return values;
}

}  // namespace

void add_derived(Recording& recording, const std::vector<ChannelDefinition>& definitions) {
  std::vector<Channel> derived;
  for (const ChannelDefinition& definition : definitions) {
    FeaturePipeline pipeline({.inputs = {definition.name}, .definitions = definitions},
                             recording.sample_rate_Hz());
    derived.push_back(
        {.name = definition.name, .values = evaluated(recording, pipeline, definition.name)});
  }
  for (Channel& channel : derived) recording.add(std::move(channel));
  recording.definitions.insert(recording.definitions.end(), definitions.begin(), definitions.end());
}

}  // namespace torsio
