#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "safety/monitor_fixture.hpp"

namespace torsio::test {
namespace {

// docs/simulation/faults.md 2: within 20 ms, without a vote.
TEST(Monitor, StopsOnSourcesThatDisagreeForLongerThanThePersistence) {
  for (const double sign : {1.0, -1.0}) {
    Loop loop;
    loop.start();
    loop.sources[2].value = 1.0 * sign;
    loop.step_for(100);
    ASSERT_TRUE(loop.monitor.is_watching()) << "at the threshold";
    loop.sources[2].value = 1.01 * sign;
    EXPECT_EQ(loop.ticks_to_stop(), 6);
    EXPECT_EQ(loop.reason(), MonitorCheck::disagreement);
    EXPECT_EQ(loop.monitor.reason().first, 0);
    EXPECT_EQ(loop.monitor.reason().second, 2);
    EXPECT_EQ(loop.monitor.reason().value, -1.01 * sign);
    EXPECT_EQ(loop.monitor.reason().limit, 1.0);
    ASSERT_EQ(loop.monitor.disagreeing().size(), 2U);
    EXPECT_EQ(loop.monitor.disagreeing()[0], (std::array<std::uint8_t, 2>{0, 2}));
    EXPECT_EQ(loop.monitor.disagreeing()[1], (std::array<std::uint8_t, 2>{1, 2}));
  }
  EXPECT_EQ(
      describe({.check = MonitorCheck::disagreement, .second = 2, .value = -1.01, .limit = 1.0},
               joint()),
      "the torques of current and spring differ by 1.01 Nm, more than 1 Nm");
}

TEST(Monitor, ADifferenceThatEndsInTimeIsNone) {
  Loop loop;
  loop.start();
  for (int n = 0; n < 100; ++n) {
    loop.sources[2].value = 1.5;
    loop.step_for(5);
    loop.sources[2].value = 0.5;
    loop.step_for(13);
  }
  EXPECT_TRUE(loop.monitor.is_watching());
}

// An unstable loop: the difference passes through zero.
TEST(Monitor, StopsOnADifferenceThatOscillates) {
  Loop loop;
  loop.start();
  int ticks = 0;
  for (; loop.monitor.is_watching() && ticks < 100; ++ticks) {
    constexpr std::array kDifference{1.5, 0.0, -1.5, 0.0, 0.0};
    loop.sources[2].value = kDifference[static_cast<std::size_t>(ticks % 5)];
    (void)loop.step();
  }
  EXPECT_EQ(ticks, 13) << "six of 13 samples, less than half of them";
  EXPECT_EQ(loop.reason(), MonitorCheck::disagreement);
}

TEST(Monitor, WithoutPersistenceItStopsAtOnce) {
  MonitorSettings settings = joint();
  settings.persistence_s = 0.0;
  Loop loop(settings);
  loop.start();
  loop.sources[2].value = 1.01;
  EXPECT_EQ(loop.ticks_to_stop(), 1);
}

/// The difference of two sources at which it begins to stop, by bisection.
double threshold_of(const PairLimits& limits, double first_Nm, double second_Nm,
                    const std::vector<double>& correlation = {}) {
  MonitorSettings settings = joint();
  settings.sources = {"gear", "spring"};
  settings.pairs = {limits};
  settings.persistence_s = 0.0;
  settings.proof_s = 0.0;
  settings.correlation = correlation;
  double below = 0.0;
  double above = 1e6;
  while (above - below > 1e-9 * above) {
    const double middle = 0.5 * (below + above);
    Loop loop(settings);
    loop.sources[0] = {.value = middle, .std_dev = first_Nm};
    loop.sources[1] = {.value = 0.0, .std_dev = second_Nm};
    (void)loop.step();
    (loop.monitor.active() == 0 ? below : above) = middle;
  }
  return above;
}

TEST(Monitor, TheThresholdFollowsTheErrorBarsBetweenFloorAndCeiling) {
  const PairLimits limits{.factor = 5.0, .floor_Nm = 1.0, .ceiling_Nm = 4.0};
  EXPECT_NEAR(threshold_of(limits, 0.3, 0.4), 2.5, 1e-6);
  EXPECT_NEAR(threshold_of(limits, 0.01, 0.01), 1.0, 1e-6);
  EXPECT_NEAR(threshold_of(limits, 3.0, 4.0), 4.0, 1e-6);
  EXPECT_NEAR(threshold_of(limits, 0.3, 0.4, {1.0, 0.5, 0.5, 1.0}), 5.0 * std::sqrt(0.13), 1e-6);
  EXPECT_NEAR(threshold_of(limits, 0.3, 0.4, {1.0, -0.5, -0.5, 1.0}), 5.0 * std::sqrt(0.37), 1e-6)
      << "wider with errors of opposite sign";
  EXPECT_NEAR(threshold_of({.factor = 2.0, .floor_Nm = 0.0}, 3.0, 4.0), 10.0, 1e-5);
  EXPECT_NEAR(threshold_of(limits, 1e200, 1e200), 4.0, 1e-6);
}

TEST(Monitor, TheErrorBarsOfAPairAreThoseOfItsSources) {
  MonitorSettings settings = joint();
  settings.pairs = {{.first = 2, .second = 1}};
  settings.correlation = {1.0, 0.0, 0.0, 0.0, 1.0, 0.9, 0.0, 0.9, 1.0};
  Loop loop(settings);
  loop.sources[1].std_dev = loop.sources[2].std_dev = 1.0;
  loop.start();
  loop.sources[0].value = 1e6;  // in no pair
  loop.sources[2].value = 6.0 * std::sqrt(0.2) * 1.001;
  EXPECT_EQ(loop.ticks_to_stop(), 6);
  EXPECT_NEAR(loop.monitor.reason().limit, 6.0 * std::sqrt(0.2), 1e-12);
  EXPECT_EQ(loop.monitor.reason().first, 2);
  EXPECT_EQ(loop.monitor.reason().second, 1);
}

TEST(Monitor, ADisagreementEndsBelowTheReleaseShareOfItsThreshold) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::disagreement) = MonitorAction::warn;
  settings.pairs.resize(1);
  Loop loop(settings);
  loop.start();
  const auto active_at = [&](double value) {
    loop.sources[0].value = value;
    loop.step_for(10);
    return loop.monitor.active() == bit(MonitorCheck::disagreement);
  };
  EXPECT_FALSE(active_at(0.95));
  EXPECT_TRUE(active_at(1.05));
  EXPECT_TRUE(active_at(0.81)) << "hysteresis";
  EXPECT_FALSE(active_at(0.8));
  EXPECT_FALSE(active_at(0.95));
  EXPECT_TRUE(loop.monitor.is_watching());
}

// A source that is lost now and then once hid that it disagrees.
TEST(Monitor, AFlickeringSourceDoesNotHideThatItDisagrees) {
  Loop loop;
  loop.start();
  loop.sources[2].value = 2.0;
  int ticks = 0;
  for (; loop.monitor.is_watching() && ticks < 100; ++ticks) {
    loop.sources[2].fault = ticks % 4 == 3 ? Fault::input_not_finite : Fault::none;
    (void)loop.step();
  }
  EXPECT_EQ(ticks, 7) << "six valid samples and one without";
  EXPECT_EQ(loop.reason(), MonitorCheck::disagreement);
}

TEST(Monitor, InvalidSourcesAreNotCompared) {
  for (const std::size_t lost : {0U, 1U}) {
    MonitorSettings settings = joint();
    settings.pairs.resize(1);
    Loop loop(settings);
    loop.start();
    loop.sources[lost] = {.value = 50.0, .std_dev = 0.1, .fault = Fault::input_not_finite};
    loop.step_for(400);
    EXPECT_TRUE(loop.monitor.is_watching());
    EXPECT_TRUE(loop.monitor.disagreeing().empty());
  }
}

// docs/simulation/faults.md 9
TEST(Monitor, RecognisesASourceWithTheWrongSign) {
  for (const double sign : {1.0, -1.0}) {
    Loop loop;
    for (Estimate& source : loop.sources) source.value = 0.6 * sign;
    loop.start();
    loop.sources[0].value = -0.6 * sign;
    EXPECT_EQ(loop.ticks_to_stop(), 6);
    EXPECT_EQ(loop.reason(), MonitorCheck::sign);
    EXPECT_EQ(loop.monitor.reason().first, 0);
    EXPECT_EQ(loop.monitor.reason().second, 1);
    EXPECT_EQ(loop.monitor.reason().value, -1.2 * sign);
    EXPECT_EQ(loop.monitor.reason().limit, 1.0);
  }
  EXPECT_EQ(
      describe({.check = MonitorCheck::sign, .second = 1, .value = -1.2, .limit = 1.0}, joint()),
      "the torques of current and gear have opposite signs and differ by 1.2 Nm");
}

TEST(Monitor, ASmallTorqueHasNoWrongSign) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::disagreement) = MonitorAction::off;
  settings.pairs.resize(1);
  Loop loop(settings);
  loop.start();
  const auto active_at = [&](double first, double second) {
    loop.sources[0].value = first;
    loop.sources[1].value = second;
    loop.step_for(6);
    return loop.monitor.active() == bit(MonitorCheck::sign);
  };
  EXPECT_FALSE(active_at(0.5, -0.6)) << "half the threshold";
  EXPECT_FALSE(active_at(-9.0, 0.5));
  EXPECT_FALSE(active_at(0.6, 9.0));
  EXPECT_TRUE(loop.monitor.is_watching());
  loop.sources[0].value = 0.6;
  loop.sources[1].value = -0.6;
  loop.step_for(5);
  EXPECT_TRUE(loop.monitor.is_watching());
  loop.sources[0].value = -0.1;
  loop.step_for(13);
  loop.sources[0].value = 0.6;
  loop.step_for(5);
  EXPECT_TRUE(loop.monitor.is_watching()) << "counted among the last 18";
  EXPECT_EQ(loop.step(), State::stopped);
  EXPECT_EQ(loop.reason(), MonitorCheck::sign);
}

TEST(Monitor, AWrongSignThatHasEndedIsNotReported) {
  MonitorSettings settings = joint();
  settings.actions.fill(MonitorAction::warn);
  Loop loop(settings);
  loop.start();
  loop.sources[0].value = 0.6;
  loop.sources[1].value = -0.6;
  loop.step_for(6);
  EXPECT_NE(loop.monitor.active() & bit(MonitorCheck::sign), 0U);
  loop.sources[0].value = loop.sources[1].value = 0.0;
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active() & bit(MonitorCheck::sign), 0U);
}

TEST(Monitor, CountsTheTorquesThatAreLeft) {
  const auto text = [](double left) {
    return describe({.check = MonitorCheck::redundancy_lost, .value = left, .limit = 2.0}, joint());
  };
  EXPECT_EQ(text(1.0), "1 valid torque is left, at least 2 are needed");
  EXPECT_EQ(text(0.0), "0 valid torques are left, at least 2 are needed");
}

// docs/simulation/faults.md 3
TEST(Monitor, StopsOnASmallDifferenceThatLasts) {
  for (const double sign : {1.0, -1.0}) {
    Loop loop(with_drift());
    loop.start();
    loop.sources[0].value = 0.75 * sign;  // 0.5 ms per tick beyond the allowance
    EXPECT_EQ(loop.ticks_to_stop(), 101);
    EXPECT_EQ(loop.reason(), MonitorCheck::drift);
    EXPECT_EQ(loop.monitor.reason().first, 0);
    EXPECT_EQ(loop.monitor.reason().second, 1);
    EXPECT_NEAR(loop.monitor.reason().value, 0.0505, 1e-9);
    EXPECT_EQ(loop.monitor.reason().limit, 0.0501);
    EXPECT_EQ(loop.text(),
              "a small difference between the torques of current and gear lasts: difference over "
              "threshold less the allowance, summed over time, is 0.0505 s, limit 0.0501 s");
  }
}

TEST(Monitor, AResetBeginsTheSumOfADriftAgain) {
  Loop loop(with_drift());
  loop.start();
  loop.sources[0].value = 0.75;
  loop.step_for(100);
  loop.monitor.reset(loop.t_s);
  loop.sources[0].value = 0.0;
  loop.start();
  loop.sources[0].value = 0.75;
  EXPECT_EQ(loop.ticks_to_stop(), 101);
}

TEST(Monitor, ADifferenceWithinTheAllowanceNeverDrifts) {
  Loop loop(with_drift());
  loop.start();
  loop.sources[0].value = 0.25;
  loop.step_for(10'000);
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, ADifferenceThatChangesItsSideDoesNotDrift) {
  Loop loop(with_drift());
  loop.start();
  for (int n = 0; n < 100; ++n) {
    loop.sources[0].value = n % 2 == 0 ? 0.75 : -0.75;
    loop.step_for(90);
  }
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, TheSumOfADriftIsKeptOverALossAndLimited) {
  MonitorSettings settings = with_drift();
  action(settings, MonitorCheck::drift) = MonitorAction::warn;
  Loop loop(settings);
  loop.start();
  loop.sources[0].value = 0.75;
  loop.step_for(95);
  loop.sources[1].fault = Fault::input_not_finite;
  loop.step_for(100);
  loop.sources[1].fault = Fault::none;
  loop.step_for(7);
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::drift));
  loop.step_for(5000);  // the sum ends at twice its limit
  EXPECT_NEAR(loop.monitor.latest().value, 0.1002, 1e-12);
  loop.sources[0].value = -0.75;
  loop.step_for(49);
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::drift));
  loop.step_for(3);
  EXPECT_EQ(loop.monitor.active(), 0U);
}

// Error bars whose squares are 0: no threshold, and 0 / 0 is not a drift.
TEST(Monitor, ComparesSourcesWithoutAThreshold) {
  MonitorSettings settings = with_drift();
  settings.pairs[0].floor_Nm = 0.0;
  Loop loop(settings);
  for (Estimate& source : loop.sources) source.std_dev = 1e-200;
  loop.start();
  loop.step_for(1000);
  EXPECT_TRUE(loop.monitor.is_watching());
  loop.sources[0].value = 1e-9;
  EXPECT_NE(loop.ticks_to_stop(10), -1);
}

}  // namespace
}  // namespace torsio::test
