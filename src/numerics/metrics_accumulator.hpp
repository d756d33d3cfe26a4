#pragma once

#include <cstddef>
#include <span>

#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// Gathers metrics sample by sample, in one pass and without cancellation.
class MetricsAccumulator {
 public:
  /// A target that was not measured (NaN) is passed over.
  void add(double value, double target) noexcept;
  /// @param use 0 where a sample is not to be scored; empty: all are.
  /// @throws Error if the lengths differ.
  void add(std::span<const double> values, std::span<const double> targets,
           std::span<const std::uint8_t> use = {});

  [[nodiscard]] Metrics metrics() const noexcept;

 private:
  std::size_t samples_ = 0;
  double square_sum_ = 0.0;
  double mean_abs_ = 0.0;
  double abs_spread_ = 0.0;  ///< sum of squared deviations of |e| from its mean
  double max_abs_ = 0.0;
  double mean_target_ = 0.0;
  double target_spread_ = 0.0;  ///< the same of the target
};

}  // namespace torsio
