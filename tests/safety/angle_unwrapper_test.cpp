#include "torsio/safety/angle_unwrapper.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string>

#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kInfinity;
using test::kNaN;

/// An encoder with a turn of 8 rad, which moves by 1 rad in a period at most: numbers without rounding.
AngleUnwrapper encoder() { return AngleUnwrapper({.turn_rad = 8.0, .largest_change_rad = 1.0}); }

/// What an encoder with values from `lowest` on reports of an angle.
double wrapped(double angle_rad, double turn_rad, double lowest_rad) {
  return angle_rad - turn_rad * std::floor((angle_rad - lowest_rad) / turn_rad);
}

TEST(AngleUnwrapper, ContinuesAcrossTheWrapInBothDirections) {
  AngleUnwrapper unwrapper = encoder();
  ASSERT_TRUE(unwrapper.start(7.5, 7.5, 1.0));
  for (const double raw_rad : {7.75, 0.25, 1.0, 0.0, 7.5, 6.75}) {
    const AngleUnwrapper::Output output = unwrapper.step(raw_rad);
    EXPECT_EQ(output.fault, Fault::none);
    EXPECT_EQ(output.angle_rad, raw_rad < 2.0 ? raw_rad + 8.0 : raw_rad);
  }
}

TEST(AngleUnwrapper, TakesTheLargestChangeAndNoLargerOne) {
  for (const double sign : {1.0, -1.0}) {
    AngleUnwrapper unwrapper = encoder();
    ASSERT_TRUE(unwrapper.start(0.0, 0.0, 1.0));
    EXPECT_EQ(unwrapper.step(1.0 * sign).fault, Fault::none);
    AngleUnwrapper::Output output = unwrapper.step(2.0625 * sign);
    EXPECT_EQ(output.fault, Fault::input_not_finite);
    EXPECT_EQ(output.angle_rad, 1.0 * sign) << "held";
    output = unwrapper.step(2.0625 * sign);
    EXPECT_EQ(output.fault, Fault::none) << "it may be there after two periods";
    EXPECT_EQ(output.angle_rad, 2.0625 * sign);
    EXPECT_EQ(unwrapper.step(3.125 * sign).fault, Fault::input_not_finite)
        << "counted from the last good sample";
  }
}

TEST(AngleUnwrapper, HoldsItsAngleWithoutASample) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, 8.0001, -8.0001, 1e300}) {
    AngleUnwrapper unwrapper = encoder();
    ASSERT_TRUE(unwrapper.start(0.0, 24.0, 1.0));
    EXPECT_EQ(unwrapper.step(bad).fault, Fault::input_not_finite);
    EXPECT_EQ(unwrapper.step(bad).angle_rad, 24.0);
    const AngleUnwrapper::Output output = unwrapper.step(8.0);
    EXPECT_EQ(output.fault, Fault::none);
    EXPECT_EQ(output.angle_rad, 24.0);
  }
}

// After 5 periods without a sample it can have moved by 6 rad: 2 rad ahead is 6 rad back.
TEST(AngleUnwrapper, DoesNotGuessTheDirectionAfterALongGap) {
  const auto after = [](int missing, double raw_rad) {
    AngleUnwrapper unwrapper = encoder();
    EXPECT_TRUE(unwrapper.start(0.0, 0.0, 1.0));
    for (int n = 0; n < missing; ++n) (void)unwrapper.step(kNaN);
    return unwrapper.step(raw_rad).fault;
  };
  EXPECT_EQ(after(5, 1.9375), Fault::none);
  EXPECT_EQ(after(5, 2.0), Fault::zero_not_set);
  EXPECT_EQ(after(5, 6.0), Fault::zero_not_set);
  EXPECT_EQ(after(5, 6.0625), Fault::none);
  EXPECT_EQ(after(6, 0.0), Fault::none);
  EXPECT_EQ(after(7, 0.0), Fault::zero_not_set) << "a whole turn";
}

TEST(AngleUnwrapper, AnUnknownTurnRemainsUnknownUntilTheNextStart) {
  AngleUnwrapper unwrapper = encoder();
  EXPECT_EQ(unwrapper.step(0.0).fault, Fault::zero_not_set) << "before the first start";
  ASSERT_TRUE(unwrapper.start(1.0, 17.0, 1.0));
  for (int n = 0; n < 8; ++n) (void)unwrapper.step(kNaN);
  AngleUnwrapper::Output output = unwrapper.step(1.0);
  EXPECT_EQ(output.fault, Fault::zero_not_set);
  EXPECT_EQ(output.angle_rad, 17.0);
  output = unwrapper.step(1.0);
  EXPECT_EQ(output.fault, Fault::zero_not_set);
  EXPECT_EQ(output.angle_rad, 17.0);
  ASSERT_TRUE(unwrapper.start(1.0, 25.0, 1.0));
  EXPECT_EQ(unwrapper.step(1.0).angle_rad, 25.0);
  unwrapper.reset();
  EXPECT_EQ(unwrapper.step(1.0).fault, Fault::zero_not_set);
}

// A value that would be plausible again is a guess as well.
TEST(AngleUnwrapper, AnUnknownTurnDoesNotBecomeKnownByItself) {
  AngleUnwrapper unwrapper = encoder();
  ASSERT_TRUE(unwrapper.start(0.0, 0.0, 1.0));
  for (int n = 0; n < 5; ++n) (void)unwrapper.step(kNaN);
  EXPECT_EQ(unwrapper.step(2.0).fault, Fault::zero_not_set);
  EXPECT_EQ(unwrapper.step(0.5).fault, Fault::zero_not_set);
}

TEST(AngleUnwrapper, FindsTheTurnThatACoarseAngleMeans) {
  for (const double error_rad : {-3.9375, -1.0, 0.0, 2.0, 3.9375})
    for (const double turns : {-3.0, 0.0, 5.0}) {
      AngleUnwrapper unwrapper = encoder();
      ASSERT_TRUE(unwrapper.start(6.0, 6.0 + 8.0 * turns + error_rad, 3.9375));
      EXPECT_EQ(unwrapper.step(6.0).angle_rad, 6.0 + 8.0 * turns);
    }
}

TEST(AngleUnwrapper, RefusesAStartThatIsAmbiguous) {
  AngleUnwrapper unwrapper = encoder();
  const auto starts = [&](double raw_rad, double expected_rad, double tolerance_rad) {
    EXPECT_TRUE(unwrapper.start(0.0, 0.0, 1.0));
    const bool is_started = unwrapper.start(raw_rad, expected_rad, tolerance_rad);
    EXPECT_EQ(unwrapper.step(raw_rad).fault == Fault::none, is_started);
    return is_started;
  };
  EXPECT_TRUE(starts(1.0, 2.0, 1.0));
  EXPECT_FALSE(starts(1.0, 2.0625, 1.0)) << "beyond the tolerance";
  EXPECT_FALSE(starts(1.0, -0.0625, 1.0));
  EXPECT_TRUE(starts(1.0, 1.0, 3.9));
  EXPECT_FALSE(starts(1.0, 1.0, 4.0)) << "half a turn: two turns are possible";
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_FALSE(starts(bad, 1.0, 1.0));
    EXPECT_FALSE(starts(1.0, bad, 1.0));
    EXPECT_FALSE(starts(1.0, 1.0, bad));
  }
  EXPECT_FALSE(starts(1.0, 1.0, 0.0));
  EXPECT_FALSE(starts(1.0, 1.0, -1.0));
  EXPECT_TRUE(starts(8.0, 8.0, 1.0));
  EXPECT_FALSE(starts(8.5, 8.5, 1.0)) << "not a value of this encoder";
  EXPECT_TRUE(starts(0.0, 8e6, 1.0));
  EXPECT_FALSE(starts(0.0, 8e6 + 8.0, 1.0));
  EXPECT_FALSE(starts(0.0, -8e6 - 8.0, 1.0));
}

TEST(AngleUnwrapper, RefusesSettingsThatAreNotValid) {
  const auto refusal = [](double turn_rad, double change_rad) {
    return test::error_message(
        [&] { AngleUnwrapper({.turn_rad = turn_rad, .largest_change_rad = change_rad}); });
  };
  EXPECT_EQ(refusal(8.0, 3.99), "");
  for (const double bad : {0.0, -1.0, kNaN, kInfinity})
    EXPECT_TRUE(refusal(bad, 1.0).starts_with(
        "angle unwrapper: turn_rad: expected a positive number, found "))
        << bad;
  for (const double bad : {0.0, -1.0, kNaN, 4.0})
    EXPECT_TRUE(refusal(8.0, bad).starts_with(
        "angle unwrapper: largest_change_rad: expected above 0, below half a turn, found "))
        << bad;
}

// 20 power cycles of 500 periods each, at any speed below the limit, with missing samples, for encoders that
// count from 0 or from minus half a turn: the angle is the true one, or there is a fault.
RC_GTEST_PROP(AngleUnwrapper, IsTheTrueAngleForAnyMotionBelowTheLimit, ()) {
  Random random = any_random();
  const double turn_rad = 0.1 + 10.0 * random.uniform();
  const double change_rad = turn_rad * (0.001 + 0.498 * random.uniform());
  const double lowest_rad = random.uniform() < 0.5 ? 0.0 : -0.5 * turn_rad;
  AngleUnwrapper unwrapper({.turn_rad = turn_rad, .largest_change_rad = change_rad});
  double true_rad = 100.0 * random.normal();
  int good = 0;
  for (int cycle = 0; cycle < 20; ++cycle) {
    const double tolerance_rad = turn_rad * (0.01 + 0.48 * random.uniform());
    const double error_rad = 0.999 * tolerance_rad * (2.0 * random.uniform() - 1.0);
    RC_ASSERT(unwrapper.start(wrapped(true_rad, turn_rad, lowest_rad), true_rad + error_rad,
                              tolerance_rad));
    const double missing = 0.3 * random.uniform();
    for (int n = 0; n < 500; ++n) {
      true_rad +=
          0.999999 * change_rad * (random.uniform() < 0.3 ? 1.0 : 2.0 * random.uniform() - 1.0);
      const bool is_missing = random.uniform() < missing;
      const AngleUnwrapper::Output output =
          unwrapper.step(is_missing ? kNaN : wrapped(true_rad, turn_rad, lowest_rad));
      RC_ASSERT(std::isfinite(output.angle_rad));
      if (output.fault != Fault::none) continue;
      RC_ASSERT(!is_missing);
      RC_ASSERT(std::abs(output.angle_rad - true_rad) < 1e-9 * turn_rad);
      ++good;
    }
    true_rad += 3.0 * turn_rad * random.normal();  // moved while it had no power
  }
  RC_ASSERT(good > 0);
}

// Whatever the encoder reports: no angle jumps by more than it can move.
RC_GTEST_PROP(AngleUnwrapper, NeverMovesFasterThanItCan, ()) {
  Random random = any_random();
  AngleUnwrapper unwrapper = encoder();
  RC_ASSERT(unwrapper.start(0.0, 0.0, 1.0));
  double last_rad = 0.0;
  int periods = 0;
  for (int n = 0; n < 2000; ++n) {
    const AngleUnwrapper::Output output = unwrapper.step(20.0 * (random.uniform() - 0.5));
    ++periods;
    if (output.fault != Fault::none) {
      RC_ASSERT(output.angle_rad == last_rad);
      if (output.fault == Fault::zero_not_set) return;
      continue;
    }
    RC_ASSERT(std::abs(output.angle_rad - last_rad) <= 1.0 * periods + 1e-12);
    last_rad = output.angle_rad;
    periods = 0;
  }
}

}  // namespace
}  // namespace torsio
