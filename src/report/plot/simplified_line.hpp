#pragma once

#include <vector>

namespace torsio {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

/// The line that stays within `deviation` of all points (Douglas and Peucker, 1973).
/// @param points at least one
[[nodiscard]] std::vector<PlotPoint> simplified(const std::vector<PlotPoint>& points,
                                                double deviation);

}  // namespace torsio
