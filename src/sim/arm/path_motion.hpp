#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "numerics/centred_parabola.hpp"
#include "sim/sensors/sensor_set.hpp"

namespace torsio {

/// The speed of a joint that follows angles tick by tick: a central difference.
inline double path_speed(std::span<const double> angle_rad, std::size_t tick) {
  const std::size_t before = tick == 0 ? 0 : tick - 1;
  const std::size_t after = std::min(tick + 1, angle_rad.size() - 1);
  if (after == before) return 0.0;
  return (angle_rad[after] - angle_rad[before]) * kBenchRate_Hz /
         static_cast<double>(after - before);
}

/// Its acceleration, that of a parabola through 21 ms: differences of rounded angles have little but rounding. 0 within
/// 10 ms of both ends.
inline double path_acceleration(std::span<const double> angle_rad, std::size_t tick) {
  static const CentredParabola kParabola(10, kBenchRate_Hz);
  if (tick < kParabola.half || tick + kParabola.half >= angle_rad.size()) return 0.0;
  return kParabola.at(angle_rad, tick)[1];
}

}  // namespace torsio
