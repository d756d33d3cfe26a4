#pragma once

#include <cmath>

namespace torsio::detail {

/// tanh(x) within 2 units in the last place, in about half the time of the C library's. It makes the same
/// bits for every version of that library that has the same exp.
/// Source: Moshier, Methods and Programs for Mathematical Functions (Cephes), tanh.
[[nodiscard]] inline double hyperbolic_tangent(double x) noexcept {
  constexpr double kRational = 0.625;  // below: x + x^3 P(x^2) / Q(x^2)
  constexpr double kOne = 22.0;        // from here on +-1 but for rounding
  const double size = std::abs(x);
  if (size < kRational) {
    const double z = x * x;
    const double p =
        (-9.64399179425052238628e-1 * z - 9.92877231001918586564e1) * z - 1.61468768441708447952e3;
    const double q = ((z + 1.12811678491632931402e2) * z + 2.23548839060100448583e3) * z +
                     4.84406305325125486048e3;
    return std::copysign(size + size * (z * p / q), x);  // keeps the sign of a zero
  }
  if (size > kOne) return std::copysign(1.0, x);
  return std::copysign(1.0 - 2.0 / (std::exp(2.0 * size) + 1.0), x);  // NaN stays NaN
}

}  // namespace torsio::detail
