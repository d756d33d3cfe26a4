#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// Whether the estimator of a loop reported an injected fault, and the error until then.
struct FaultDetection {
  std::string what;  ///< "gear_angle_rad jump"
  double start_s = 0.0;
  std::optional<double> end_s = {};  ///< none: to the end of the run
  /// The first tick within the fault at which the inverse or the loop reports a fault that it does
  /// not report at that tick in the run without injected faults.
  std::optional<double> detected_s = {};
  Fault detected_as = Fault::none;
  /// Largest |wanted - torque of the joint| [Nm] within the fault, of the ticks at which no fault
  /// was reported; none if every tick had one.
  std::optional<double> largest_unreported_error_Nm = {};
  /// The same of the run without injected faults.
  std::optional<double> error_without_fault_Nm = {};
};

/// One entry for each fault of the schedule that starts within the run. Where several act at once,
/// a reported fault counts for each of them.
/// @param run, sound recordings of `track` with and without the schedule, otherwise alike
[[nodiscard]] std::vector<FaultDetection> fault_detections(const FaultSchedule& schedule,
                                                           const DataSheet& sheet,
                                                           const Recording& run,
                                                           const Recording& sound);

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
