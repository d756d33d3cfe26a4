#include "check/rate_factor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "check/signal_pair.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kRateWindow_s = 0.05;
constexpr double kFollowsAngle = 0.9;  ///< correlation with the derivative

/// The means over the same windows as `movement`, by the trapezoidal rule.
std::vector<double> means_over(const std::vector<double>& values, std::size_t half_window) {
  std::vector<double> means(values.size(), kNotMeasured);
  for (std::size_t i = half_window; i + half_window < values.size(); ++i) {
    double sum = 0.5 * (values[i - half_window] + values[i + half_window]);
    for (std::size_t k = i - half_window + 1; k < i + half_window; ++k) sum += values[k];
    means[i] = sum / static_cast<double>(2 * half_window);
  }
  return means;
}

}  // namespace

std::optional<RateFactor> factor_of_rate(const std::vector<double>& speed,
                                         const std::vector<double>& angle, double sample_rate_Hz) {
  const auto half_window =
      static_cast<std::size_t>(std::max(1.0, std::round(kRateWindow_s * sample_rate_Hz)));
  Pair pair{movement(angle, half_window), means_over(speed, half_window)};
  for (double& moved : pair.input) moved *= sample_rate_Hz / static_cast<double>(2 * half_window);
  RateFactor found{.together = correlation(pair.input, pair.target)};
  if (std::abs(found.together) < kFollowsAngle) return {};
  found.factor = line_through(pair).slope;
  return found;
}

}  // namespace torsio
