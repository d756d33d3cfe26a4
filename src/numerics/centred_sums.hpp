#pragma once

#include <cstddef>
#include <span>

namespace torsio {

/// Means of two series, and the sums of the squares and products of the deviations from them.
struct CentredSums {
  double x = 0.0;  ///< mean
  double y = 0.0;  ///< mean
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;

  /// @param ys as many as `xs`
  CentredSums(std::span<const double> xs, std::span<const double> ys) {
    const auto count = static_cast<double>(xs.size());
    for (std::size_t n = 0; n < xs.size(); ++n) {
      x += xs[n] / count;
      y += ys[n] / count;
    }
    for (std::size_t n = 0; n < xs.size(); ++n) {
      const double dx = xs[n] - x;
      const double dy = ys[n] - y;
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
};

}  // namespace torsio
