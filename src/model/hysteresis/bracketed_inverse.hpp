#pragma once

#include <cmath>

#include "torsio/model/common/model.hpp"

namespace torsio {

/// An x within centre +- half_range at which y(x) = target, by halving, at most 100 times. Where the
/// ends do not enclose the target, the nearer one with `Fault::outside_training_range`.
template <class Curve>
Estimate bracketed_inverse(double target, double centre, double half_range,
                           const Curve& curve) noexcept {
  double low = centre - half_range;
  double high = centre + half_range;
  const double error_low = curve(low) - target;
  const double error_high = curve(high) - target;
  const bool is_enclosed =
      (error_low <= 0.0 && error_high >= 0.0) || (error_low >= 0.0 && error_high <= 0.0);
  if (!is_enclosed || !std::isfinite(error_low) || !std::isfinite(error_high))
    return {.value = std::abs(error_low) < std::abs(error_high) ? low : high,
            .fault = Fault::outside_training_range};
  if (error_low == 0.0) return {.value = low};
  const bool rises = error_low < 0.0;
  constexpr int kHalvings = 100;
  for (int i = 0; i < kHalvings; ++i) {
    const double x = low + 0.5 * (high - low);
    if (!(x > low && x < high)) break;
    ((curve(x) < target) == rises ? low : high) = x;
  }
  return {.value = low + 0.5 * (high - low)};
}

}  // namespace torsio
