#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/not_measured.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

std::vector<double> evaluated(const Recording& recording, FeaturePipeline& pipeline,
                              const std::string& name) {
  std::vector<const Channel*> inputs;
  for (const std::string& input : pipeline.raw_inputs())
    inputs.push_back(&recording.channel(input));
  const bool has_memory = pipeline.settling_samples() > 0;
  std::vector<double> raw(inputs.size());
  std::vector<double> values(recording.size());
  pipeline.reset();
  for (std::size_t i = 0; i < values.size(); ++i) {
    bool is_complete = true;
    for (std::size_t j = 0; j < inputs.size(); ++j) {
      raw[j] = inputs[j]->values[i];
      if (std::isfinite(raw[j])) continue;
      is_complete = false;
      if (has_memory)
        throw Error(
            {.place = fmt::format("{}: {}, sample {}", recording.name(), inputs[j]->name, i),
             .expected = "a number, for " + name + " is filtered from it",
             .found = "nan",
             .advice = "Hold the channel (hold:) or cut the gap out."});
    }
    values[i] = is_complete ? pipeline.step(raw)[0] : kNotMeasured;
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
