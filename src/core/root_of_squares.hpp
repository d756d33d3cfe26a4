#pragma once

#include <cmath>

namespace torsio::detail {

/// sqrt(a^2 + b^2), infinite where a square is. `std::hypot`, which is finite there, takes a tenth of an
/// estimator's step.
[[nodiscard]] inline double root_of_squares(double a, double b) noexcept {
  return std::sqrt(a * a + b * b);
}

}  // namespace torsio::detail
