#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace torsio {

/// A channel has outliers from this many samples on.
inline constexpr std::size_t kFewestForOutliers = 1000;
/// At most this many, and at most this share of the samples (but one in any case).
inline constexpr std::size_t kMaxOutliers = 10;
inline constexpr double kShareOfOutliers = 1e-4;
/// An outlier is outside the range of 99.9 % of the samples, stretched by this factor about its
/// middle.
inline constexpr double kOutlierStretch = 5.0;

/// Values below `lowest` and above `highest` are outliers; without limits there are none.
struct OutlierLimits {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool contain(double value) const noexcept {
    return !(value < lowest) && !(value > highest);
  }
};

/// Looks for a few absurd values in a channel, which a wrong telegram leaves in a log.
///
/// The range of 99.9 % of the samples is the shortest interval [c - w/2, c + w/2] that contains so
/// many. On either side the outliers begin at the first value that is farther than 5 w / 2 from c
/// and whose distance from the next smaller excursion is at least w: an excursion that passes
/// through the values between is a motion. They are at most 10 and at most 0.01 % of the samples
/// (but one is possible from 1000 samples on), the most distant first; what is too frequent for
/// that is data. For a channel that is constant, w is its magnitude, at least 1 SI unit. Ours.
/// @param values all of them finite; their order is changed
[[nodiscard]] OutlierLimits outlier_limits(std::vector<double>& values);

}  // namespace torsio
