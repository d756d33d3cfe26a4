#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Kinds of faults: of sensors, and the last two of the spring; drift is a fault of both sensors and
/// parts.
enum class FaultKind : std::uint8_t {
  freeze,     ///< always the same value, marked as new
  jump,       ///< `amount` is added
  drift,      ///< sensor: `amount` per second since the start is added; part: its factor
              ///< changes from 1 to `amount` in `over_s` and remains there
  sign_flip,  ///< the sign is wrong
  quantised,  ///< resolution of `amount`
  dropout,    ///< no new samples: the last value is held and not marked as new
  nan,        ///< not a number
  gain,       ///< times `amount`
  spike,      ///< `amount` is added to one sample, or to one every `every_s`
  wrap,       ///< an angle jumps by `amount` turns of its encoder
  zero,       ///< delivers 0, as an encoder that starts up
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
  double every_s = 0.0;                ///< period of repeated spikes; 0: one spike
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

/// Reads a schedule for this actuator; docs/simulation/faults.md has the format.
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

/// Reads one fault in the short form WHAT=AMOUNT@TIME or WHAT=KIND:AMOUNT@TIME, TIME with an end as
/// "2s..5s". WHAT is a sensor, by its channel without the unit ("gear_angle", "current"), or a part
/// ("kt", "friction", "spring"). Without a kind a sensor's amount is a jump, a part's a factor.
///
///     kt=-20%@3s   gear_angle=1deg@2s   current=gain:-20%@2s   motor_angle=freeze@2s..4s
///
/// @throws UsageError that lists what is possible
[[nodiscard]] ScheduledFault parse_injection(std::string_view text, const DataSheet& sheet);

}  // namespace torsio
