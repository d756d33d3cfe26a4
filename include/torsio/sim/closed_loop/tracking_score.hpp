#pragma once

#include <cstddef>
#include <optional>

namespace torsio {

/// A motion that a loop keeps up by itself.
struct LimitCycle {
  double frequency_Hz = 0.0;
  double amplitude = 0.0;  ///< in the unit of the error
};

/// How well a torque was followed: e = wanted - torque, of the joint's torque without the noise of
/// any sensor, in Nm. The first two seconds are not scored, but for `overshoot`. Source:
/// specification 3.10.
struct TrackingScore {
  double mad = 0.0;             ///< mean |e|
  double std_abs = 0.0;         ///< standard deviation of |e|
  double rmse = 0.0;            ///< sqrt(mean e^2)
  double max_abs = 0.0;         ///< largest |e|
  double error_ratio = 0.0;     ///< MAD over the reference's amplitude
  double load_cell_mad = 0.0;   ///< as `mad`, with the torque of the load cell: noise and delay
  double load_cell_rmse = 0.0;  ///< as `rmse`, with the same torque
  /// Largest of all steps from the start on, the first one from 0: how far the torque goes beyond,
  /// as a share of the step. Steps only.
  std::optional<double> overshoot = {};
  std::optional<LimitCycle> limit_cycle = {};
  std::size_t limit_events = 0;    ///< number of times that a limit became active
  double limited_s = 0.0;          ///< total time of active limits
  std::size_t inverse_faults = 0;  ///< steps with a fault of the inverse
  std::size_t loop_faults = 0;     ///< ticks without a usable reference or measurement
};

}  // namespace torsio
