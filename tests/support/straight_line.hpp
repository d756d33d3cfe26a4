#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/units.hpp"
#include "torsio/data/recording.hpp"

namespace torsio::test {

struct Line {
  double slope = 0.0;
  double intercept = 0.0;
  double rmse = 0.0;
};

/// By least squares.
inline Line straight_line(std::span<const double> x, std::span<const double> y) {
  const auto n = static_cast<double>(x.size());
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  const double slope = xy / xx;
  return {slope, mean_y - slope * mean_x, std::sqrt((yy - slope * xy) / n)};
}

/// Gear minus joint, of a series-elastic actuator.
inline std::vector<double> deflection_deg(const Recording& recording) {
  const auto& gear = recording.channel("gear_angle_rad").values;
  const auto& joint = recording.channel("joint_angle_rad").values;
  std::vector<double> deflection(gear.size());
  for (std::size_t i = 0; i < gear.size(); ++i) deflection[i] = deg_from_rad(gear[i] - joint[i]);
  return deflection;
}

/// Linear fit of the torque [Nm] over the deflection [deg], without the first two seconds.
inline Line spring_line(const Recording& recording) {
  constexpr std::size_t kFirst = 2000;
  const std::vector<double> x = deflection_deg(recording);
  const std::vector<double>& y = recording.channel("torque_Nm").values;
  return straight_line(std::span(x).subspan(kFirst), std::span(y).subspan(kFirst));
}

}  // namespace torsio::test
