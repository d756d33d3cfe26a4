#pragma once

#include <string>
#include <utility>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// Stiffness, loop width and friction of a spring model in a slow cycle: the deflection follows a
/// triangle through its range in training, while the joint is at rest.
///
///     mean m(d) = (up(d) + down(d)) / 2,   loop width w(d) = up(d) - down(d),
///     stiffness = dm/dd,   friction = w / 2
///
/// up and down are the torques at increasing and decreasing deflection, in the second cycle.
struct SlowCycle {
  struct Point {
    double deflection_rad = 0.0;
    double torque_Nm = 0.0;  ///< m
    double stiffness_Nm_rad = 0.0;
    double loop_width_Nm = 0.0;
    double friction_Nm = 0.0;
  };

  std::string reason;     ///< why it cannot be determined; then nothing below is set
  double period_s = 0.0;  ///< period of the triangle
  double lowest_rad = 0.0;
  double highest_rad = 0.0;
  std::vector<std::pair<std::string, double>> held;  ///< other raw inputs, and their constant value
  double stiffness_Nm_rad = 0.0;                     ///< slope of the least-squares line through m
  double width_at_zero_Nm = kNotMeasured;            ///< NaN where the range does not contain 0
  double largest_width_Nm = 0.0;
  double largest_width_at_rad = 0.0;
  double friction_Nm = 0.0;   ///< half of the mean loop width: energy per cycle / (2 range)
  std::vector<Point> points;  ///< at 10, 20, ... 90 % of the range
};

/// Runs the model through three cycles of the deflection. "Cannot be determined" (`reason`): the
/// target is not a torque, no input is the deflection, its range is not known, an input depends on a
/// channel that a cycle does not determine, or the model reports a fault in the cycle.
/// @throws Cancelled.
[[nodiscard]] SlowCycle slow_cycle(const ModelFile& model, const Progress& progress = {});

}  // namespace torsio
