#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "safety/monitor_fixture.hpp"

namespace torsio::test {
namespace {

TEST(Monitor, WatchesOnlyAfterTheProofAndWhenItIsArmed) {
  Loop loop;
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  EXPECT_FALSE(loop.monitor.arm(loop.t_s));
  loop.step_for(50);
  EXPECT_EQ(loop.monitor.state(), State::unproven) << "silent for 49 ms";
  EXPECT_FALSE(loop.monitor.arm(loop.t_s));
  loop.step_for(2);
  EXPECT_EQ(loop.monitor.state(), State::ready);
  EXPECT_FALSE(loop.monitor.is_watching());
  loop.step_for(1000);
  EXPECT_EQ(loop.monitor.state(), State::ready) << "armed by the operator only";
  EXPECT_TRUE(loop.monitor.arm(loop.t_s));
  EXPECT_TRUE(loop.monitor.is_watching());
  loop.step_for(1000);
  EXPECT_EQ(loop.monitor.state(), State::watching);
  EXPECT_EQ(loop.monitor.active(), 0U);
  EXPECT_TRUE(loop.monitor.arm(loop.t_s)) << "without effect";
}

TEST(Monitor, AFindingBeforeTheProofDoesNotStopAfterIt) {
  Loop loop;
  loop.signals[0].value = kNaN;
  loop.step_for(10);
  loop.signals[0].value = 0.0;
  loop.start();
  EXPECT_EQ(loop.step(), State::watching);
}

TEST(Monitor, NeedsNoProofOfNoTime) {
  MonitorSettings settings = joint();
  settings.proof_s = 0.0;
  Loop loop(settings);
  EXPECT_EQ(loop.step(), State::ready);
}

// docs/simulation/faults.md 8: an encoder that reports 0 until it has started.
TEST(Monitor, BeginsTheProofAgainAtEveryFindingWarningsIncluded) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::range) = MonitorAction::warn;
  Loop loop(settings);
  loop.signals[2].value = 0.0;
  loop.step_for(500);
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::range));
  loop.signals[2].value = 300.0;
  loop.step_for(50);
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  loop.step_for(2);
  EXPECT_EQ(loop.monitor.state(), State::ready);
  loop.signals[2].value = 0.0;
  loop.step_for(2);
  EXPECT_EQ(loop.monitor.state(), State::unproven) << "no longer ready";
  EXPECT_FALSE(loop.monitor.arm(loop.t_s));
}

TEST(Monitor, StaysStoppedUntilAResetAProofAndAFreshCommand) {
  Loop loop;
  loop.start();
  const double old_s = loop.t_s;
  loop.signals[0].value = kNaN;
  EXPECT_EQ(loop.step(), State::stopped);
  loop.signals[0].value = 0.0;
  loop.step_for(1000);
  EXPECT_EQ(loop.monitor.state(), State::stopped);
  EXPECT_FALSE(loop.monitor.arm(loop.t_s)) << "no command ends a stop";
  loop.monitor.reset(loop.t_s);
  EXPECT_EQ(loop.monitor.state(), State::unproven);
  EXPECT_EQ(loop.reason(), MonitorCheck::not_finite) << "kept for the report";
  EXPECT_FALSE(loop.monitor.arm(loop.t_s + 1.0)) << "unproven";
  const double reset_s = loop.t_s;
  loop.step_for(60);
  EXPECT_EQ(loop.monitor.state(), State::ready);
  EXPECT_FALSE(loop.monitor.arm(old_s)) << "the command of before";
  EXPECT_FALSE(loop.monitor.arm(reset_s)) << "written at the reset, not after";
  EXPECT_FALSE(loop.monitor.arm(kNaN));
  EXPECT_FALSE(loop.monitor.arm(kInfinity));
  EXPECT_TRUE(loop.monitor.arm(reset_s + 1e-6));
}

TEST(Monitor, IsNotArmedAfterAResetAtAnUnknownTime) {
  Loop loop;
  loop.monitor.reset(kNaN);
  loop.step_for(100);
  EXPECT_EQ(loop.monitor.state(), State::ready);
  EXPECT_FALSE(loop.monitor.arm(loop.t_s));
  loop.monitor.reset(loop.t_s);
  loop.step_for(100);
  EXPECT_TRUE(loop.monitor.arm(loop.t_s));
}

TEST(Monitor, IsArmedOnlyWithACommandOfNow) {
  Loop loop;
  loop.step_for(60);
  EXPECT_FALSE(loop.monitor.arm(loop.t_s - 1.001)) << "written long ago";
  EXPECT_FALSE(loop.monitor.arm(loop.t_s + 1.1e-3)) << "from the future";
  EXPECT_FALSE(loop.monitor.arm(-kInfinity));
  EXPECT_TRUE(loop.monitor.arm(loop.t_s + 1e-3)) << "before the next tick";
  Loop young;
  young.step_for(60);
  EXPECT_TRUE(young.monitor.arm(young.t_s - 0.999));
}

// `reset(0.0)` once made every command since time 0 a fresh one.
TEST(Monitor, AResetWithATimeOfAnotherClockCountsFromTheNextTick) {
  for (const double reset_s : {0.0, 1e6}) {
    Loop loop;
    loop.start();
    loop.monitor.stop(loop.t_s);
    const double old_s = loop.t_s;
    loop.monitor.reset(reset_s);
    loop.monitor.reset(reset_s);
    loop.step_for(60);
    ASSERT_EQ(loop.monitor.state(), State::ready);
    EXPECT_FALSE(loop.monitor.arm(old_s)) << reset_s;
    EXPECT_FALSE(loop.monitor.arm(old_s + kPeriod_s)) << "of the first tick";
    EXPECT_TRUE(loop.monitor.arm(old_s + 1.5 * kPeriod_s));
  }
  Loop restarted;  // the clock begins again
  restarted.start();
  restarted.monitor.reset(restarted.t_s);
  restarted.t_s = 0.0;
  restarted.step_for(60);
  EXPECT_TRUE(restarted.monitor.arm(restarted.t_s));
}

TEST(Monitor, AResetEmptiesWhatWasCounted) {
  Loop loop;
  loop.start();
  loop.sources[0].value = 5.0;
  loop.signals[1].value = 1.0;  // faster than it can: one is passed over
  loop.step_for(5);
  EXPECT_EQ(loop.monitor.state(), State::stopped) << "the second one is not";
  loop.monitor.reset(loop.t_s);
  EXPECT_EQ(loop.monitor.active(), 0U);
  EXPECT_TRUE(loop.monitor.disagreeing().empty());
  loop.t_s = 5.0;  // and of another clock
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), 0U) << "no rate, no period, no persistence from before";
  loop.step_for(4);
  EXPECT_EQ(loop.monitor.active(), 0U);
  (void)loop.step();
  EXPECT_EQ(loop.monitor.active(), bit(MonitorCheck::disagreement));
}

TEST(Monitor, AResetBeginsEveryCountAgain) {
  Loop loop;
  loop.start();
  loop.sources[1].fault = Fault::input_not_finite;
  loop.step_for(400);
  loop.monitor.reset(loop.t_s);
  loop.step_for(400);
  EXPECT_EQ(loop.monitor.latest().action, MonitorAction::warn) << "400 ms, not 800";
  loop.sources[1].fault = Fault::none;
  loop.sources[0].value = 9.0;
  loop.step_for(10);
  EXPECT_EQ(loop.monitor.disagreeing().size(), 2U);
  loop.monitor.reset(loop.t_s);
  EXPECT_TRUE(loop.monitor.disagreeing().empty());
  loop.sources[0].value = 0.0;
  loop.start();
  loop.step_for(100);
  loop.monitor.reset(loop.t_s);
  EXPECT_EQ(loop.step(), State::unproven) << "the proof too";
  (void)loop.step(1.6e-3);
  (void)loop.step(1.6e-3);
  loop.monitor.reset(loop.t_s);
  (void)loop.step();
  (void)loop.step(1.6e-3);
  (void)loop.step(1.6e-3);
  EXPECT_EQ(loop.monitor.active(), 0U) << "two late ticks, not four";
}

TEST(Monitor, StopsFromOutsideInEveryState) {
  Loop loop;
  loop.monitor.stop(1.5);
  EXPECT_EQ(loop.monitor.state(), State::stopped);
  EXPECT_EQ(loop.monitor.reason().action, MonitorAction::off) << "no finding";
  EXPECT_EQ(loop.reason(), MonitorCheck::requested);
  EXPECT_EQ(loop.text(), "a stop was requested");
  EXPECT_EQ(loop.monitor.latest().check, MonitorCheck::requested) << "nothing was found yet";
  EXPECT_EQ(loop.monitor.reason().t_s, 1.5);
  loop.monitor.stop(2.5);
  EXPECT_EQ(loop.monitor.reason().t_s, 1.5) << "the first stop is the reason";
  loop.monitor.reset(loop.t_s);
  loop.start();
  loop.monitor.stop(3.5);
  EXPECT_FALSE(loop.monitor.is_watching());
  loop.step_for(100);
  EXPECT_EQ(loop.monitor.state(), State::stopped);
  EXPECT_EQ(loop.monitor.reason().t_s, 3.5);
}

TEST(Monitor, KeepsTheFirstFindingAsReasonAndTheLatestApart) {
  Loop loop;
  loop.start();
  loop.signals[1].value = kNaN;
  loop.signals[2].value = kInfinity;
  EXPECT_EQ(loop.step(), State::stopped);
  EXPECT_EQ(loop.monitor.reason().first, 1);
  EXPECT_EQ(loop.monitor.reason().second, 1);
  EXPECT_EQ(loop.monitor.reason().t_s, loop.t_s);
  EXPECT_EQ(loop.monitor.reason().action, MonitorAction::stop);
  EXPECT_EQ(loop.monitor.latest().first, 2);
  const double stopped_s = loop.t_s;
  loop.step_for(3);
  EXPECT_EQ(loop.monitor.reason().t_s, stopped_s);
  EXPECT_EQ(loop.monitor.latest().t_s, loop.t_s);
}

TEST(Monitor, ListsTheFindingsOfATick) {
  Loop loop;
  EXPECT_TRUE(loop.monitor.findings().empty());
  loop.start();
  loop.signals[1].value = kNaN;
  loop.signals[2].age_s = kNaN;
  loop.sources[2].fault = Fault::input_not_finite;
  (void)loop.step();
  ASSERT_EQ(loop.monitor.findings().size(), 3U);
  EXPECT_EQ(loop.monitor.findings()[0].check, MonitorCheck::not_finite);
  EXPECT_EQ(loop.monitor.findings()[1].check, MonitorCheck::stale);
  EXPECT_EQ(loop.monitor.findings()[2].check, MonitorCheck::source_lost);
  EXPECT_EQ(loop.monitor.findings()[2].first, 2);
  EXPECT_EQ(loop.monitor.findings()[2].t_s, loop.t_s);
  loop.monitor.reset(loop.t_s);
  EXPECT_TRUE(loop.monitor.findings().empty());
  // 28 pairs have more findings than are kept.
  MonitorSettings settings;
  for (char name = 'a'; settings.sources.size() < Monitor::kMaxSources; ++name)
    settings.sources.emplace_back(1, name);
  for (std::uint8_t i = 0; i < Monitor::kMaxSources; ++i)
    for (std::uint8_t j = 0; j < i; ++j) settings.pairs.push_back({.first = i, .second = j});
  settings.persistence_s = 0.0;
  Loop many(settings);
  for (std::size_t i = 0; i < many.sources.size(); ++i)
    many.sources[i].value = (i % 2 == 0 ? 10.0 : -10.0) * static_cast<double>(i + 1);
  (void)many.step();
  EXPECT_EQ(many.monitor.findings().size(), Monitor::kMaxFindings);
}

TEST(Monitor, EachCheckIsOffWarnsOrStops) {
  for (const MonitorAction wanted :
       {MonitorAction::off, MonitorAction::warn, MonitorAction::stop}) {
    MonitorSettings settings = joint();
    action(settings, MonitorCheck::not_finite) = wanted;
    Loop loop(settings);
    loop.start();
    loop.signals[2].value = kNaN;
    (void)loop.step();
    EXPECT_EQ(loop.monitor.is_watching(), wanted != MonitorAction::stop);
    EXPECT_EQ(loop.monitor.active(),
              wanted == MonitorAction::off ? 0U : bit(MonitorCheck::not_finite));
    EXPECT_EQ(loop.monitor.latest().action, wanted);
  }
}

TEST(Monitor, AWarningBeforeAStopInTheSameTickIsNotItsReason) {
  MonitorSettings settings = joint();
  action(settings, MonitorCheck::not_finite) = MonitorAction::warn;
  Loop loop(settings);
  loop.start();
  loop.signals[0].value = kNaN;
  loop.signals[1].age_s = 1.0;
  EXPECT_EQ(loop.step(), State::stopped);
  EXPECT_EQ(loop.reason(), MonitorCheck::stale);
}

TEST(Monitor, TheDefaultsStopExceptForALossAndNovelty) {
  const auto actions = MonitorSettings::default_actions();
  for (std::size_t check = 0; check < kMonitorChecks; ++check) {
    const bool warns = check == static_cast<std::size_t>(MonitorCheck::source_lost) ||
                       check == static_cast<std::size_t>(MonitorCheck::novelty);
    EXPECT_EQ(actions[check], warns ? MonitorAction::warn : MonitorAction::stop) << check;
  }
}

TEST(Monitor, StopsOnAnotherNumberOfInputsWhateverTheActions) {
  MonitorSettings settings = joint();
  settings.actions.fill(MonitorAction::off);
  for (const bool signals_too : {false, true}) {
    Loop loop(settings);
    loop.start();
    if (signals_too)
      loop.signals.pop_back();
    else
      loop.sources.pop_back();
    EXPECT_EQ(loop.step(), State::stopped);
    EXPECT_EQ(loop.reason(), MonitorCheck::not_finite);
    EXPECT_EQ(loop.text(), "the monitor was given 5 sources and signals, expected 6");
  }
}

}  // namespace
}  // namespace torsio::test
