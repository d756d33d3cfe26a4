#include "estimate/estimator_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "core/checks.hpp"
#include "torsio/core/units.hpp"

namespace torsio::detail {
namespace {

bool is_error_bar(double std_dev) noexcept {
  return std::isnan(std_dev) || (std::isfinite(std_dev) && std_dev >= 0.0);
}

[[noreturn]] void refuse_settings(const ErrorPlace& place, std::string_view expected,
                                  std::string_view found) {
  refuse(place, expected, found, "Fit the model again: its settings do not fit together.");
}

void check_count(const char* place, std::size_t expected, std::size_t found) {
  if (expected != found)
    refuse_settings(place, fmt::format("{} values", expected), fmt::format("{}", found));
}

}  // namespace

void check_finite(const char* place, std::span<const double> values) {
  const auto bad =
      std::ranges::find_if_not(values, [](double value) { return std::isfinite(value); });
  if (bad != values.end())
    refuse_settings(fmt::format("{}[{}]", place, bad - values.begin()), "a finite number",
                    fmt::format("{}", *bad));
}

namespace {

void check_ranges(const FeatureRanges& ranges, const std::vector<std::string>& inputs) {
  check_count("guards.ranges.lowest", inputs.size(), ranges.lowest.size());
  check_count("guards.ranges.highest", inputs.size(), ranges.highest.size());
  check_finite("guards.ranges.lowest", ranges.lowest);
  check_finite("guards.ranges.highest", ranges.highest);
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (!(ranges.lowest[i] <= ranges.highest[i]))
      refuse_settings(fmt::format("guards.ranges of {}", inputs[i]), "lowest <= highest",
                      fmt::format("{} and {}", ranges.lowest[i], ranges.highest[i]));
  if (!std::isfinite(ranges.margin) || ranges.margin < 0.0)
    refuse_settings("guards.ranges.margin", "a finite number, at least 0",
                    fmt::format("{}", ranges.margin));
}

void check_fallback(const LinearFallback& fallback, std::size_t inputs) {
  check_count("fallback.slope", inputs, fallback.slope.size());
  check_finite("fallback.slope", fallback.slope);
  check_finite("fallback.intercept", {&fallback.intercept, 1});
  if (!is_error_bar(fallback.residual_std))
    refuse_settings("fallback.residual_std", "a number, at least 0, or NaN for none",
                    fmt::format("{}", fallback.residual_std));
}

void check_residuals(const ResidualTable& residuals) {
  const std::size_t regions = residuals.std_dev.size();
  check_count("residuals.edges", regions == 0 ? 0 : regions + 1, residuals.edges.size());
  check_finite("residuals.edges", residuals.edges);
  if (std::ranges::adjacent_find(residuals.edges, std::greater_equal<>{}) != residuals.edges.end())
    refuse_settings("residuals.edges", "ascending numbers",
                    "one that is not above the one before it");
  const auto bad = std::ranges::find_if_not(residuals.std_dev, is_error_bar);
  if (bad != residuals.std_dev.end())
    refuse_settings(fmt::format("residuals.std_dev[{}]", bad - residuals.std_dev.begin()),
                    "a number, at least 0, or NaN for none", fmt::format("{}", *bad));
}

void check_strokes(const StrokeGuard& strokes) {
  for (const auto& [name, value] : {std::pair{"longest_s", strokes.longest_s},
                                    {"dead_band", strokes.dead_band},
                                    {"growth", strokes.growth},
                                    {"limit", strokes.limit}})
    if (!std::isfinite(value) || value < 0.0)
      refuse_settings(fmt::format("guards.strokes.{}", name), "a finite number, at least 0",
                      fmt::format("{}", value));
}

void check_target_uncertainty(const SensorUncertainty& sensor) {
  for (const auto& [name, value] :
       {std::pair{"constant", sensor.constant}, {"relative", sensor.relative}})
    if (!std::isfinite(value) || value < 0.0)
      refuse_settings(fmt::format("target_uncertainty.{}", name), "a finite number, at least 0",
                      fmt::format("{}", value));
}

}  // namespace

void check_settings(const EstimatorSettings& settings, std::size_t model_input_count) {
  const std::vector<std::string>& inputs = settings.features.inputs;
  if (inputs.size() != model_input_count)
    refuse_settings("inputs", fmt::format("{}, as many as the model takes", model_input_count),
                    fmt::format("{} ({})", inputs.size(), fmt::join(inputs, ", ")));
  if (!split_channel_name(settings.target))
    refuse_settings("target", "a channel name that ends in its unit, such as torque_Nm",
                    fmt::format("'{}'", settings.target));
  check_ranges(settings.ranges, inputs);
  check_fallback(settings.fallback, inputs.size());
  check_residuals(settings.residuals);
  check_strokes(settings.strokes);
  check_target_uncertainty(settings.target_uncertainty);
}

void check_disturbances(const DisturbanceGuards& guards, std::size_t raw_inputs) {
  check_count("guards.disturbances.largest_step", guards.largest_step.empty() ? 0 : raw_inputs,
              guards.largest_step.size());
  for (std::size_t i = 0; i < guards.largest_step.size(); ++i)
    if (!is_error_bar(guards.largest_step[i]) || std::isnan(guards.largest_step[i]))
      refuse_settings(fmt::format("guards.disturbances.largest_step[{}]", i),
                      "a finite number, at least 0", fmt::format("{}", guards.largest_step[i]));
  if (!is_error_bar(guards.largest_travel))
    refuse_settings("guards.disturbances.largest_travel", "a number, at least 0, or NaN for none",
                    fmt::format("{}", guards.largest_travel));
  if (!is_error_bar(guards.warm_up_s))
    refuse_settings("guards.disturbances.warm_up_s", "a number, at least 0, or NaN for none",
                    fmt::format("{}", guards.warm_up_s));
}

void check_zeroed(const std::vector<std::string>& channels,
                  const std::vector<std::string>& raw_inputs) {
  for (const std::string& channel : channels)
    if (std::ranges::find(raw_inputs, channel) == raw_inputs.end())
      refuse_settings("zeroed_channels", fmt::format("some of {}", fmt::join(raw_inputs, ", ")),
                      fmt::format("'{}'", channel));
}

}  // namespace torsio::detail
