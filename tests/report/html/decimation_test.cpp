#include "report/document/decimation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "support/numbers.hpp"

namespace torsio {
namespace {

using test::kNaN;

TEST(Overview, KeepsThePeakOfASingleSample) {
  std::vector<double> values(100'000, 0.0);
  values[31'415] = 7.0;
  values[92'653] = -5.0;
  const std::vector<float> overview = overview_of(values, 1000);
  ASSERT_EQ(overview.size(), 200U);
  EXPECT_EQ(std::ranges::max(overview), 7.0F);
  EXPECT_EQ(std::ranges::min(overview), -5.0F);
  EXPECT_EQ(std::ranges::count(overview, 7.0F), 1);
}

TEST(Overview, KeepsTheExtremesOfEveryBucketInTheirOrder) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  std::vector<double> values(10'007);
  for (double& value : values) value = noise(random);
  constexpr std::size_t kBucket = 13;
  const std::vector<float> overview = overview_of(values, kBucket);
  ASSERT_EQ(overview.size(), 2 * ((values.size() + kBucket - 1) / kBucket));
  for (std::size_t b = 0; 2 * b < overview.size(); ++b) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(b * kBucket);
    const auto end =
        values.begin() + static_cast<std::ptrdiff_t>(std::min((b + 1) * kBucket, values.size()));
    const auto [low, high] = std::minmax_element(begin, end);
    const bool is_low_first = low < high;
    EXPECT_EQ(overview[2 * b], static_cast<float>(is_low_first ? *low : *high)) << b;
    EXPECT_EQ(overview[2 * b + 1], static_cast<float>(is_low_first ? *high : *low)) << b;
  }
}

TEST(Overview, ShowsAGapOnlyWhereABucketHasNoValue) {
  const std::vector<double> values{1.0,  kNaN, kNaN,
                                   kNaN, 2.0,  std::numeric_limits<double>::infinity()};
  const std::vector<float> overview = overview_of(values, 2);
  ASSERT_EQ(overview.size(), 6U);
  EXPECT_EQ(overview[0], 1.0F);
  EXPECT_TRUE(std::isnan(overview[2]) && std::isnan(overview[3]));
  EXPECT_EQ(overview[4], 2.0F);
  EXPECT_EQ(overview[5], 2.0F);
}

TEST(OverviewPlan, HasAllSamplesOfAShortRecording) {
  const OverviewPlan plan = plan_overview(1000, 10, {}, 100'000);
  ASSERT_EQ(plan.windows.size(), 1U);
  EXPECT_EQ(plan.windows.front().end, 1000U);
}

TEST(OverviewPlan, PutsEveryPlaceIntoAWindowAndStaysWithinItsNumbers) {
  constexpr std::size_t kSamples = 10'000'000;
  std::vector<PlaceOfInterest> places{
      {0, "begin"}, {5'000'000, "middle"}, {5'000'010, "near it"}, {kSamples - 1, "end"}};
  const OverviewPlan plan = plan_overview(kSamples, 8, places, 1'500'000);
  EXPECT_EQ(plan.windows.size(), 3U);
  for (const PlaceOfInterest& place : places)
    EXPECT_TRUE(std::ranges::any_of(plan.windows, [&](const DetailWindow& window) {
      return place.sample >= window.begin && place.sample < window.end && window.end <= kSamples;
    })) << place.label;
  std::size_t values = 2 * 8 * (kSamples / plan.bucket + 1);
  for (const DetailWindow& window : plan.windows) values += 8 * (window.end - window.begin);
  EXPECT_LE(values, 1'500'000U);
}

TEST(OverviewPlan, HasAtMostTwentyWindows) {
  std::vector<PlaceOfInterest> places;
  for (std::size_t i = 0; i < 100; ++i) places.push_back({i * 100'000, ""});
  EXPECT_EQ(plan_overview(10'000'000, 4, places, 400'000).windows.size(), kMaxWindows);
}

TEST(ThinnedCurve, StaysNearALoopWithFewPoints) {
  std::vector<double> x;
  std::vector<double> y;
  for (int n = 0; n < 200'000; ++n) {
    const double angle = 2.0 * std::numbers::pi * n / 50'000.0;
    x.push_back(std::sin(angle));
    y.push_back(std::cos(angle));
  }
  const ThinnedCurve curve = thinned(x, y);
  EXPECT_LE(curve.x.size(), kMaxCurvePoints);
  EXPECT_GT(curve.x.size(), 1000U);
  EXPECT_NEAR(std::ranges::max(curve.x), 1.0, 1e-4);
  EXPECT_EQ(curve.kept.front(), 0U);
  EXPECT_EQ(curve.kept.back(), x.size() - 1);
}

TEST(ThinnedCurve, KeepsAGap) {
  const std::vector<double> x{0.0, 1.0, kNaN, kNaN, 2.0, 3.0};
  const std::vector<double> y{0.0, 1.0, 1.0, 1.0, 2.0, 3.0};
  const ThinnedCurve curve = thinned(x, y);
  EXPECT_EQ(curve.kept, (std::vector<std::size_t>{0, 1, 2, 4, 5}));
}

TEST(Reversals, AreTheFirstAndTheLastOne) {
  std::vector<double> x;
  for (int n = 0; n < 1000; ++n) x.push_back(std::sin(0.02 * n));
  const auto places = reversals_of(x);
  ASSERT_EQ(places.size(), 2U);
  EXPECT_NEAR(static_cast<double>(places.front().sample), 0.5 * std::numbers::pi / 0.02, 1.0);
  EXPECT_NEAR(static_cast<double>(places.back().sample), 5.5 * std::numbers::pi / 0.02, 1.0);
  EXPECT_TRUE(reversals_of(std::vector<double>{1.0, 2.0, 3.0}).empty());
}

}  // namespace
}  // namespace torsio
