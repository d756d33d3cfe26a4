#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// How the command becomes the motor's torque.
enum class CommandKind : std::uint8_t {
  goal_to_duty,    ///< duty = gain (goal - angle), at most `limit`
  goal_to_torque,  ///< torque = gain (goal - angle) - speed_gain angle', at most `limit`
  duty,
  current,  ///< [A]
  torque,   ///< [Nm]
};

/// Whether the command is the voltage of a winding, whose resistance and back-EMF are in the equations.
[[nodiscard]] constexpr bool has_winding(CommandKind kind) {
  return kind == CommandKind::goal_to_duty || kind == CommandKind::duty;
}

/// Whether a law makes the command from an angle that is wanted.
[[nodiscard]] constexpr bool follows_goal(CommandKind kind) {
  return kind == CommandKind::goal_to_duty || kind == CommandKind::goal_to_torque;
}

/// One recording as the free runs need it; the angle is that of the motor after the gear, or of the joint.
struct DriveLog {
  std::string name;
  std::string group;  ///< recordings of one group are left out together
  double sample_period_s = 0.0;
  CommandKind kind = CommandKind::goal_to_duty;
  std::vector<double> command;
  /// The command just before the next sample, to which it changes linearly; empty: the next value.
  std::vector<double> command_end;
  std::vector<double> angle_rad;
  std::vector<double> enabled;  ///< 1 or 0, a row per sample; empty: always 1
  double gain = 0.0;
  double speed_gain = 0.0;
  double speed_filter_rad_s = 0.0;  ///< corner of the law's speed; 0: none
  double limit = 0.0;
  double supply_V = 0.0;
  bool brakes_when_off = false;  ///< the winding is shorted while the power is off
  KnownLoad load;

  [[nodiscard]] std::size_t size() const noexcept { return angle_rad.size(); }
};

/// Whether the power is on at a sample, or at all.
[[nodiscard]] inline bool is_powered(const DriveLog& log, std::size_t sample) {
  return log.enabled.empty() || log.enabled[sample] != 0.0;
}
[[nodiscard]] inline bool is_always_powered(const DriveLog& log) {
  return std::ranges::find(log.enabled, 0.0) == log.enabled.end();
}

}  // namespace torsio
