#pragma once

#include <algorithm>
#include <limits>

namespace torsio {

/// The range of the samples that it has taken; empty at first.
struct SampleRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] bool holds(double value) const { return value >= low && value <= high; }
  [[nodiscard]] double width() const { return high > low ? high - low : 0.0; }
};

}  // namespace torsio
