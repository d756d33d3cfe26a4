#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "report/plots.hpp"

namespace torsio {

struct PlotRange {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  void include(double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  [[nodiscard]] bool is_empty() const { return !(lowest <= highest); }
  [[nodiscard]] double share(double value) const {
    return highest > lowest ? (value - lowest) / (highest - lowest) : 0.5;
  }
};

/// The largest of 1, 2, 5 times a power of ten that divides the width into at least four.
inline double tick_step(double width) {
  const double power = std::pow(10.0, std::floor(std::log10(width / 4.0)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= width / 4.0) return factor * power;
  return power;
}

template <class Use>
void for_each_point(const Curve& curve, const Use& use) {
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])) use(curve.x[i], curve.y[i]);
}

struct PlotRanges {
  PlotRange x;
  PlotRange y;
};
inline PlotRanges ranges_of(const std::vector<Curve>& curves) {
  PlotRanges ranges;
  for (const Curve& curve : curves) {
    for_each_point(curve, [&](double x, double y) {
      ranges.x.include(x);
      ranges.y.include(y);
    });
  }
  return ranges;
}

}  // namespace torsio
