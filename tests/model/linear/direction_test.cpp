#include "model/linear/direction.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace torsio {
namespace {

std::vector<Direction> directions(DirectionTracker tracker, const std::vector<double>& signal) {
  std::vector<Direction> all;
  for (const double x : signal) all.push_back(tracker.step(x));
  return all;
}

constexpr Direction kUnknown = Direction::unknown;
constexpr Direction kRising = Direction::rising;
constexpr Direction kFalling = Direction::falling;

TEST(DirectionTracker, IsUnknownUntilTheSignalLeftTheDeadBand) {
  EXPECT_EQ(directions(DirectionTracker(1.0), {5.0, 5.9, 5.2, 6.1}),
            (std::vector{kUnknown, kUnknown, kUnknown, kRising}));
  EXPECT_EQ(directions(DirectionTracker(1.0), {5.0, 5.5, 4.4}),
            (std::vector{kUnknown, kUnknown, kFalling}));
}

TEST(DirectionTracker, ChangesRelativeToTheExtremeNotToTheLastSample) {
  // From the extreme 3.0 back in small steps: each is inside the dead band, their sum is not.
  EXPECT_EQ(
      directions(DirectionTracker(1.0), {0.0, 2.0, 3.0, 2.6, 2.2, 1.8, 1.9, 2.9}),
      (std::vector{kUnknown, kRising, kRising, kRising, kRising, kFalling, kFalling, kRising}));
}

TEST(DirectionTracker, NoiseInsideTheDeadBandNeverChangesIt) {
  DirectionTracker tracker(0.5);
  tracker.step(0.0);
  for (int i = 1; i < 1000; ++i) {
    const double ripple = i % 2 == 0 ? 0.2 : -0.2;
    const Direction direction = tracker.step(0.01 * i + ripple);
    if (i > 80) {
      EXPECT_EQ(direction, kRising) << "sample " << i;
    }
  }
}

TEST(DirectionTracker, IsUnknownAfterReset) {
  DirectionTracker tracker(1.0);
  tracker.step(0.0);
  ASSERT_EQ(tracker.step(2.0), kRising);
  tracker.reset();
  EXPECT_EQ(tracker.step(-7.0), kUnknown);
  EXPECT_EQ(tracker.step(-8.5), kFalling);
}

}  // namespace
}  // namespace torsio
