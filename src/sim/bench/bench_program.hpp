#pragma once

#include <functional>

#include "sim/plant/plant.hpp"
#include "sim/sensors/sensor_set.hpp"

namespace torsio {

/// What the bench does to the plant until the next tick.
struct BenchAction {
  PlantCommand command;
  Load load;
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
  std::function<BenchAction(const Measurement&)> next;
};

}  // namespace torsio
