#pragma once

#include <span>

namespace torsio {

/// Variance of an estimate from those without one of n parts each, delete-one jackknife:
///
///     (n - 1) / n sum (e_k - mean)^2
[[nodiscard]] inline double jackknife_variance(std::span<const double> without_one) {
  const auto count = static_cast<double>(without_one.size());
  double mean = 0.0;
  for (const double estimate : without_one) mean += estimate / count;
  double square = 0.0;
  for (const double estimate : without_one) square += (estimate - mean) * (estimate - mean);
  return (count - 1.0) / count * square;
}

}  // namespace torsio
