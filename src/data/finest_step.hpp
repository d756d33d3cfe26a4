#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// The smallest step between two samples: the resolution of a quantised sensor, nearly zero for any
/// other; 0 if the values never change.
[[nodiscard]] inline double finest_step(const std::vector<double>& values) {
  double finest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (step > 0.0) finest = std::min(finest, step);  // false for NaN
  }
  return std::isfinite(finest) ? finest : 0.0;
}

/// As the sensor delivered it: interpolation between the codes of an encoder has finer steps.
[[nodiscard]] inline double finest_step(const Channel& channel) {
  return channel.step_before_resampling > 0.0 ? channel.step_before_resampling
                                              : finest_step(channel.values);
}

}  // namespace torsio
