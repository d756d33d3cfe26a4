#pragma once

#include <cmath>
#include <utility>

namespace torsio {

/// Where a function with one minimum between `low` and `high` is lowest, by golden section: one value of the function for
/// each step, until the interval is at most `tolerance` wide (Kiefer 1953).
template <class Function>
[[nodiscard]] double golden_section(const Function& value_at, double low, double high,
                                    double tolerance) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double left = high - ratio * (high - low);
  double right = low + ratio * (high - low);
  double value_left = value_at(left);
  double value_right = value_at(right);
  while (high - low > tolerance) {
    if (value_left < value_right) {
      high = std::exchange(right, left);
      value_right = value_left;
      left = high - ratio * (high - low);
      value_left = value_at(left);
    } else {
      low = std::exchange(left, right);
      value_left = value_right;
      right = low + ratio * (high - low);
      value_right = value_at(right);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace torsio
