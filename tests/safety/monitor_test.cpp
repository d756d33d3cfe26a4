#include "torsio/safety/monitor.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using State = Monitor::State;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPeriod_s = 1e-3;

/// Three sources, a motor angle and a gear angle that moves with it, a temperature.
MonitorSettings joint() {
  return {
      .sources = {"current", "gear", "spring"},
      .signals = {{.name = "motor_angle_rad", .largest_rate = 1000.0},
                  {.name = "gear_angle_rad",
                   .lowest = -3.0,
                   .highest = 3.0,
                   .largest_rate = 10.0,
                   .longest_age_s = 0.01,
                   .moves_with = "motor_angle_rad",
                   .largest_hidden_travel = 1.5},
                  {.name = "motor_temperature_K", .lowest = 233.0, .highest = 393.0}},
      .pairs = {{.first = 0, .second = 1, .floor_Nm = 1.0, .ceiling_Nm = 4.0},
                {.first = 0, .second = 2, .floor_Nm = 1.0, .ceiling_Nm = 4.0},
                {.first = 1, .second = 2, .floor_Nm = 1.0, .ceiling_Nm = 4.0}},
      .correlation = {},
  };
}

MonitorAction& action(MonitorSettings& settings, MonitorCheck check) {
  return settings.actions[static_cast<std::size_t>(check)];
}

std::uint32_t bit(MonitorCheck check) { return std::uint32_t{1} << static_cast<unsigned>(check); }

/// A loop at 1 kHz with sound inputs, which a test changes.
struct Loop {
  explicit Loop(const MonitorSettings& settings = joint())
      : monitor(settings),
        sources(settings.sources.size(), Estimate{.value = 0.0, .std_dev = 0.1}),
        signals(settings.signals.size()) {
    for (SignalSample& sample : signals) sample.value = 0.0;
    if (signals.size() > 2) signals[2].value = 300.0;
  }

  State step(double period_s = kPeriod_s) {
    t_s += period_s;
    return monitor.step(t_s, sources, signals);
  }
  void step_for(int ticks) {
    for (int n = 0; n < ticks; ++n) (void)step();
  }
  /// Proven, armed and watching.
  void start() {
    step_for(60);
    ASSERT_EQ(monitor.state(), State::ready);
    ASSERT_TRUE(monitor.arm(t_s));
  }
  /// @returns ticks until it is stopped, the one that stops included; -1 if it does not within
  /// `most`
  int ticks_to_stop(int most = 5000) {
    for (int n = 1; n <= most; ++n)
      if (step() == State::stopped) return n;
    return -1;
  }
  [[nodiscard]] MonitorCheck reason() const { return monitor.reason().check; }
  [[nodiscard]] std::string text() const { return describe(monitor.reason(), monitor.settings()); }

  Monitor monitor;
  std::vector<Estimate> sources;
  std::vector<SignalSample> signals;
  double t_s = 100.0;
};

// --- states -------------------------------------------------------------------------------------

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

// docs/faults.md 8: an encoder that reports 0 until it has started.
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

// --- signals ------------------------------------------------------------------------------------

TEST(Monitor, StopsAtOnceOnASignalThatIsNotFinite) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    Loop loop;
    loop.start();
    loop.signals[0].value = bad;
    EXPECT_EQ(loop.ticks_to_stop(), 1);
    EXPECT_EQ(loop.text(), "motor_angle_rad is not a finite number");
  }
}

// docs/faults.md 11, 12: the age is that of the source.
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

// docs/faults.md 6: a deflection is a signal like any other.
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

// docs/faults.md 10
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

// docs/faults.md 7
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

// docs/faults.md 1
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

// --- sources ------------------------------------------------------------------------------------

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

// docs/faults.md 14
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

// --- pairs --------------------------------------------------------------------------------------

// docs/faults.md 2: within 20 ms, without a vote.
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

// docs/faults.md 9
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

MonitorSettings with_drift() {
  MonitorSettings settings = joint();
  settings.pairs = {
      {.first = 0, .second = 1, .floor_Nm = 1.0, .drift_allowance = 0.25, .drift_limit_s = 0.0501}};
  return settings;
}

// docs/faults.md 3
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

// --- the clock ----------------------------------------------------------------------------------

// docs/faults.md 27
TEST(Monitor, StopsWhereTheClockPausesRunsBackwardsOrIsNaN) {
  for (const double period_s : {0.0, -1e-3, -50.0, kNaN, kInfinity}) {
    Loop loop;
    loop.start();
    EXPECT_EQ(loop.step(period_s), State::stopped) << period_s;
    EXPECT_EQ(loop.reason(), MonitorCheck::period);
  }
}

// docs/faults.md 28
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

// --- texts, settings ----------------------------------------------------------------------------

TEST(Monitor, NamesItsChecksActionsAndStates) {
  const std::vector<std::string> checks = {
      "disagreement", "drift", "sign",  "source_lost", "source_fault", "redundancy_lost", "novelty",
      "not_finite",   "stale", "range", "rate",        "wrap",         "frozen",          "period"};
  ASSERT_EQ(checks.size(), kMonitorChecks);
  for (std::size_t i = 0; i < kMonitorChecks; ++i)
    EXPECT_EQ(name(static_cast<MonitorCheck>(i)), checks[i]);
  EXPECT_EQ(name(MonitorCheck::requested), "requested");
  EXPECT_EQ(name(static_cast<MonitorCheck>(kMonitorChecks + 1)), "unknown");
  EXPECT_EQ(name(MonitorAction::off), "off");
  EXPECT_EQ(name(MonitorAction::warn), "warn");
  EXPECT_EQ(name(MonitorAction::stop), "stop");
  EXPECT_EQ(name(static_cast<MonitorAction>(9)), "unknown");
  EXPECT_EQ(name(State::unproven), "unproven");
  EXPECT_EQ(name(State::ready), "ready");
  EXPECT_EQ(name(State::watching), "watching");
  EXPECT_EQ(name(State::stopped), "stopped");
  EXPECT_EQ(name(static_cast<State>(9)), "unknown");
}

TEST(Monitor, DescribesAnEventOfOtherSettings) {
  EXPECT_EQ(describe({.check = MonitorCheck::not_finite, .first = 3, .value = kNaN}, joint()),
            "? is not a finite number");
  EXPECT_EQ(describe({.check = MonitorCheck::sign, .first = 3, .second = 4, .value = 1.0}, joint()),
            "the torques of ? and ? have opposite signs and differ by 1 Nm");
  EXPECT_EQ(describe({.check = static_cast<MonitorCheck>(kMonitorChecks + 1)}, joint()), "");
}

std::string refusal(const std::function<void(MonitorSettings&)>& change) {
  MonitorSettings settings = joint();
  change(settings);
  return test::error_message([&] { Monitor{settings}; });
}

TEST(Monitor, RefusesNamesThatAreNotTheirOwn) {
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& s) { s.sources[1] = "current"; }),
            "monitor: sources: expected names of their own, found 'current'");
  EXPECT_EQ(refusal([](auto& s) { s.sources[1] = ""; }),
            "monitor: sources: expected names of their own, found ''");
  EXPECT_EQ(refusal([](auto& s) { s.signals[2].name = "gear_angle_rad"; }),
            "monitor: signals: expected names of their own, found 'gear_angle_rad'");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.sources.size() < 9; ++c) s.sources.emplace_back(1, c);
            }),
            "monitor: sources: expected at most 8, found 9");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.sources.size() < 8; ++c) s.sources.emplace_back(1, c);
              for (char c = 'a'; s.signals.size() < 16; ++c)
                s.signals.push_back({.name = std::string(1, c)});
            }),
            "");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.signals.size() < 17; ++c)
                s.signals.push_back({.name = std::string(1, c)});
            }),
            "monitor: signals: expected at most 16, found 17");
}

TEST(Monitor, RefusesSignalsThatAreNotValid) {
  const auto of_gear = [](const std::function<void(MonitoredSignal&)>& change) {
    return refusal([&](MonitorSettings& settings) { change(settings.signals[1]); });
  };
  EXPECT_EQ(of_gear([](auto& s) { s.lowest = 3.0; }),
            "monitor: gear_angle_rad: expected a lowest value below the highest, found 3");
  EXPECT_NE(of_gear([](auto& s) { s.highest = kNaN; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.largest_rate = 0.0; }),
            "monitor: gear_angle_rad: largest_rate: expected above 0, found 0");
  EXPECT_NE(of_gear([](auto& s) { s.largest_rate = kNaN; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.longest_age_s = 0.0; }),
            "monitor: gear_angle_rad: longest_age_s: expected above 0, found 0");
  EXPECT_EQ(of_gear([](auto& s) { s.turn = -1.0; }),
            "monitor: gear_angle_rad: turn: expected 0 or the turn of its encoder, found -1");
  EXPECT_NE(of_gear([](auto& s) { s.turn = kInfinity; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.largest_hidden_travel = 0.0; }),
            "monitor: gear_angle_rad: largest_hidden_travel: expected above 0, found 0");
  const std::string no_companion =
      "monitor: gear_angle_rad: moves_with: expected another signal, found ";
  EXPECT_EQ(of_gear([](auto& s) { s.moves_with = "oil_K"; }), no_companion + "'oil_K'");
  EXPECT_EQ(of_gear([](auto& s) { s.moves_with = "gear_angle_rad"; }),
            no_companion + "'gear_angle_rad'");
}

TEST(Monitor, RefusesPairsThatAreNotValid) {
  const auto of_pair = [](const std::function<void(PairLimits&)>& change) {
    return refusal([&](MonitorSettings& settings) { change(settings.pairs[1]); });
  };
  EXPECT_EQ(of_pair([](auto& p) { p.first = 3; }),
            "monitor: pair 3, 2: expected two different sources of 3, found pair 3, 2");
  EXPECT_NE(of_pair([](auto& p) { p.second = 3; }), "");
  EXPECT_NE(of_pair([](auto& p) { p.second = 0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.factor = 0.0; }),
            "monitor: pair 0, 2: factor: expected a positive number, found 0");
  EXPECT_NE(of_pair([](auto& p) { p.factor = kInfinity; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.ceiling_Nm = p.floor_Nm = 0.0; }),
            "monitor: pair 0, 2: ceiling_Nm: expected above 0, found 0");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = -0.5; }),
            "monitor: pair 0, 2: floor_Nm: expected 0 to the ceiling, found -0.5");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = 4.5; }),
            "monitor: pair 0, 2: floor_Nm: expected 0 to the ceiling, found 4.5");
  EXPECT_EQ(of_pair([](auto& p) { p.largest_armed_Nm = 0.5; }),
            "monitor: pair 0, 2: largest_armed_Nm: expected at least floor_Nm, found 0.5");
  EXPECT_EQ(of_pair([](auto& p) { p.largest_armed_Nm = p.floor_Nm; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = p.ceiling_Nm; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = 0.0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.drift_allowance = 0.0; }),
            "monitor: pair 0, 2: drift_allowance: expected between 0 and 1, found 0");
  EXPECT_NE(of_pair([](auto& p) { p.drift_allowance = 1.0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.drift_limit_s = 0.0; }),
            "monitor: pair 0, 2: drift_limit_s: expected above 0, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.pairs.resize(28, s.pairs[0]); }), "");
  EXPECT_EQ(refusal([](auto& s) { s.pairs.resize(29, s.pairs[0]); }),
            "monitor: pairs: expected at most 28, found 29");
  EXPECT_EQ(refusal([](auto& s) { s.correlation = {1.0}; }),
            "monitor: expected a correlation of 3 x 3 numbers, found 1");
}

TEST(Monitor, RefusesTimesThatAreNotValid) {
  const auto check = [](double MonitorSettings::*field, const std::string& text,
                        std::vector<double> good, std::vector<double> bad) {
    bad.push_back(kNaN);
    for (const double value : good)
      EXPECT_EQ(refusal([&](auto& s) { s.*field = value; }), "") << text << value;
    for (const double value : bad)
      EXPECT_TRUE(refusal([&](auto& s) { s.*field = value; }).starts_with("monitor: " + text))
          << text << value << refusal([&](auto& s) { s.*field = value; });
  };
  using S = MonitorSettings;
  check(&S::sample_period_s, "sample_period_s: expected above 0, at most 1, found ", {1e-4, 1.0},
        {0.0, -1.0, 1.1});
  check(&S::persistence_s,
        "persistence_s: expected 0 or more, and at most a million sample periods, found ",
        {0.0, 1.0}, {-1e-9, kInfinity});
  check(&S::release_share, "release_share: expected above 0, at most 1, found ", {0.1, 1.0},
        {0.0, 1.1});
  check(&S::longest_loss_s, "longest_loss_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_fault_s, "longest_fault_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_warm_up_s, "longest_warm_up_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_command_age_s, "longest_command_age_s: expected above 0, found ",
        {1e-3, kInfinity}, {0.0});
  check(&S::largest_novelty, "largest_novelty: expected above 0, found ", {0.1, kInfinity}, {0.0});
  check(&S::proof_s, "proof_s: expected 0 or more, found ", {0.0, 10.0}, {-1e-9, kInfinity});
  check(&S::spike_memory_s, "spike_memory_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  EXPECT_EQ(refusal([](auto& s) { s.longest_overrun = 0; }),
            "monitor: longest_overrun: expected 1 or more, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.longest_overrun = 1; }), "");
  EXPECT_EQ(refusal([](auto& s) { s.spikes_in_a_row = 0; }),
            "monitor: spikes_in_a_row: expected 1 or more, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.spikes_in_a_row = 1; }), "");
}

TEST(Monitor, OneLateTickIsEnoughForALimitOfOne) {
  MonitorSettings settings = joint();
  settings.longest_overrun = 1;
  settings.spikes_in_a_row = 1;
  Loop loop(settings);
  loop.start();
  EXPECT_EQ(loop.step(1.45e-3), State::watching);
  EXPECT_EQ(loop.step(1.55e-3), State::stopped);
  Loop spike(settings);
  spike.start();
  spike.signals[2].value = 0.0;
  EXPECT_EQ(spike.step(), State::stopped);
}

// --- properties ---------------------------------------------------------------------------------

// Whatever number of any input is NaN in whatever tick: a stop if it watches, no arming if it does
// not.
RC_GTEST_PROP(Monitor, NeverWatchesWithNaN, ()) {
  Random random(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
  MonitorSettings settings = joint();
  settings.longest_loss_s = 0.0;
  settings.longest_fault_s = 0.0;
  settings.persistence_s = 0.0;
  Loop loop(settings);
  bool watching = random.uniform() < 0.5;
  if (watching) loop.start();
  loop.step_for(static_cast<int>(100.0 * random.uniform()));
  const auto place = static_cast<std::size_t>(10.0 * random.uniform());
  if (place < 3) loop.sources[place].value = kNaN;
  if (place >= 3 && place < 6) loop.sources[place - 3].std_dev = kNaN;
  if (place >= 6 && place < 9) loop.signals[place - 6].value = kNaN;
  if (place == 9) loop.t_s = kNaN;
  (void)loop.step();
  RC_ASSERT(!loop.monitor.is_watching());
  RC_ASSERT(watching == (loop.monitor.state() == State::stopped));
  RC_ASSERT(!loop.monitor.arm(1e9));
}

// The same with the default settings, for NaN that lasts: NaN in any number but a novelty.
RC_GTEST_PROP(Monitor, StopsOnNaNWithTheDefaultSettings, ()) {
  Random random(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
  Loop loop;
  const bool watching = random.uniform() < 0.5;
  if (watching) loop.start();
  loop.step_for(static_cast<int>(40.0 * random.uniform()));
  const auto place = static_cast<std::size_t>(13.0 * random.uniform());
  if (place < 3) loop.sources[place].value = kNaN;
  if (place >= 3 && place < 6) loop.sources[place - 3].std_dev = kNaN;
  if (place >= 6 && place < 9) loop.signals[place - 6].value = kNaN;
  if (place >= 9 && place < 12) loop.signals[place - 9].age_s = kNaN;
  const std::size_t most = place < 3 ? 501 : place < 6 ? 16 : 1;
  for (std::size_t n = 0; n < most; ++n) (void)loop.step(place == 12 ? kNaN : kPeriod_s);
  RC_ASSERT(!loop.monitor.is_watching());
  RC_ASSERT(watching == (loop.monitor.state() == State::stopped));
  RC_ASSERT(!loop.monitor.arm(loop.t_s));
}

// 10^4 ticks of anything: what was stopped watches again only after a reset, a proof and an arming
// with a command written since.
RC_GTEST_PROP(Monitor, IsLatchedUnderAnyInputs, ()) {
  Random random(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
  Loop loop;
  double reset_s = -kInfinity;
  bool was_reset = true;
  double silent_s = 0.0;
  State last = State::unproven;
  const auto any = [&] {
    constexpr std::array kNumbers{kNaN, kInfinity, -kInfinity, 0.0, -1.0, 30.0, 1e200};
    return kNumbers[random.below(kNumbers.size())];
  };
  int disturbed = 0;  // ticks for which this disturbance lasts
  for (int n = 0; n < 10'000; ++n) {
    if (disturbed > 0 && --disturbed == 0) {
      for (Estimate& source : loop.sources) source = {.value = 0.0, .std_dev = 0.1};
      for (SignalSample& sample : loop.signals) sample = {.value = 0.0};
      loop.signals[2].value = 300.0;
    }
    if (disturbed == 0 && random.uniform() < 0.004) {
      disturbed = 1 + static_cast<int>(random.below(20));
      const std::size_t which = random.below(3);
      switch (random.below(5)) {
        case 0: loop.sources[which].value = any(); break;
        case 1: loop.sources[which].std_dev = any(); break;
        case 2:
          loop.sources[which].fault =
              random.uniform() < 0.5 ? Fault::input_not_finite : Fault::outside_training_range;
          break;
        case 3: loop.signals[which].value = any(); break;
        default: loop.signals[which].age_s = any(); break;
      }
    }
    const bool is_bad = std::ranges::any_of(
        loop.signals, [](const SignalSample& of) { return !std::isfinite(of.value); });
    if (random.uniform() < 0.001) loop.monitor.stop(loop.t_s);
    if (random.uniform() < 0.02) {
      reset_s = loop.t_s;
      loop.monitor.reset(loop.t_s);
      was_reset = true;
      silent_s = 0.0;
      last = State::unproven;
    }
    if (random.uniform() < 0.2) {
      const double written_s = loop.t_s + 0.05 * (random.uniform() - 0.5);
      const bool is_fresh = written_s > reset_s && written_s <= loop.t_s + kPeriod_s;
      const bool may = last == State::watching || (last == State::ready && is_fresh);
      RC_ASSERT(loop.monitor.arm(written_s) == (may && loop.monitor.state() != State::stopped));
    }
    const bool was_watching = loop.monitor.is_watching();
    const bool was_stopped = loop.monitor.state() == State::stopped;
    const double period_s = random.uniform() < 0.002 ? random.uniform() * 0.1 : kPeriod_s;
    last = loop.step(period_s);
    silent_s = loop.monitor.active() == 0 ? silent_s + period_s : 0.0;
    if (was_stopped) {
      RC_ASSERT(last == State::stopped);
      was_reset = false;
    }
    if (last == State::watching) RC_ASSERT(was_watching && was_reset);
    if (last == State::ready) RC_ASSERT(silent_s >= 0.05 - 1e-9);
    if (was_watching && is_bad) RC_ASSERT(last == State::stopped);
  }
}

}  // namespace
}  // namespace torsio
