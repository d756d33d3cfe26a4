#include <gtest/gtest.h>

#include <array>

#include "torsio/estimate/estimator_core.hpp"

namespace torsio::detail {
namespace {

constexpr double kPeriod_s = 0.01;

/// A slip of 2 Nm over the second input: forgotten after a travel of 0.2.
MemoryError over_angle() { return {{.slips = {{20.0, 0.2, 1, 0.0}}}, 1.0, kPeriod_s, 0.0}; }
/// The same over the integral of the second input.
MemoryError over_rate() { return {{.slips = {{20.0, 0.2, 1, kPeriod_s}}}, 1.0, kPeriod_s, 0.0}; }

TEST(MemoryError, ASlipOverAnotherInputIsKnownAgainAfterItsTravel) {
  MemoryError error = over_angle();
  EXPECT_TRUE(error.is_zero());
  error.interrupt(1.0, 0.01);
  EXPECT_DOUBLE_EQ(error.bound(), 4.0) << "however little the first input may have moved";
  error.follow(std::array{0.0, 3.0});
  error.follow(std::array{0.9, 3.0});
  EXPECT_DOUBLE_EQ(error.bound(), 4.0) << "the first input's travel does not count";
  error.follow(std::array{0.9, 3.1});
  EXPECT_NEAR(error.bound(), 2.0, 1e-12);
  error.follow(std::array{0.9, 2.9});
  EXPECT_TRUE(error.is_zero());
}

TEST(MemoryError, ASlipOverAnIntegralIsKnownAgainAfterThatHasTravelled) {
  MemoryError error = over_rate();
  error.interrupt(100.0);
  error.follow(std::array{0.0, 5.0});
  error.follow(std::array{0.0, 10.0});
  EXPECT_NEAR(error.bound(), 20.0 * (0.2 - 0.1), 1e-12);
  error.follow(std::array{0.0, 10.0});
  EXPECT_TRUE(error.is_zero());
}

TEST(MemoryError, OfALimitedInputOnlyWhatWasCutOffIsUnknown) {
  MemoryError by_rate = over_rate();
  MemoryError by_angle = over_angle();
  const std::array widths{1.0, 2.0};
  for (int n = 0; n < 3; ++n) {
    by_rate.miss_others(std::array{0.0, 0.5}, widths);
    by_angle.miss_others(std::array{0.0, 0.03}, widths);
  }
  EXPECT_NEAR(by_rate.bound(), 20.0 * 3.0 * kPeriod_s * 0.5, 1e-12) << "it adds up";
  EXPECT_NEAR(by_angle.bound(), 20.0 * 0.03, 1e-12) << "it comes back";
  by_rate.miss_others(std::array{0.7, 0.0}, widths);
  EXPECT_NEAR(by_rate.bound(), 20.0 * 3.0 * kPeriod_s * 0.5, 1e-12) << "the first is not looked at";
}

TEST(MemoryError, TheFirstInputAloneLeavesOtherMemoryAsItIs) {
  MemoryError error({.relaxations = {{5.0, 0.1, 1}}, .slips = {{20.0, 0.2, 1, 0.0}}}, 1.0,
                    kPeriod_s, 0.0);
  error.interrupt(1.0, 1.0, false);
  EXPECT_DOUBLE_EQ(error.bound(), 0.0);
  error.interrupt(1.0, 0.0);
  EXPECT_GT(error.bound(), 4.0) << "both are lost";
}

}  // namespace
}  // namespace torsio::detail
