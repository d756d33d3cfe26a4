#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace torsio {

/// Slope and curvature of a least-squares parabola through 2 `half` + 1 samples, `half` at least 1.
struct CentredParabola {
  CentredParabola(std::size_t half_samples, double sample_rate_Hz)
      : half(half_samples), rate_Hz(sample_rate_Hz) {
    for (std::size_t k = 1; k <= half; ++k) {
      const auto square = static_cast<double>(k * k);
      squares += 2.0 * square;
      fourths += 2.0 * square * square;
    }
  }
  /// @returns slope [1/s] and curvature [1/s²], the first and second derivative, at sample n
  [[nodiscard]] std::array<double, 2> at(std::span<const double> values, std::size_t n) const {
    double slope = 0.0;
    double sum = values[n];
    double second = 0.0;
    for (std::size_t k = 1; k <= half; ++k) {
      const auto way = static_cast<double>(k);
      const double both = values[n + k] + values[n - k];
      slope += way * (values[n + k] - values[n - k]);
      sum += both;
      second += way * way * both;
    }
    const auto count = static_cast<double>(2 * half + 1);
    const double curvature =
        (second - squares / count * sum) / (fourths - squares * squares / count);
    return {rate_Hz * slope / squares, 2.0 * rate_Hz * rate_Hz * curvature};
  }

  std::size_t half;
  double rate_Hz;
  double squares = 0.0;
  double fourths = 0.0;
};

}  // namespace torsio
