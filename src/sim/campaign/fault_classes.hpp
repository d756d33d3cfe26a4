#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// How the disagreement that a fault causes is found, from which its latency counts.
enum class FaultOnset {
  injection,  ///< none: from the injection on
  sensors,    ///< change of the estimates against those of a monitor with the sound signals
  parts,      ///< difference of the estimates, or the twist of the second stage beyond its range
  start,      ///< from power-up: as `sensors`, while the monitor watches at all
};

/// One fault that was drawn. Its times count from the injection.
struct DrawnFault {
  std::vector<ScheduledFault> faults = {};
  std::optional<std::size_t> failed_model = {};  ///< index of the source
  std::size_t late_ticks = 0;  ///< the loop makes one step in place of so many; 0: on time
};

/// A class of faults of one actuator.
struct FaultClass {
  std::string name;  ///< "freeze gear_angle_rad"
  int row = 0;       ///< number in the table of docs/simulation/faults.md
  FaultOnset onset = FaultOnset::sensors;
  double limit_s = 0.02;  ///< largest latency
  bool must_stop = true;  ///< false: the monitor must not stop
  bool has_size = false;  ///< there are smaller ones
  /// The fault does not reach the position loop of the bench: at power-up the drive has an angle of
  /// its own, and a single spike is passed over by a loop that reads the guarded signals.
  bool is_loop_sound = false;
  /// @param size of the disagreement, nominally, over the largest torque
  std::function<DrawnFault(Random& random, double size)> draw = {};
};

/// The classes that this actuator can have, with the sensors that its monitor uses.
[[nodiscard]] std::vector<FaultClass> fault_classes(const DataSheet& sheet,
                                                    const MonitoredTorque& monitored);

/// The twist [rad] of the second stage at 1.5 times the largest torque of the work.
[[nodiscard]] double largest_twist(const DataSheet& sheet);

}  // namespace torsio
