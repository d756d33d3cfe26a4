#pragma once

#include <cmath>
#include <cstddef>

#include "identify/drive/drive_log.hpp"

namespace torsio {

/// What of a log the checks and the advice look at.
struct DriveCourse {
  double largest_speed_rad_s = 0.0;
  std::size_t driven = 0;     ///< moving samples with power
  std::size_t saturated = 0;  ///< driven samples with the output at its limit
  bool has_passive_motion = false;
  double lowest_load_Nm = HUGE_VAL;  ///< lowest torque of the load
  double highest_load_Nm = -HUGE_VAL;
  double command_range = 0.0;
  double angle_range_rad = 0.0;
  double angle_per_goal = 0.0;   ///< slope of the angle over the goal with power; 0: no such law
  double angle_with_goal = 0.0;  ///< their correlation
};

[[nodiscard]] DriveCourse drive_course(const DriveLog& log);

}  // namespace torsio
