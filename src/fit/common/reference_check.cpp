#include "fit/common/reference_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "numerics/centred_sums.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kLeastFollowing = 0.1;
constexpr double kLargestFactor = 100.0;
constexpr double kStuckShare = 0.25;
constexpr double kCorrelated = 0.5;

struct Moments {
  double correlation = 0.0;
  double gain = 0.0;  ///< standard deviation of the measured values over that of the estimates
};

Moments moments_of(const ReferencePairs& pairs) {
  const CentredSums sums(pairs.estimated, pairs.measured);
  if (!(sums.xx > 0.0 && sums.yy > 0.0)) return {};
  return {.correlation = sums.xy / std::sqrt(sums.xx * sums.yy),
          .gain = std::sqrt(sums.yy / sums.xx)};
}

/// Largest range of the estimates over samples between which the measured value does not change.
double range_while_stuck(const ReferencePairs& pairs) {
  double largest = 0.0;
  double low = 0.0;
  double high = 0.0;
  for (std::size_t n = 0; n < pairs.measured.size(); ++n) {
    const double value = pairs.estimated[n];
    if (n == 0 || pairs.measured[n] != pairs.measured[n - 1]) low = high = value;
    low = std::min(low, value);
    high = std::max(high, value);
    largest = std::max(largest, high - low);
  }
  return largest;
}

}  // namespace

void require_plausible_reference(const std::string& place, const ReferencePairs& pairs) {
  if (pairs.measured.empty()) return;
  const auto [lowest, highest] = std::ranges::minmax(pairs.measured);
  const auto [least, most] = std::ranges::minmax(pairs.estimated);
  const double expected = most - least;
  if (highest - lowest < kLeastFollowing * expected || !(highest > lowest)) {
    const bool is_constant = !(highest > lowest);
    throw Error({.place = place,
                 .problem = "the torque does not follow the motion",
                 .expected = fmt::format("values that vary by about {:.3g}, as those of the model",
                                         expected),
                 .found = is_constant ? fmt::format("the constant {:.6g}", lowest)
                                      : fmt::format("{:.3g}", highest - lowest),
                 .advice = "Check the load cell, its amplifier and its cable, and record again."});
  }
  if (const double stuck = range_while_stuck(pairs); stuck > kStuckShare * expected)
    throw Error({.place = place,
                 .problem = "the torque does not change in a part of the motion",
                 .expected = "a value that changes with the motion",
                 .found = fmt::format("one value while the model's output varies by {:.3g}", stuck),
                 .advice = "Check the load cell, its amplifier and its cable, and record again, or "
                           "leave that part out."});
  const Moments moments = moments_of(pairs);
  if (moments.correlation < -kCorrelated)
    throw Error({.place = place,
                 .problem = "the torque has the opposite sign of the model's",
                 .expected = "a torque that rises with the output of the model",
                 .found = fmt::format("a correlation of {:.2f}", moments.correlation),
                 .advice = "Check the sign of the torque and that of the deflection in the "
                           "recording; a mapping can turn both (sign: -1)."});
  if (moments.correlation >= kCorrelated &&
      (moments.gain >= kLargestFactor || moments.gain <= 1.0 / kLargestFactor))
    throw Error(
        {.place = place,
         .problem = "the torque is of another size than the model's",
         .expected = "a torque in the unit of the training data",
         .found = fmt::format("values {:.3g} times as large as those of the model", moments.gain),
         .advice = "Check the unit of the torque in the recording or its mapping."});
}

}  // namespace torsio
