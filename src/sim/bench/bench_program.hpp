#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "sim/plant/plant.hpp"
#include "sim/sensors/sensor_set.hpp"

namespace torsio {

/// The channels of the log for what a bench is asked to do, one of which every experiment has.
inline constexpr const char* kGoalAngle =
    "goal_angle_rad";  ///< the joint, or the input of a clutch
inline constexpr const char* kGoalTorque = "goal_torque_Nm";

/// A controller of a bench has at most so many commands that are logged.
inline constexpr std::size_t kMaxCommands = 3;
using BenchCommands = std::array<double, kMaxCommands>;

/// What the bench does to the plant until the next tick.
struct BenchAction {
  PlantCommand command;
  Load load;
  BenchCommands commanded = {};  ///< values of `BenchProgram::command_channels`, in their order
};

/// The torque at the load cell.
enum class LoadCell {
  joint,     ///< the torque between joint and load
  external,  ///< what the joint does to the hand that pushes it, so that it rises with the twist
  wall,      ///< the obstacle that the load runs against
};

/// An experiment that is ready to run: its load at the start, and what follows each measurement.
struct BenchProgram {
  Load start;
  double start_angle_rad = 0.0;  ///< start angle of the joint
  LoadCell load_cell = LoadCell::joint;
  double duration_s = 0.0;
  /// What the controller is asked for, and what it asks for, as channels of the log; at most `kMaxCommands`.
  std::vector<std::string> command_channels = {};
  /// Numbers of the whole run that a reader of the log needs: names with unit, values.
  std::vector<std::pair<std::string, double>> log_conditions = {};
  std::function<BenchAction(const Measurement&)> next;
};

}  // namespace torsio
