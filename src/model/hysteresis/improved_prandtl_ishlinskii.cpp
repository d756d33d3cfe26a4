#include "model/hysteresis/improved_prandtl_ishlinskii.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "model/hysteresis/broken_line.hpp"
#include "model/hysteresis/hysteresis_checks.hpp"
#include "model/hysteresis/other_inputs.hpp"

namespace torsio {
namespace {

constexpr auto kFamily = ImprovedPrandtlIshlinskii::kFamily;

void check(const ImprovedPrandtlIshlinskii::Parameters& parameters) {
  const auto same = [](std::size_t found, std::size_t expected, std::string_view field) {
    require(found == expected, {kFamily, field}, std::to_string(expected) + " numbers",
            static_cast<double>(found));
  };
  require(!parameters.slopes.empty(), {kFamily, "slopes"}, "one for each input", 0.0);
  same(parameters.weights.size(), parameters.thresholds.size(), "weights");
  same(parameters.bends.size(), parameters.knots.size(), "bends");
  require(std::isfinite(parameters.bias), {kFamily, "bias"}, "a finite number", parameters.bias);
  require_finite(parameters.slopes, kFamily, "slopes");
  require_finite(parameters.weights, kFamily, "weights");
  require(std::isfinite(parameters.rate_gain) && parameters.rate_gain >= 0.0,
          {kFamily, "rate_gain"}, "a number not below 0", parameters.rate_gain);
  require(parameters.rate_feature < parameters.slopes.size(), {kFamily, "rate_feature"},
          "one of the inputs", static_cast<double>(parameters.rate_feature));
  double before = -std::numeric_limits<double>::infinity();
  for (const double knot : parameters.knots) {
    require(std::isfinite(knot) && knot > before && knot != 0.0, {kFamily, "knots"},
            "ascending numbers, none of them 0", knot);
    before = knot;
  }
  require_finite(parameters.bends, kFamily, "bends");
}

/// From 0 outwards the slope of S changes by g_j at each knot. @returns the largest slope
double require_rising(const ImprovedPrandtlIshlinskii::Parameters& parameters) {
  double up = 1.0;
  double down = 1.0;
  double steepest = 1.0;
  const std::size_t count = parameters.knots.size();
  for (std::size_t j = 0; j < count; ++j) {
    if (parameters.knots[j] > 0.0) up += parameters.bends[j];
    if (parameters.knots[count - 1 - j] < 0.0) down += parameters.bends[count - 1 - j];
    require(up > 0.0 && down > 0.0, {kFamily, "bends"},
            "a curve that rises everywhere, sums from 0 outwards above -1",
            std::min(up, down) - 1.0);
    steepest = std::max({steepest, up, down});
  }
  return steepest;
}

}  // namespace

ImprovedPrandtlIshlinskii::ImprovedPrandtlIshlinskii(const Parameters& parameters)
    : parameters_(parameters),
      stops_(ascending_thresholds(parameters.thresholds, kFamily), kFamily),
      limits_(parameters.thresholds),
      play_sum_(std::accumulate(parameters.weights.begin(), parameters.weights.end(), 0.0)) {
  check(parameters);
  steepest_ = require_rising(parameters);
}

std::size_t ImprovedPrandtlIshlinskii::parameter_count() const noexcept {
  return 2 + non_zero(parameters_.slopes) + non_zero(parameters_.weights) +
         non_zero(parameters_.bends);
}

ModelMemory ImprovedPrandtlIshlinskii::memory(const InputRanges& ranges) const {
  const std::size_t rate = parameters_.rate_feature;
  const double fastest = ranges.largest_magnitude(rate);
  const double scale = 1.0 + parameters_.rate_gain * fastest;
  ModelMemory memory;
  for (std::size_t i = 0; i < parameters_.weights.size(); ++i)
    memory.slips.push_back(
        {steepest_ * std::abs(parameters_.weights[i]), 2.0 * scale * parameters_.thresholds[i]});
  return memory;
}

void ImprovedPrandtlIshlinskii::reset() noexcept {
  stops_.reset();
  increment_.reset();
}

double ImprovedPrandtlIshlinskii::bent(double v) const noexcept {
  double value = v;
  for (std::size_t j = 0; j < parameters_.knots.size(); ++j) {
    const double knot = parameters_.knots[j];
    value +=
        parameters_.bends[j] * (knot > 0.0 ? std::max(v - knot, 0.0) : std::min(v - knot, 0.0));
  }
  return value;
}

double ImprovedPrandtlIshlinskii::straightened(double y) const noexcept {
  double v = 0.0;
  double at = 0.0;
  double slope = 1.0;
  const std::size_t count = parameters_.knots.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t j = y > 0.0 ? i : count - 1 - i;
    const double knot = parameters_.knots[j];
    if ((knot > 0.0) != (y > 0.0)) continue;
    const double there = at + slope * (knot - v);
    if (std::abs(there) >= std::abs(y)) break;
    v = knot;
    at = there;
    slope += parameters_.bends[j];
  }
  return v + (y - at) / slope;
}

double ImprovedPrandtlIshlinskii::limit_scale(Features features) const noexcept {
  return std::min(1.0 + parameters_.rate_gain * std::abs(features[parameters_.rate_feature]),
                  std::numeric_limits<double>::max());
}

Estimate ImprovedPrandtlIshlinskii::step(Features features) noexcept {
  stops_.move(increment_.step(features[0]), limit_scale(features));
  const double v =
      (parameters_.slopes[0] + play_sum_) * features[0] - stops_.sum(parameters_.weights);
  return {.value = parameters_.bias + other_inputs(parameters_.slopes, features) + bent(v)};
}

Estimate ImprovedPrandtlIshlinskii::invert(double target, Features features) noexcept {
  const double wanted =
      straightened(target - parameters_.bias - other_inputs(parameters_.slopes, features));
  if (parameters_.rate_feature == 0) return detail::no_inverse(features);
  const double scale = limit_scale(features);
  for (std::size_t i = 0; i < limits_.size(); ++i) limits_[i] = scale * parameters_.thresholds[i];
  const auto curve = [&](double x) {
    return (parameters_.slopes[0] + play_sum_) * x -
           stops_.sum_after(increment_.to(x), parameters_.weights, scale);
  };
  return broken_line_inverse(wanted, stops_, increment_, limits_, curve, features);
}

}  // namespace torsio
