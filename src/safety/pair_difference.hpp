#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "torsio/core/realtime.hpp"
#include "torsio/safety/monitor.hpp"

namespace torsio::detail {

/// Standard deviation of the difference of two estimates, sqrt(s_i^2 + s_j^2 - 2 R_ij s_i s_j). NaN
/// where a square overflows.
inline double difference_std_dev(double first_Nm, double second_Nm,
                                 double correlation) noexcept TORSIO_REALTIME {
  return std::sqrt(first_Nm * first_Nm + second_Nm * second_Nm -
                   2.0 * correlation * first_Nm * second_Nm);
}

/// Threshold of |difference| without its ceiling. NaN gives the floor, the narrowest one.
inline double threshold_without_ceiling(const PairLimits& pair,
                                        double std_dev_Nm) noexcept TORSIO_REALTIME {
  return std::max(pair.floor_Nm, pair.factor * std_dev_Nm);
}

/// In so many of the last samples, of a window, a difference must exceed its threshold: the first
/// number of samples that takes longer than the persistence; rounding does not make it longer.
inline std::size_t persistent_samples(double persistence_s, double period_s) noexcept {
  return static_cast<std::size_t>(persistence_s / period_s * (1.0 + 1e-9) + 1e-9) + 1;
}

/// The window over the number of these samples. A difference that oscillates, as where a fault makes
/// a control loop unstable, exceeds its threshold in less than half of the samples.
inline constexpr std::size_t kPersistenceWindow = 3;

/// One sample of the cumulative sum on either side, S <- max(0, S + (share - drift_allowance) T).
/// @param share difference over threshold; NaN counts as none
inline void add_to_drift(DriftSums& sums, double share, const PairLimits& pair,
                         double period_s) noexcept TORSIO_REALTIME {
  // Limited, so that a difference that has ended is not reported for long.
  const auto next = [&](double sum_s, double excess) {
    const double next_s = sum_s + (excess - pair.drift_allowance) * period_s;
    return std::min(std::max(0.0, next_s), 2.0 * pair.drift_limit_s);
  };
  sums.up_s = next(sums.up_s, share);
  sums.down_s = next(sums.down_s, -share);
}

}  // namespace torsio::detail
