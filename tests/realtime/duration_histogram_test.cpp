#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "torsio/realtime/realtime_loop.hpp"

namespace torsio {
namespace {

TEST(DurationHistogram, WithoutDurationsReturnsZero) {
  const DurationHistogram histogram;
  EXPECT_EQ(histogram.count(), 0U);
  EXPECT_EQ(histogram.quantile_ns(0.99), 0);
  EXPECT_EQ(histogram.max_ns(), 0);
}

TEST(DurationHistogram, QuantilesAreNeverTooSmallAndAtMostASixteenthTooLarge) {
  EXPECT_TRUE(rc::check([] {
    constexpr std::int64_t kEighteenMinutes_ns = std::int64_t{1} << 40;
    // Evenly over the powers of two, as durations are met.
    const auto duration_gen = rc::gen::map(
        rc::gen::pair(rc::gen::inRange(0, 40), rc::gen::arbitrary<std::uint32_t>()),
        [](const std::pair<int, std::uint32_t>& drawn) {
          return static_cast<std::int64_t>(std::ldexp(1.0 + drawn.second / 0x1p32, drawn.first));
        });
    auto durations = *rc::gen::container<std::vector<std::int64_t>>(duration_gen);
    RC_PRE(!durations.empty());
    DurationHistogram histogram;
    for (const std::int64_t duration : durations) {
      RC_ASSERT(duration < kEighteenMinutes_ns);
      histogram.add(duration);
    }
    std::ranges::sort(durations);
    for (const double part : {0.0, 0.5, 0.99, 0.999, 1.0}) {
      const double rank = std::ceil(part * static_cast<double>(durations.size()));
      const std::int64_t exact = durations[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
      RC_ASSERT(histogram.quantile_ns(part) >= exact);
      RC_ASSERT(histogram.quantile_ns(part) <= exact + exact / 16);
    }
    RC_ASSERT(histogram.max_ns() == durations.back());
  }));
}

TEST(DurationHistogram, TakesWhatNoBucketHolds) {
  DurationHistogram histogram;
  histogram.add(-7);
  histogram.add(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(histogram.count(), 2U);
  EXPECT_EQ(histogram.quantile_ns(0.5), 0);
  EXPECT_EQ(histogram.quantile_ns(1.0), std::numeric_limits<std::int64_t>::max());
}

}  // namespace
}  // namespace torsio
