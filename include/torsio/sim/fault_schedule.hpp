#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Kinds of faults. The first seven are faults of sensors, the last two of the spring; drift is a
/// fault of both sensors and parts.
enum class FaultKind : std::uint8_t {
  freeze,     ///< always the same value, marked as new
  jump,       ///< `amount` is added
  drift,      ///< sensor: `amount` per second since the start is added; part: its factor
              ///< changes from 1 to `amount` in `over_s` and remains there
  sign_flip,  ///< the sign is wrong
  quantised,  ///< resolution of `amount`
  dropout,    ///< no new samples: the last value is held and not marked as new
  nan,        ///< not a number
  broken,     ///< the spring's torque falls to the share `amount`, 0 for a broken spring
  bottom,     ///< the spring's deflection meets a stop at `amount` radians, to either side
};

/// One fault and its time.
struct ScheduledFault {
  /// A sensor, by the name of its logged channel ("gear_angle_rad"), or a part: "spring" ("gear"
  /// for actuators with a gear after their spring), "friction", "torque-constant".
  std::string what;
  FaultKind kind = FaultKind::freeze;
  double start_s = 0.0;
  std::optional<double> duration_s = {};  ///< none: to the end; afterwards there is no fault
  double amount = 0.0;                 ///< depends on the kind; for a sensor in its channel's unit
  double over_s = 0.0;                 ///< drift of a part
  double stop_stiffness_Nm_rad = 0.0;  ///< bottom
  std::string place = {};              ///< where it was read, for messages
};

/// Plain data: what goes wrong in a run. Several at once combine: those of one sensor act in this
/// order, each on what the one before left; factors multiply, up to 10; of two stops the nearer one
/// counts.
struct FaultSchedule {
  std::vector<ScheduledFault> faults;
};

/// What can go wrong with an actuator: its logged channels, and its parts.
[[nodiscard]] std::vector<std::string> fault_sensors(const DataSheet& sheet);
[[nodiscard]] std::vector<std::string> fault_parts(const DataSheet& sheet);

/// Reads a schedule for this actuator; docs/faults.md has the format.
///
///     faults:
///       - {sensor: gear_angle_rad, fault: freeze, at: 5s, for: 2s}
///       - {part: friction, fault: drift, to: 1.3, over: 60s, at: 0s}
///
/// @throws UsageError naming file, line, what was expected (with the known names) and found;
/// Cancelled.
[[nodiscard]] FaultSchedule read_fault_schedule(const std::string& path, const DataSheet& sheet,
                                                const Progress& progress = {});
[[nodiscard]] FaultSchedule parse_fault_schedule(std::string_view text, const std::string& name,
                                                 const DataSheet& sheet);

}  // namespace torsio
