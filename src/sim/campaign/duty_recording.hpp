#pragma once

#include <cstdint>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

class MonitoredTorque;

/// The random work of a simulated joint (`duty_recording`). All values are assumed.
struct DutySettings {
  double gravity_share =
      0.7;                   ///< largest torque of the lever, as a share of `DutyLimits::torque_Nm`
  double speed_share = 0.5;  ///< largest speed over the rated one
  double impacts_per_min = 4.0;
  double coldest_K = 273.15 + 10.0;  ///< lubricant: random at the start, then another per hour
  double hottest_K = 273.15 + 40.0;
  double min_friction = 0.9;  ///< factor by which friction ages, slowly, at random
  double max_friction = 1.2;
};

/// What the work of a joint does not exceed.
struct DutyLimits {
  /// Torque between the stages and the joint: the rated one, or 0.6 of the static torque of a clutch.
  double torque_Nm = 0.0;
  double range_rad = 0.0;           ///< angle of the joint, to either side
  double bandwidth_rad_s = 0.0;     ///< bandwidth of the position loop
  double load_inertia_kg_m2 = 0.0;  ///< largest inertia of the load, which the loop still carries
};
[[nodiscard]] DutyLimits duty_limits(const DataSheet& sheet);

/// One recording of such work.
struct DutyRun {
  std::uint64_t seed = 1;
  double duration_s = 600.0;
  DutySettings settings = {};
  bool is_electrical = false;  ///< with windings, inverter and current control
  bool with_truth = false;     ///< add the `truth_*` channels
  FaultSchedule faults = {};   ///< on the sensors, for the position loop as well, and on the parts
  /// Watches the joint, armed as soon as it is ready: its stop removes the power and closes the brake. Null: none.
  const MonitoredTorque* guard = nullptr;
};

/// A joint at work: random moves, rests, loads, temperature, wear of its friction and impacts, all at
/// random from one seed. The channels are those of `simulate`, at 1 kHz for every actuator, and
/// `torque_Nm` of a load cell that samples at 1 kHz without latency. Equal arguments give equal
/// recordings.
/// @throws UsageError for a duration that is not 1 ms to 10 h, or faults that this actuator cannot have in
/// it; Error if the guard has an input that this actuator's sensors do not measure; Cancelled.
[[nodiscard]] Recording duty_recording(const DataSheet& sheet, const DutyRun& run,
                                       const Progress& progress = {});

}  // namespace torsio
