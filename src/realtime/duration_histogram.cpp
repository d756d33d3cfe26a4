#include <algorithm>
#include <bit>
#include <cmath>

#include "torsio/realtime/realtime_loop.hpp"

namespace torsio {
namespace {

constexpr int kFractionBits = 4;
constexpr std::uint64_t kFractions = std::uint64_t{1} << kFractionBits;

}  // namespace

std::size_t DurationHistogram::bucket_of(std::int64_t duration_ns) noexcept {
  const auto duration = static_cast<std::uint64_t>(duration_ns);
  if (duration < kFractions) return duration;
  const int shift = static_cast<int>(std::bit_width(duration)) - 1 - kFractionBits;
  const std::uint64_t fraction = (duration >> shift) & (kFractions - 1);
  const std::uint64_t bucket = (static_cast<std::uint64_t>(shift) + 1) * kFractions + fraction;
  return std::min<std::size_t>(bucket, kBuckets - 1);
}

std::int64_t DurationHistogram::last_of(std::size_t bucket) noexcept {
  if (bucket < kFractions) return static_cast<std::int64_t>(bucket);
  const std::uint64_t shift = bucket / kFractions - 1;
  return static_cast<std::int64_t>(((kFractions + bucket % kFractions + 1) << shift) - 1);
}

void DurationHistogram::add(std::int64_t duration_ns) noexcept {
  const std::int64_t duration = std::max<std::int64_t>(duration_ns, 0);
  ++counts_[bucket_of(duration)];
  ++count_;
  max_ns_ = std::max(max_ns_, duration);
}

std::int64_t DurationHistogram::quantile_ns(double part) const noexcept {
  const double rank = std::ceil(std::clamp(part, 0.0, 1.0) * static_cast<double>(count_));
  const auto wanted = std::max<std::uint64_t>(static_cast<std::uint64_t>(rank), 1);
  std::uint64_t met = 0;
  for (std::size_t bucket = 0; bucket + 1 < kBuckets; ++bucket) {
    met += counts_[bucket];
    if (met >= wanted) return std::min(last_of(bucket), max_ns_);
  }
  return max_ns_;
}

}  // namespace torsio
