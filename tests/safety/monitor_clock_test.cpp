#include <gtest/gtest.h>

#include "safety/monitor_fixture.hpp"

namespace torsio::test {
namespace {

// docs/simulation/faults.md 27
TEST(Monitor, StopsWhereTheClockPausesRunsBackwardsOrIsNaN) {
  for (const double period_s : {0.0, -1e-3, -50.0, kNaN, kInfinity}) {
    Loop loop;
    loop.start();
    EXPECT_EQ(loop.step(period_s), State::stopped) << period_s;
    EXPECT_EQ(loop.reason(), MonitorCheck::period);
  }
}

// docs/simulation/faults.md 28
TEST(Monitor, PassesOverALateTickAndStopsAtTheThirdInARow) {
  Loop loop;
  loop.start();
  for (int n = 0; n < 100; ++n) (void)loop.step(n % 3 == 2 ? 1.4e-3 : 1.7e-3);
  EXPECT_TRUE(loop.monitor.is_watching());
  loop.step_for(1);
  (void)loop.step(1.6e-3);
  (void)loop.step(1.6e-3);
  EXPECT_TRUE(loop.monitor.is_watching());
  EXPECT_EQ(loop.step(1.6e-3), State::stopped);
  EXPECT_EQ(loop.reason(), MonitorCheck::period);
  EXPECT_EQ(loop.text(), "the loop was called after 0.0016 s, limit 0.0015 s");
  EXPECT_EQ(loop.monitor.latest().first, 0);
}

TEST(Monitor, StopsAtOneTickThatIsAsLateAsThree) {
  Loop loop;
  loop.start();
  EXPECT_EQ(loop.step(3.4e-3), State::watching);
  loop.step_for(5);
  EXPECT_EQ(loop.step(3.6e-3), State::stopped);
  EXPECT_EQ(loop.text(), "the loop was called after 0.0036 s, limit 0.0035 s");
}

// Periods of 2^-10 s, so that nothing is rounded.
TEST(Monitor, TheLimitsOfThePeriodAreAllowed) {
  constexpr double kExact_s = 0x1p-10;
  MonitorSettings settings = joint();
  settings.sample_period_s = kExact_s;
  Loop loop(settings);
  loop.t_s = 0.0;
  for (int n = 0; n < 100; ++n) (void)loop.step(1.5 * kExact_s);
  EXPECT_EQ(loop.monitor.active(), 0U);
  (void)loop.step(3.5 * kExact_s);
  EXPECT_EQ(loop.monitor.active(), 0U) << "one late tick";
  (void)loop.step(3.5 * kExact_s);
  (void)loop.step(3.5 * kExact_s);
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::period)) << "three";
  EXPECT_EQ(loop.monitor.latest().limit, 1.5 * kExact_s);
  (void)loop.step(kExact_s);
  (void)loop.step(3.625 * kExact_s);
  EXPECT_EQ(loop.monitor.latest().limit, 3.5 * kExact_s);
}

TEST(Monitor, TheLimitOfADriftIsAllowed) {
  MonitorSettings settings = with_drift();
  settings.sample_period_s = 0x1p-10;
  settings.pairs[0].drift_limit_s = 0x1p-9;  // eight times what one tick adds
  settings.persistence_s = 1.0;
  action(settings, MonitorCheck::period) = MonitorAction::off;
  Loop loop(settings);
  loop.sources[0].value = 0.5;
  loop.step_for(8);
  EXPECT_EQ(loop.monitor.active(), 0U);
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::drift));
}

TEST(Monitor, AFirstTickWithoutATimeIsNoFirstTick) {
  Loop loop;
  const double begin_s = loop.t_s;
  loop.t_s = kNaN;
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::period));
  loop.t_s = begin_s;
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), 0U);
}

}  // namespace
}  // namespace torsio::test
