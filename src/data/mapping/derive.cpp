#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "data/mapping/columns.hpp"
#include "data/recording_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"
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

/// The channel whose new samples a channel of that name marks; empty if there is none.
std::string marked_channel(const Recording& recording, std::string_view name) {
  const std::string_view quantity = marked_quantity(name);
  if (quantity.empty()) return {};
  for (const Channel& channel : recording.channels())
    if (const auto parts = split_channel_name(channel.name); parts && parts->quantity == quantity)
      return channel.name;
  return {};
}

std::vector<std::uint8_t> mask_from(const Channel& channel, const Recording& recording) {
  std::vector<std::uint8_t> fresh;
  for (const double value : channel.values) {
    if (value != 0.0 && value != 1.0 && std::isfinite(value))
      throw Error(
          {.place = fmt::format("{}: {}, sample {}", recording.name(), channel.name, fresh.size()),
           .expected = "1 (new sample) or 0 (held)",
           .found = fmt::format("{}", value)});
    fresh.push_back(value == 1.0 ? 1 : 0);
  }
  return fresh;
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
  for (std::size_t i = 0; i < derived.size(); ++i) {
    if (const std::string marked = marked_channel(recording, derived[i].name); !marked.empty()) {
      recording.mark_fresh(marked, mask_from(derived[i], recording));
      continue;
    }
    recording.add(std::move(derived[i]));
    recording.definitions.push_back(definitions[i]);
  }
}

}  // namespace torsio
