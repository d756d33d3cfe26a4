#pragma once

#include <cstddef>
#include <span>

namespace torsio {

/// Properties of a log's clock, from its time stamps.
struct ClockReport {
  double sample_rate_Hz = 0.0;  ///< from the first and the last stamp; 0 if it cannot be determined
  double stamp_step_s = 0.0;    ///< median of the positive differences between neighbours
  double largest_stray_s =
      0.0;  ///< largest distance of a stamp from equal spacing between first and last
  std::size_t max_stray = 0;  ///< sample where that happens
  std::size_t worst_interval =
      0;  ///< the interval that ends at this sample differs most from the others
  std::size_t duplicated = 0;            ///< stamps equal to the one before
  std::size_t backward = 0;              ///< stamps before the one before
  std::size_t first_not_increasing = 0;  ///< 0: none
  std::size_t not_finite = 0;

  /// Strictly increasing, and no stamp strays by more than a quarter of a sample from an even
  /// spread: a missing sample makes half a sample of stray, so none can hide.
  [[nodiscard]] bool is_uniform() const noexcept;
};

[[nodiscard]] ClockReport inspect_clock(std::span<const double> stamps_s);

/// The rate with the fewest digits, as a frequency or as a period, that agrees with `rate_Hz`
/// within `relative_tolerance`: 833.33333333334 becomes exactly 1 / 0.0012 s.
[[nodiscard]] double simplest_rate(double rate_Hz, double relative_tolerance);

}  // namespace torsio
