#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// Mean and standard deviation of values one by one (Welford).
class RunningMean {
 public:
  void add(double value) noexcept {
    const double distance = value - mean_;
    mean_ += distance / static_cast<double>(++count_);
    squares_ += distance * (value - mean_);
  }
  void add(const std::optional<double>& value) noexcept {
    if (value) add(*value);
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  /// NaN of no value.
  [[nodiscard]] double mean() const noexcept { return count_ == 0 ? kNotMeasured : mean_; }
  /// Standard deviation of one value; NaN for fewer than two.
  [[nodiscard]] double std_dev() const noexcept {
    return count_ < 2 ? kNotMeasured : std::sqrt(squares_ / static_cast<double>(count_ - 1));
  }

 private:
  std::size_t count_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;  ///< deviations from the mean
};

}  // namespace torsio
