#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/data/recording.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

enum class DriveLaw : std::uint8_t {
  position,  ///< duty = gain error_gain (goal - angle), at most max_duty
  pd,        ///< torque = kp (goal - angle) - kd angle', at most torque_limit
  voltage,   ///< the recording has the voltage or the duty
  current,   ///< the recording has the motor's current
  torque,    ///< the recording has the torque that the drive was commanded
};

[[nodiscard]] std::string_view name(DriveLaw law);

/// How the drive of the recordings turns its command into torque: a drive file (docs/use/identify.md). All quantities are
/// those after the gear, except `motor_angle_rad`, which is divided by `gear_ratio`.
struct DriveSheet {
  std::string file;  ///< for messages
  DriveLaw law = DriveLaw::position;
  std::string command;  ///< channel; empty: by the law (`command_channels`)
  std::string
      angle;  ///< channel; empty: motor_angle_rad, gear_angle_rad or joint_angle_rad, the first that exists
  bool is_command_held =
      false;  ///< each sample of the command until the next one; else linear between them
  std::optional<double> gear_ratio;  ///< empty: the condition gear_ratio_1, else 1
  LoadFact gain = {.value = 1.0};    ///< position: a number that multiplies `error_gain_1_rad`
  std::optional<double>
      error_gain_1_rad;  ///< duty for a radian at gain 1; empty: measured from the duty
  double max_duty_1 = 1.0;
  LoadFact supply_V;
  bool brakes_when_off = false;  ///< the winding is shorted, not open, while enabled_1 is 0
  LoadFact kp_Nm_rad;
  LoadFact kd_Nms_rad;
  LoadFact torque_limit_Nm = {.value = 1e9};
  double speed_filter_Hz = 0.0;  ///< low-pass of the law's speed; 0: none
};

/// @throws Error naming file, line, key, the known keys and the nearest one, or a value outside its range.
[[nodiscard]] DriveSheet read_drive_sheet(const std::string& path);
[[nodiscard]] DriveSheet parse_drive_sheet(std::string_view text, const std::string& name);

/// The sheet of recordings whose channels and conditions state the law: those of a servo with goal, duty and gain, of
/// `torsio simulate .. air-chirp`, or with the motor's current or, where there is none, the commanded torque.
/// @throws Error that states what is missing, or that a goal without a law and a current or torque are two commands.
[[nodiscard]] DriveSheet assumed_drive_sheet(const Recording& recording);

/// The channels that a law's command may be in, the first that a recording has.
[[nodiscard]] std::vector<std::string> command_channels(DriveLaw law);

}  // namespace torsio
