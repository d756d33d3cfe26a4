#include <gtest/gtest.h>

#include "safety/monitor_fixture.hpp"

namespace torsio::test {
namespace {

TEST(Monitor, StopsAtOnceOnASignalThatIsNotFinite) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    Loop loop;
    loop.start();
    loop.signals[0].value = bad;
    EXPECT_EQ(loop.ticks_to_stop(), 1);
    EXPECT_EQ(loop.text(), "motor_angle_rad is not a finite number");
  }
}

// docs/simulation/faults.md 11, 12: the age is that of the source.
TEST(Monitor, StopsAtOnceOnASignalThatIsTooOldOrFromTheFuture) {
  for (const double age_s : {0.0100001, kNaN, -1e-9, kInfinity}) {
    Loop loop;
    loop.start();
    loop.signals[1].age_s = 0.01;
    loop.step_for(10);
    ASSERT_TRUE(loop.monitor.is_watching()) << "just young enough";
    loop.signals[1].age_s = age_s;
    EXPECT_EQ(loop.ticks_to_stop(), 1) << age_s;
    EXPECT_EQ(loop.reason(), MonitorCheck::stale);
    EXPECT_EQ(loop.monitor.reason().limit, 0.01);
  }
  Loop loop;
  loop.start();
  loop.signals[1].age_s = 0.5;
  (void)loop.step();
  EXPECT_EQ(loop.text(), "gear_angle_rad is 0.5 s old, limit 0.01 s");
  EXPECT_EQ(loop.monitor.reason().first, 1);
  EXPECT_EQ(loop.monitor.reason().second, 1);
}

// docs/simulation/faults.md 6: a deflection is a signal like any other.
TEST(Monitor, StopsOnTheSecondSampleBeyondARange) {
  Loop loop;
  loop.start();
  loop.signals[2].value = 393.0;
  loop.step_for(10);
  ASSERT_TRUE(loop.monitor.is_watching()) << "the end of the range is inside";
  loop.signals[2].value = 394.0;
  EXPECT_EQ(loop.ticks_to_stop(), 2);
  EXPECT_EQ(loop.reason(), MonitorCheck::range);
  EXPECT_EQ(loop.text(), "motor_temperature_K is 394 K, beyond 393 K");
  EXPECT_EQ(loop.monitor.reason().first, 2);
  EXPECT_EQ(loop.monitor.reason().second, 2);
  Loop cold;
  cold.start();
  cold.signals[2].value = 233.0;
  cold.step_for(10);
  ASSERT_TRUE(cold.monitor.is_watching());
  cold.signals[2].value = 232.0;
  EXPECT_EQ(cold.ticks_to_stop(), 2);
  EXPECT_EQ(cold.text(), "motor_temperature_K is 232 K, beyond 233 K");
}

// docs/simulation/faults.md 10
TEST(Monitor, PassesOverOneSpike) {
  Loop loop;
  loop.start();
  for (int n = 0; n < 50; ++n) {
    loop.signals[1].value = 2.0;
    loop.signals[2].value = 0.0;
    (void)loop.step();
    loop.signals[1].value = 0.0;
    loop.signals[2].value = 300.0;
    loop.step_for(21);
  }
  EXPECT_TRUE(loop.monitor.is_watching());
  EXPECT_EQ(loop.monitor.latest().action, MonitorAction::off);
}

TEST(Monitor, StopsOnSpikesThatAreRepeated) {
  for (const int good : {0, 1, 5, 20}) {
    Loop loop;
    loop.start();
    loop.signals[2].value = 0.0;
    (void)loop.step();
    loop.signals[2].value = 300.0;
    loop.step_for(good);
    EXPECT_TRUE(loop.monitor.is_watching());
    loop.signals[2].value = 0.0;
    EXPECT_EQ(loop.step(), State::stopped) << good;
    EXPECT_EQ(loop.reason(), MonitorCheck::range);
  }
}

TEST(Monitor, TheNumberOfSpikesAndHowLongTheyCountAreSettings) {
  MonitorSettings settings = joint();
  settings.spikes_in_a_row = 4;
  settings.spike_memory_s = 0.0;
  Loop loop(settings);
  loop.start();
  for (int n = 0; n < 50; ++n) {
    loop.signals[2].value = n % 4 == 3 ? 300.0 : 0.0;
    (void)loop.step();
  }
  EXPECT_TRUE(loop.monitor.is_watching()) << "never more than three, and forgotten at once";
  loop.signals[2].value = 0.0;
  EXPECT_EQ(loop.ticks_to_stop(), 2) << "two before";
}

TEST(Monitor, StopsOnARateThatASignalCannotHave) {
  for (const double step_rad : {0.0102, -0.0102}) {
    Loop loop;
    loop.start();
    for (int n = 0; n < 20; ++n) {  // up to the limit of 10 rad/s
      loop.signals[1].value += 0.98 * step_rad;
      loop.signals[0].value += 0.1;
      (void)loop.step();
    }
    ASSERT_TRUE(loop.monitor.is_watching());
    loop.signals[1].value += 4.0 * step_rad;
    EXPECT_EQ(loop.step(), State::watching);
    loop.signals[1].value += 4.0 * step_rad;
    EXPECT_EQ(loop.step(), State::stopped);
    EXPECT_EQ(loop.reason(), MonitorCheck::rate);
    EXPECT_NEAR(loop.monitor.reason().value, 4000.0 * step_rad, 1e-6)
        << "over the two periods since the last good sample";
    EXPECT_EQ(loop.monitor.reason().limit, 10.0);
    EXPECT_EQ(loop.monitor.reason().first, 1);
    EXPECT_EQ(loop.monitor.reason().second, 1);
  }
  EXPECT_EQ(
      describe({.check = MonitorCheck::rate, .first = 1, .value = 40.8, .limit = 10.0}, joint()),
      "gear_angle_rad changes by 40.8 rad per second, limit 10 rad per second");
  EXPECT_EQ(describe({.check = MonitorCheck::rate, .first = 1, .value = -2.0904, .limit = 2.0901},
                     joint()),
            "gear_angle_rad changes by 2.0904 rad per second, limit 2.0901 rad per second")
      << "with as many digits as it takes";
  EXPECT_EQ(
      describe({.check = MonitorCheck::rate, .first = 1, .value = 2.0, .limit = 2.0}, joint()),
      "gear_angle_rad changes by 2 rad per second, limit 2 rad per second");
  MonitorSettings settings;
  settings.signals = {{.name = "gear_angle_rad - joint_angle_rad"}, {.name = "share_1"}};
  EXPECT_EQ(describe({.check = MonitorCheck::rate, .value = 3.0, .limit = 2.0}, settings),
            "gear_angle_rad - joint_angle_rad changes by 3 per second, limit 2 per second");
  EXPECT_EQ(
      describe({.check = MonitorCheck::range, .first = 1, .value = 3.0, .limit = 2.0}, settings),
      "share_1 is 3, beyond 2");
}

TEST(Monitor, AChangeOverAGapCountsForTheWholeGap) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::not_finite) = MonitorAction::warn;
  Loop loop(settings);
  loop.start();
  for (int n = 0; n < 20; ++n) {
    loop.signals[1].value = kNaN;
    (void)loop.step();
  }
  loop.signals[1].value = 0.2;  // 0.2 rad in 21 ms: below 10 rad/s
  loop.step_for(100);
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, ASampleIsNeverAllowedLessThanAPeriod) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::period) = MonitorAction::off;
  Loop loop(settings);
  loop.start();
  for (int n = 0; n < 100; ++n) {
    loop.signals[1].value += n % 2 == 0 ? 0.009 : -0.009;
    (void)loop.step(1e-6);
  }
  EXPECT_TRUE(loop.monitor.is_watching()) << "two ticks in quick succession";
}

// docs/simulation/faults.md 7
TEST(Monitor, RecognisesAWrapOfAnEncoder) {
  MonitorSettings settings = joint();
  settings.signals[1] = {.name = "gear_angle_rad", .turn = 2.0};
  for (const double change : {2.0, -2.0, 1.81, -2.19, 4.0, 5.9}) {
    Loop loop(settings);
    loop.start();
    loop.signals[1].value = change;
    EXPECT_EQ(loop.ticks_to_stop(100), 2) << change;
    EXPECT_EQ(loop.reason(), MonitorCheck::wrap);
    EXPECT_EQ(loop.monitor.reason().value, change);
    EXPECT_EQ(loop.monitor.reason().limit, 2.0);
    EXPECT_EQ(loop.monitor.reason().first, 1);
    EXPECT_EQ(loop.monitor.reason().second, 1);
  }
  for (const double change : {0.0, 0.19, 1.0, 1.79, -1.79, 2.21}) {
    Loop loop(settings);
    loop.start();
    loop.signals[1].value = change;
    EXPECT_EQ(loop.ticks_to_stop(100), -1) << change;
  }
  EXPECT_EQ(
      describe({.check = MonitorCheck::wrap, .first = 1, .value = 2.0, .limit = 2.0}, joint()),
      "gear_angle_rad changed by 2 rad, a turn of its encoder");
}

// It was once compared with the angle before the wrap until the joint had moved by a tenth of a
// turn.
TEST(Monitor, AWrapIsFoundOnce) {
  MonitorSettings settings = joint();
  settings.signals[0].turn = 2.0;
  Loop unarmed(settings);
  (void)unarmed.step();
  unarmed.signals[0].value = 2.0;
  unarmed.step_for(2);
  EXPECT_EQ(unarmed.monitor.active(), bit(MonitorCheck::wrap));
  (void)unarmed.step();
  EXPECT_EQ(unarmed.monitor.active(), 0U);
  unarmed.step_for(30);
  unarmed.start();
  action(settings, MonitorCheck::wrap) = MonitorAction::warn;
  Loop warned(settings);
  warned.start();
  for (const double value : {2.0, 0.0}) {
    warned.signals[0].value = value;
    warned.step_for(2);
    EXPECT_NE(warned.monitor.latest().t_s, 0.0);
    (void)warned.step();
    EXPECT_EQ(warned.monitor.active(), 0U);
  }
  EXPECT_TRUE(warned.monitor.is_watching());
}

TEST(Monitor, AWrapIsWithinATenthOfATurn) {
  MonitorSettings settings = joint();
  settings.signals[1] = {.name = "gear_angle_rad", .turn = 10.0};
  for (const double change : {9.0, 9.125}) {
    Loop loop(settings);
    loop.start();
    loop.signals[1].value = change;
    EXPECT_EQ(loop.ticks_to_stop(100), change == 9.0 ? -1 : 2) << change;
  }
}

TEST(Monitor, AWrapComesBeforeTheRateThatItIs) {
  MonitorSettings settings = joint();
  settings.signals[1].turn = 2.0;
  Loop loop(settings);
  loop.start();
  loop.signals[1].value = 2.0;
  EXPECT_EQ(loop.ticks_to_stop(), 2);
  EXPECT_EQ(loop.reason(), MonitorCheck::wrap);
}

TEST(Monitor, TheFirstSampleIsNoWrapAndHasNoRate) {
  MonitorSettings settings = joint();
  settings.signals[1].turn = 2.0;
  Loop loop(settings);
  loop.signals[1].value = 2.0;
  loop.step_for(10);
  EXPECT_EQ(loop.monitor.latest().action, MonitorAction::off);
}

// docs/simulation/faults.md 1
TEST(Monitor, StopsOnASignalThatIsFrozenWhileItsCompanionMoves) {
  for (const double direction : {1.0, -1.0}) {
    Loop loop;
    loop.start();
    loop.signals[0].value = 1.5 * direction;
    loop.step_for(10);
    ASSERT_TRUE(loop.monitor.is_watching()) << "may be hidden by the play of the gear";
    loop.signals[0].value = 1.6 * direction;
    EXPECT_EQ(loop.ticks_to_stop(), 1);
    EXPECT_EQ(loop.reason(), MonitorCheck::frozen);
    EXPECT_EQ(loop.monitor.reason().first, 1);
    EXPECT_EQ(loop.monitor.reason().second, 0);
    EXPECT_EQ(loop.text(),
              "gear_angle_rad did not change while motor_angle_rad moved by 1.6, limit 1.5");
  }
}

TEST(Monitor, NothingIsFrozenAtRest) {
  Loop loop;
  loop.signals[0].value = 40.0;
  loop.signals[1].value = 0.3;
  loop.start();
  loop.step_for(20'000);
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, ASignalThatChangesIsNotFrozenHoweverFarItsCompanionMoves) {
  Loop loop;
  loop.start();
  for (int n = 0; n < 2000; ++n) {
    loop.signals[0].value += 0.1;
    if (n % 14 == 0) loop.signals[1].value += 1e-9;
    (void)loop.step();
  }
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, NothingIsFrozenWithoutACompanion) {
  MonitorSettings settings = joint();
  settings.signals[2].largest_hidden_travel = 0.1;
  Loop loop(settings);
  loop.start();
  loop.signals[0].value = 0.5;
  loop.step_for(10);
  EXPECT_TRUE(loop.monitor.is_watching());
}

// A companion without a number in the first tick once counted as one at 0.
TEST(Monitor, NothingIsFrozenBecauseItsCompanionCameLater) {
  Loop loop;
  loop.signals[0].value = kNaN;
  (void)loop.step();
  loop.signals[0].value = 40.0;
  loop.step_for(60);
  EXPECT_EQ(loop.monitor.state(), State::ready);
}

TEST(Monitor, NothingIsFrozenBecauseOfASpikeOfItsCompanion) {
  Loop loop;
  loop.start();
  loop.signals[0].value = 40.0;
  (void)loop.step();
  loop.signals[0].value = 0.0;
  loop.step_for(100);
  EXPECT_TRUE(loop.monitor.is_watching());
}

}  // namespace
}  // namespace torsio::test
