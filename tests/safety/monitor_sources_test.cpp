#include <gtest/gtest.h>

#include <cstddef>

#include "safety/monitor_fixture.hpp"

namespace torsio::test {
namespace {

TEST(Monitor, ContinuesWithoutOneOfThreeSourcesForAWhile) {
  for (const Estimate& lost :
       {Estimate{.std_dev = 0.1, .fault = Fault::input_not_finite},
        Estimate{.std_dev = 0.1, .fault = Fault::input_count_wrong},
        Estimate{.std_dev = 0.1, .fault = Fault::zero_not_set},
        Estimate{.value = kNaN, .std_dev = 0.1}, Estimate{.value = -kInfinity, .std_dev = 0.1}}) {
    Loop loop;
    loop.start();
    loop.sources[2] = lost;
    (void)loop.step();
    EXPECT_TRUE(loop.monitor.is_watching());
    EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::source_lost));
    EXPECT_EQ(loop.monitor.latest().action, MonitorAction::warn);
    EXPECT_EQ(loop.ticks_to_stop(), 500) << "501 ms are more than 0.5 s";
    EXPECT_EQ(loop.reason(), MonitorCheck::source_lost);
    EXPECT_EQ(loop.monitor.reason().first, 2);
    EXPECT_EQ(loop.monitor.reason().second, 2);
    EXPECT_EQ(loop.monitor.reason().limit, 0.5);
    EXPECT_EQ(loop.text(), "an input of the torque of spring has not been measured for 0.501 s");
  }
}

TEST(Monitor, ASourceThatWarmsUpIsNotUsedAndNoFinding) {
  Loop loop;
  loop.start();
  loop.sources[2].fault = Fault::warming_up;
  loop.sources[2].value = 1000.0;
  loop.step_for(2000);
  EXPECT_TRUE(loop.monitor.is_watching());
  EXPECT_EQ(loop.monitor.active(), 0U);
  loop.sources[1].fault = Fault::warming_up;
  EXPECT_EQ(loop.ticks_to_stop(), 1) << "fewer than two are left";
}

// A monitor was once armed before a source could be compared, and stopped after that.
TEST(Monitor, IsNotReadyWhileASourceWarmsUp) {
  Loop loop;
  loop.sources[2].fault = Fault::warming_up;
  loop.step_for(2000);
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  EXPECT_EQ(loop.monitor.active(), 0U);
  loop.sources[2].fault = Fault::none;
  loop.start();
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, ALossThatEndsIsCompensatedByFourTimesItsLength) {
  const auto stops = [](int good) {
    Loop loop;
    loop.start();
    for (int n = 0; n < 10; ++n) {
      loop.sources[2].fault = Fault::input_not_finite;
      loop.step_for(400);
      loop.sources[2].fault = Fault::none;
      loop.step_for(good);
    }
    return !loop.monitor.is_watching();
  };
  EXPECT_TRUE(stops(1)) << "one good sample ends no loss";
  EXPECT_TRUE(stops(800));
  EXPECT_FALSE(stops(1600));
}

TEST(Monitor, ALossThatLastedForLongIsCompensatedAsSoonAsAShorterOne) {
  Loop loop;
  loop.sources[2].fault = Fault::input_not_finite;
  loop.step_for(5000);
  EXPECT_EQ(loop.monitor.latest().action, MonitorAction::stop) << "not armed: nothing to stop";
  loop.sources[2].fault = Fault::none;
  loop.step_for(2004);
  loop.start();
  loop.sources[2].fault = Fault::input_not_finite;
  EXPECT_EQ(loop.ticks_to_stop(), 501);
}

// A source that warmed up for ever was once no finding: its pairs remained without a comparison.
TEST(Monitor, ASourceMayNotWarmUpForEver) {
  MonitorSettings settings = joint();
  settings.longest_warm_up_s = 1.0;
  Loop loop(settings);
  loop.start();
  loop.sources[2].fault = Fault::warming_up;
  EXPECT_EQ(loop.ticks_to_stop(), 1001);
  EXPECT_EQ(loop.reason(), MonitorCheck::source_fault);
  EXPECT_EQ(loop.monitor.reason().first, 2);
  EXPECT_EQ(loop.monitor.reason().limit, 1.0);
  Loop unarmed(settings);
  unarmed.sources[2].fault = Fault::warming_up;
  unarmed.step_for(1100);
  EXPECT_EQ(unarmed.monitor.state(), State::unproven);
  // Warm-up without a number is a loss, which has a limit of its own.
  Loop lost(settings);
  lost.start();
  lost.sources[2] = {.value = kNaN, .std_dev = 0.1, .fault = Fault::warming_up};
  EXPECT_EQ(lost.ticks_to_stop(), 501);
  EXPECT_EQ(lost.reason(), MonitorCheck::source_lost);
}

TEST(Monitor, ALossCanBeOffOrStopAtOnce) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::source_lost) = MonitorAction::off;
  Loop off(settings);
  off.start();
  off.sources[0].fault = Fault::input_not_finite;
  EXPECT_EQ(off.ticks_to_stop(2000), -1);
  EXPECT_EQ(off.monitor.active(), 0U);
  action(settings, MonitorCheck::source_lost) = MonitorAction::stop;
  Loop stop(settings);
  stop.start();
  stop.sources[0].fault = Fault::input_not_finite;
  EXPECT_EQ(stop.ticks_to_stop(), 1);
}

TEST(Monitor, StopsWithOneValidSourceLeft) {
  for (const Estimate& invalid : {Estimate{.std_dev = 0.1, .fault = Fault::input_not_finite},
                                  Estimate{.std_dev = 0.1, .fault = Fault::warming_up},
                                  Estimate{.value = kNaN, .std_dev = 0.1}}) {
    Loop loop;
    loop.start();
    loop.sources[0] = invalid;
    loop.step_for(3);
    EXPECT_TRUE(loop.monitor.is_watching());
    loop.sources[1] = invalid;
    EXPECT_EQ(loop.ticks_to_stop(), 1);
    EXPECT_EQ(loop.reason(), MonitorCheck::redundancy_lost);
    EXPECT_EQ(loop.text(), "1 valid torque is left, at least 2 are needed");
  }
}

// A spike that is small enough for a signal may be outside the range of two sources for some ticks.
TEST(Monitor, TwoSourcesMayBeOutsideTheirRangeForAsLongAsOne) {
  Loop loop;
  loop.start();
  loop.sources[0].fault = loop.sources[1].fault = Fault::outside_training_range;
  EXPECT_EQ(loop.ticks_to_stop(), 16);
  EXPECT_EQ(loop.reason(), MonitorCheck::source_fault);
}

TEST(Monitor, TwoSourcesHaveNoneToLose) {
  MonitorSettings settings = joint();
  settings.sources = {"gear", "spring"};
  settings.pairs.resize(1);
  Loop loop(settings);
  loop.start();
  loop.sources[0].fault = Fault::input_not_finite;
  EXPECT_EQ(loop.ticks_to_stop(), 1);
  EXPECT_EQ(loop.reason(), MonitorCheck::redundancy_lost);
}

TEST(Monitor, ASingleSourceHasNoRedundancyToLose) {
  MonitorSettings settings = joint();
  settings.sources = {"spring"};
  settings.pairs = {};
  Loop loop(settings);
  loop.start();
  loop.sources[0].fault = Fault::input_not_finite;
  loop.step_for(100);
  EXPECT_TRUE(loop.monitor.is_watching());
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::source_lost));
}

TEST(Monitor, StopsOnASourceWhoseModelFailsAgainAndAgain) {
  const auto stops = [](int faulty_of_five) {
    Loop loop;
    loop.start();
    for (int n = 0; n < 500 && loop.monitor.is_watching(); ++n) {
      loop.sources[0] = {.std_dev = 0.1};
      if (n % 5 < faulty_of_five) loop.sources[0].fault = Fault::outside_training_range;
      (void)loop.step();
    }
    return !loop.monitor.is_watching();
  };
  EXPECT_FALSE(stops(1));
  EXPECT_TRUE(stops(2));
  EXPECT_TRUE(stops(3));
}

TEST(Monitor, AFaultThatLastedForLongIsCompensatedAsSoonAsAShorterOne) {
  MonitorSettings settings = joint();
  settings.actions[static_cast<std::size_t>(MonitorCheck::source_fault)] = MonitorAction::warn;
  Loop loop(settings);
  loop.start();
  const auto warns_after = [&] {
    loop.sources[0].fault = Fault::outside_training_range;
    for (int ticks = 1; ticks < 100; ++ticks) {
      (void)loop.step();
      if ((loop.monitor.active() & bit(MonitorCheck::source_fault)) != 0) return ticks;
    }
    return 0;
  };
  EXPECT_EQ(warns_after(), 16);
  loop.step_for(1000);
  loop.sources[0].fault = Fault::none;
  loop.step_for(64);
  EXPECT_EQ(warns_after(), 16);
  EXPECT_TRUE(loop.monitor.is_watching());
}

TEST(Monitor, IsNotReadyWhileErrorBarsMakeAThresholdTooLarge) {
  MonitorSettings settings = joint();
  for (PairLimits& pair : settings.pairs) {
    pair.ceiling_Nm = kInfinity;
    pair.largest_armed_Nm = 3.0;
  }
  Loop loop(settings);
  loop.sources[1].std_dev = 5.0;
  loop.step_for(200);
  EXPECT_EQ(loop.monitor.state(), Monitor::State::unproven);
  EXPECT_EQ(loop.monitor.active(), 0U);
  loop.sources[1].std_dev = 0.1;
  loop.start();
  // Once it watches, a wider error bar does not end that.
  loop.sources[1].std_dev = 5.0;
  loop.step_for(200);
  EXPECT_TRUE(loop.monitor.is_watching());
}

// The ceiling limits the threshold in use, and does not hide that the error bars are too wide to
// begin.
TEST(Monitor, ACeilingDoesNotMakeItReady) {
  MonitorSettings settings = joint();
  for (PairLimits& pair : settings.pairs) {
    pair.ceiling_Nm = 2.0;
    pair.largest_armed_Nm = 3.0;
  }
  Loop loop(settings);
  loop.sources[1].std_dev = 5.0;
  loop.step_for(200);
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  EXPECT_TRUE(loop.monitor.is_threshold_too_large());
  EXPECT_EQ(loop.monitor.active(), 0U);
  loop.sources[1].std_dev = 0.1;
  loop.start();
  EXPECT_FALSE(loop.monitor.is_threshold_too_large());
  loop.sources[1].std_dev = 5.0;
  loop.sources[1].value = 2.1;
  EXPECT_EQ(loop.ticks_to_stop(), 6);
  EXPECT_EQ(loop.monitor.reason().limit, 2.0);
}

// docs/simulation/faults.md 14
TEST(Monitor, StopsOnASourceWhoseModelFailsForLong) {
  for (const Estimate& faulty :
       {Estimate{.std_dev = 0.1, .fault = Fault::outside_training_range},
        Estimate{.std_dev = 0.1, .fault = Fault::model_not_finite},
        Estimate{.std_dev = 0.1, .fault = Fault::recovering}, Estimate{.std_dev = kNaN},
        Estimate{.std_dev = kInfinity}, Estimate{.std_dev = 0.0}, Estimate{.std_dev = -1.0}}) {
    Loop loop;
    loop.start();
    loop.sources[0] = faulty;
    loop.step_for(15);
    ASSERT_TRUE(loop.monitor.is_watching());
    loop.sources[0] = {.std_dev = 0.1};
    loop.step_for(60);
    loop.sources[0] = faulty;
    EXPECT_EQ(loop.ticks_to_stop(), 16)
        << "four samples without a fault compensate for one with it";
    EXPECT_EQ(loop.reason(), MonitorCheck::source_fault);
    EXPECT_EQ(loop.monitor.reason().first, 0);
    EXPECT_EQ(loop.monitor.reason().second, 0);
    EXPECT_EQ(
        loop.text(),
        "the torque of current has been without a valid model or error bar for 0.016 s, limit "
        "0.015 s");
  }
}

TEST(Monitor, AFaultOfAnotherSourceIsOfThatSource) {
  Loop loop;
  loop.start();
  loop.sources[1].fault = Fault::diverged;
  EXPECT_EQ(loop.ticks_to_stop(), 16);
  EXPECT_EQ(loop.monitor.reason().first, 1);
  EXPECT_EQ(loop.monitor.reason().second, 1);
}

TEST(Monitor, WarnsOfNoveltyThatLasts) {
  MonitorSettings settings = joint();
  settings.largest_novelty = 3.0;
  Loop loop(settings);
  loop.start();
  loop.sources[1].novelty = 3.0;
  loop.step_for(100);
  EXPECT_EQ(loop.monitor.active(), 0U);
  loop.sources[1].novelty = 3.5;
  loop.step_for(5);
  EXPECT_EQ(loop.monitor.active(), 0U);
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::novelty));
  EXPECT_TRUE(loop.monitor.is_watching());
  EXPECT_EQ(loop.monitor.latest().first, 1);
  EXPECT_EQ(loop.monitor.latest().second, 1);
  EXPECT_EQ(describe(loop.monitor.latest(), settings),
            "the inputs of the torque of gear have a novelty of 3.5, limit 3");
  loop.sources[1].novelty = kNaN;
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), 0U) << "unknown";
}

}  // namespace
}  // namespace torsio::test
