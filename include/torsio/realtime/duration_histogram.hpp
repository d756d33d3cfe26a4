#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A histogram of durations in memory of fixed size: 16 buckets for each power of two, so that a
/// quantile is at most 1/16 too large and never too small, from 0 ns to 18 minutes; longer ones are
/// counted in the last bucket, their maximum is in `max_ns`.
class DurationHistogram {
 public:
  /// A negative duration counts as 0.
  void add(std::int64_t duration_ns) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::int64_t max_ns() const noexcept { return max_ns_; }  ///< exact
  /// The smallest bucket end that is not exceeded by at least this part of all durations; 0 if
  /// there are none. @param part in [0, 1], e.g. 0.999
  [[nodiscard]] std::int64_t quantile_ns(double part) const noexcept;

 private:
  static constexpr std::size_t kBuckets = 592;

  static std::size_t bucket_of(std::int64_t duration_ns) noexcept;
  static std::int64_t last_of(std::size_t bucket) noexcept;

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace torsio
