#include "export/c_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// @param measured channels of which counts can be given
void check_counts(const CCounts& counts, const std::vector<std::string>& measured) {
  if (std::ranges::find(measured, counts.channel) == measured.end())
    throw UsageError({.place = "--counts",
                      .expected = fmt::format("one of {}", fmt::join(measured, ", ")),
                      .found = counts.channel});
  if (!counts.channel.ends_with("_rad"))
    throw UsageError({.place = "--counts",
                      .expected = "an angle in rad",
                      .found = counts.channel,
                      .advice = "Give the other inputs as numbers."});
  constexpr double kLargest = 2147483647.0;  // one turn of an int32_t
  if (!(std::abs(counts.counts_per_turn) >= 1.0 && std::abs(counts.counts_per_turn) <= kLargest))
    throw UsageError({.place = fmt::format("--counts of {}", counts.channel),
                      .expected = "the counts of a turn, from 1 to 2147483647; negative if the "
                                  "angle falls where they rise",
                      .found = fmt::format("{}", counts.counts_per_turn)});
}

}  // namespace

std::pair<std::string, double> whole_sum(
    const std::vector<std::pair<std::string, double>>& weighted, double offset) {
  double largest = 0.0;
  for (const auto& [name, weight] : weighted) largest = std::max(largest, std::abs(weight));
  constexpr double kLargestFactor =
      8388608.0;  // times 2^39 parts of 2^31 counts remains below 2^63
  const double scale = largest / kLargestFactor;
  std::string text;
  for (const auto& [name, weight] : weighted)
    text += fmt::format("{}INT64_C({}) * {}", text.empty() ? "" : " + ",
                        std::llround(weight / scale), name);
  if (offset != 0.0) text += fmt::format(" + INT64_C({})", std::llround(offset / scale));
  return {text, scale};
}

std::vector<CInput> c_inputs(const std::vector<std::string>& raw_inputs,
                             const EstimatorSettings& settings, const C99Options& options) {
  std::vector<CInput> inputs;
  inputs.reserve(raw_inputs.size());
  for (const std::string& channel : raw_inputs)
    inputs.push_back({.channel = channel,
                      .unit = {},
                      .has_zero = std::ranges::find(settings.zeroed_channels, channel) !=
                                  settings.zeroed_channels.end()});
  std::vector<std::string> measured = raw_inputs;
  if (options.controller)
    for (const std::string_view angle : kSampleAngles)
      if (std::ranges::find(measured, angle) == measured.end()) measured.emplace_back(angle);
  for (const CCounts& counts : options.counts) {
    check_counts(counts, measured);
    const auto own = std::ranges::find(inputs, counts.channel, &CInput::channel);
    if (own == inputs.end()) continue;  // an angle that the controller alone uses
    CInput& input = *own;
    if (input.is_counted())
      throw UsageError({.place = "--counts",
                        .expected = "each channel once",
                        .found = fmt::format("{} twice", counts.channel)});
    input.unit = 2.0 * std::numbers::pi / counts.counts_per_turn;
  }
  return inputs;
}

}  // namespace torsio
