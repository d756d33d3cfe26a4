#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "torsio/core/not_measured.hpp"

namespace torsio {

/// How far a model is off, e = value - target; all but `fit_percent` in the target's unit. NaN
/// where there is nothing to say it from. There is no "MAE": the papers use it for two different
/// things. Source: specification 3.10.
struct Metrics {
  std::size_t samples = 0;            ///< that were scored
  double rmse = kNotMeasured;         ///< sqrt(mean e^2)
  double mad = kNotMeasured;          ///< mean |e|
  double std_abs = kNotMeasured;      ///< standard deviation of |e| about `mad` (divided by n)
  double max_abs = kNotMeasured;      ///< largest |e|
  double fit_percent = kNotMeasured;  ///< 100 (1 - |e| / |y - mean y|) in the 2-norm (BF)
};

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
