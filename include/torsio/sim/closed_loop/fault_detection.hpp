#pragma once

#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/fault.hpp"
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

}  // namespace torsio
