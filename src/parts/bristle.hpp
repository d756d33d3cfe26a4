#pragma once

#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// LuGre's bristle after travelling at constant speed and level: the exact solution of
///
///     F' = σ₀ v (1 − F sgn(v) / g)
///
/// @param force F at the start  @param level g > 0, at which F settles
/// @param stiffness σ₀ > 0  @param dt_s time at that speed
[[nodiscard]] inline double relaxed_bristle(double force, double speed, double level,
                                            double stiffness,
                                            double dt_s) noexcept TORSIO_REALTIME {
  if (speed == 0.0) return force;
  const double target = std::copysign(level, speed);
  const double distance = force - target;
  if (std::abs(distance) < 1e-15 * level) return target;
  const double travel = std::abs(speed) * dt_s;
  return target + distance * std::exp(-stiffness * travel / level);
}

}  // namespace torsio
