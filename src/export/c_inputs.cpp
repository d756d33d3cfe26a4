#include "export/c_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

void check_counts(const CCounts& counts, const std::vector<std::string>& raw_inputs) {
  if (std::ranges::find(raw_inputs, counts.channel) == raw_inputs.end())
    throw UsageError(
        {.place = "--counts",
         .expected = fmt::format("an input of the model: {}", fmt::join(raw_inputs, ", ")),
         .found = counts.channel});
  if (!counts.channel.ends_with("_rad"))
    throw UsageError({.place = "--counts",
                      .expected = "an angle in rad",
                      .found = counts.channel,
                      .advice = "Give the other inputs as numbers."});
  if (!std::isfinite(counts.counts_per_turn) || std::abs(counts.counts_per_turn) < 1.0)
    throw UsageError(
        {.place = fmt::format("--counts of {}", counts.channel),
         .expected =
             "the counts of a turn, at least 1; negative if the angle falls where they rise",
         .found = fmt::format("{}", counts.counts_per_turn)});
}

}  // namespace

std::vector<CInput> c_inputs(const std::vector<std::string>& raw_inputs,
                             const EstimatorSettings& settings, const C99Options& options) {
  std::vector<CInput> inputs;
  for (const std::string& channel : raw_inputs)
    inputs.push_back({.channel = channel,
                      .unit = {},
                      .has_zero = std::ranges::find(settings.zeroed_channels, channel) !=
                                  settings.zeroed_channels.end()});
  for (const CCounts& counts : options.counts) {
    check_counts(counts, raw_inputs);
    CInput& input = *std::ranges::find(inputs, counts.channel, &CInput::channel);
    if (input.is_counted())
      throw UsageError({.place = "--counts",
                        .expected = "each channel once",
                        .found = fmt::format("{} twice", counts.channel)});
    input.unit = 2.0 * std::numbers::pi / counts.counts_per_turn;
  }
  return inputs;
}

}  // namespace torsio
