#pragma once

#include <optional>

#include "check/signal_pair.hpp"

namespace torsio {

/// A zero that drifts and returns, as with the temperature of a room: what a curve with hysteresis over the input leaves
/// is a slow function of time.
struct SlowCourse {
  double range = 0.0;        ///< that function passes through it, in the target's unit
  double unexplained = 1.0;  ///< share of the target's variance that curve and relaxations leave
  double left = 1.0;         ///< share of that which the slow function leaves
};
/// Cosines of one to eight half-waves over the recording, each with four reversals of the input. Empty unless they explain
/// three quarters of at least 1 % of the variance, and pass through 8 % of the target's range.
[[nodiscard]] std::optional<SlowCourse> find_slow_course(const Pair& pair, double sample_rate_Hz);

}  // namespace torsio
