#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// Fewer reversals show neither hysteresis nor how well a model repeats.
inline constexpr std::size_t kFewReversals = 3;

/// Share of the range by which a value has to turn back for a reversal. With 2 % noise cuts slow strokes into short ones.
inline constexpr double kReversalShare = 0.05;

/// The number of reversals by more than 5 % of the range, counted up to `most`. Values that are not finite are passed
/// over.
[[nodiscard]] inline std::size_t count_reversals(
    std::span<const double> values, std::size_t most = std::numeric_limits<std::size_t>::max()) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  const double dead_band = kReversalShare * (highest - lowest);
  std::size_t count = 0;
  double extreme = kNotMeasured;
  int direction = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (std::isnan(extreme)) extreme = value;
    const double forward = (value - extreme) * (direction == 0 ? 1.0 : direction);
    if (direction == 0 ? std::abs(forward) > dead_band : forward < -dead_band) {
      if (direction != 0 && ++count >= most) return count;
      direction = value > extreme ? 1 : -1;
      extreme = value;
    } else if (direction != 0 && forward > 0.0) {
      extreme = value;
    }
  }
  return count;
}

}  // namespace torsio
