#include "torsio/estimate/monitored_torque.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/monitored_joint.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using State = Monitor::State;
using test::kNaN;
using testing::ElementsAre;
using testing::HasSubstr;

/// A joint under 5 Nm, at 1 kHz.
struct Joint {
  Joint() { set_torque(5.0); }

  void set_torque(double torque_Nm) {
    channel("motor_current_A").value = torque_Nm / 10.0;
    channel("joint_angle_rad").value = 0.3;
    channel("gear_angle_rad").value = 0.3 + torque_Nm / 500.0;
    channel("motor_angle_rad").value = 100.0 * (0.3 + 2.0 * torque_Nm / 500.0);
  }
  SignalSample& channel(const std::string& name) {
    const auto& names = torque.raw_inputs();
    return raw[static_cast<std::size_t>(std::ranges::find(names, name) - names.begin())];
  }
  FusedTorque step() {
    t_s += 1e-3;
    return torque.step(t_s, raw);
  }
  void step_for(int ticks) {
    for (int n = 0; n < ticks; ++n) (void)step();
  }
  void start() {
    step_for(60);
    ASSERT_TRUE(torque.monitor().arm(t_s));
  }
  [[nodiscard]] State state() const { return torque.monitor().state(); }

  MonitoredTorque torque = test::monitored_joint();
  std::vector<SignalSample> raw = std::vector<SignalSample>(4, {.value = 0.0});
  double t_s = 10.0;
};

TEST(MonitoredTorque, CombinesItsSourcesFromOneRowOfChannels) {
  Joint joint;
  EXPECT_THAT(joint.torque.raw_inputs(), ElementsAre("motor_current_A", "motor_angle_rad",
                                                     "gear_angle_rad", "joint_angle_rad"));
  joint.start();
  const FusedTorque fused = joint.step();
  EXPECT_NEAR(fused.value_Nm, 5.0, 1e-9);
  EXPECT_NEAR(fused.std_dev_Nm, 0.1 / std::sqrt(3.0), 1e-9);
  EXPECT_EQ(fused.used, 0b111U);
  EXPECT_EQ(joint.state(), State::watching);
  ASSERT_EQ(joint.torque.estimates().size(), 3U);
  EXPECT_NEAR(joint.torque.estimates()[2].value, 5.0, 1e-9);
}

TEST(MonitoredTorque, StopsWhenAnEncoderMovesTwoOfItsThreeSources) {
  Joint joint;
  joint.start();
  joint.channel("gear_angle_rad").value += 0.008;  // gear - 4 Nm, spring + 4 Nm
  int ticks = 0;
  for (; joint.state() == State::watching && ticks < 100; ++ticks) (void)joint.step();
  EXPECT_LE(ticks, 20);
  EXPECT_EQ(joint.torque.monitor().reason().check, MonitorCheck::disagreement);
  EXPECT_THAT(joint.torque.redundancy().names(
                  joint.torque.redundancy().suspects(joint.torque.monitor().disagreeing())),
              ElementsAre("gear_encoder"));
}

TEST(MonitoredTorque, AnOldChannelIsNotMeasuredForTheSourcesEither) {
  for (const double age_s : {0.0051, -0.001, kNaN}) {
    Joint joint;
    joint.start();
    joint.channel("gear_angle_rad").age_s = 0.005;
    EXPECT_EQ(joint.step().used, 0b111U);
    joint.channel("gear_angle_rad").age_s = age_s;
    EXPECT_EQ(joint.step().used, 0b001U) << age_s;
    EXPECT_EQ(joint.torque.estimates()[1].fault, Fault::input_not_finite);
    EXPECT_EQ(joint.state(), State::stopped);
    EXPECT_EQ(joint.torque.monitor().reason().check, MonitorCheck::stale);
    EXPECT_EQ(joint.torque.monitor().reason().first, 0);
  }
}

// The age of an expression is that of its oldest channel; no time at all, or one in the future, is
// worse.
TEST(MonitoredTorque, AnExpressionIsAsOldAsItsOldestChannel) {
  for (const std::string late : {"gear_angle_rad", "joint_angle_rad"})
    for (const double age_s : {0.02, -0.001, kNaN}) {
      MonitorSettings settings = test::joint_monitor();
      settings.signals = {{.name = "gear_angle_rad - joint_angle_rad", .longest_age_s = 0.01}};
      Joint joint;
      joint.torque = MonitoredTorque(test::torque_sources(test::joint_sources()),
                                     test::joint_redundancy(), settings);
      joint.channel("gear_angle_rad").age_s = joint.channel("joint_angle_rad").age_s = 0.004;
      joint.start();
      joint.channel(late).age_s = age_s;
      (void)joint.step();
      EXPECT_EQ(joint.state(), State::stopped) << late << age_s;
      EXPECT_EQ(joint.torque.monitor().reason().check, MonitorCheck::stale);
      const double found_s = joint.torque.monitor().reason().value;
      EXPECT_TRUE(found_s == age_s || (std::isnan(found_s) && std::isnan(age_s)));
    }
}

TEST(MonitoredTorque, AMissingChannelStopsAndHoldsTheTorque) {
  Joint joint;
  joint.start();
  for (const char* name : {"motor_current_A", "gear_angle_rad"}) joint.channel(name).value = kNaN;
  const FusedTorque fused = joint.step();
  EXPECT_EQ(joint.state(), State::stopped);
  EXPECT_EQ(fused.used, 0U);
  EXPECT_NEAR(fused.value_Nm, 5.0, 1e-9);
  EXPECT_EQ(fused.fault, Fault::input_not_finite);
}

// NaN in the filter of a signal would otherwise remain there.
TEST(MonitoredTorque, ASignalWithMemoryRecoversFromAMissingChannel) {
  Joint joint;
  joint.start();
  joint.channel("joint_angle_rad").value = kNaN;
  (void)joint.step();
  EXPECT_EQ(joint.state(), State::stopped);
  joint.set_torque(5.0);
  joint.torque.monitor().reset(joint.t_s);
  joint.start();
  EXPECT_EQ(joint.state(), State::watching);
}

// Sources that are not stepped are not valid because they were in the last tick.
TEST(MonitoredTorque, StopsOnAnotherNumberOfSamples) {
  for (const bool has_signals : {true, false}) {
    Joint joint;
    MonitorSettings settings = test::joint_monitor();
    if (!has_signals) settings.signals.clear();
    joint.torque = MonitoredTorque(test::torque_sources(test::joint_sources()),
                                   test::joint_redundancy(), settings);
    joint.start();
    joint.raw.pop_back();
    const FusedTorque fused = joint.step();
    EXPECT_EQ(fused.fault, Fault::input_count_wrong);
    EXPECT_NEAR(fused.value_Nm, 5.0, 1e-9) << "the last one";
    EXPECT_EQ(joint.state(), State::stopped);
    EXPECT_TRUE(joint.torque.history().is_frozen());
    for (const Estimate& estimate : joint.torque.estimates())
      EXPECT_EQ(estimate.fault, Fault::input_count_wrong);
  }
}

TEST(MonitoredTorque, DoesNotEndItsHistoryBeforeItStops) {
  Joint joint;
  (void)joint.torque.step(1.0, {});
  EXPECT_EQ(joint.state(), State::unproven);
  EXPECT_FALSE(joint.torque.history().is_frozen());
}

TEST(MonitoredTorque, KeepsTheLastSecondBeforeAStop) {
  Joint joint;
  joint.start();
  EXPECT_THAT(joint.torque.history_columns(),
              ElementsAre("t_s", "torque_Nm", "torque_std_dev_Nm", "current_torque_Nm",
                          "current_std_dev_Nm", "gear_torque_Nm", "gear_std_dev_Nm",
                          "spring_torque_Nm", "spring_std_dev_Nm", "motor_current_A",
                          "motor_angle_rad", "gear_angle_rad", "joint_angle_rad"));
  joint.step_for(2000);
  joint.set_torque(6.0);
  joint.channel("gear_angle_rad").age_s = 1.0;
  (void)joint.step();
  ASSERT_EQ(joint.state(), State::stopped);
  const double stopped_s = joint.t_s;
  joint.set_torque(0.0);
  joint.torque.reset();
  joint.step_for(50);
  const History& history = joint.torque.history();
  EXPECT_TRUE(history.is_frozen());
  ASSERT_EQ(history.size(), 1000U);
  ASSERT_EQ(history.columns(), 13U);
  EXPECT_EQ(history.row(999)[0], stopped_s) << "the tick that stops is the last one";
  EXPECT_NEAR(history.row(0)[0], stopped_s - 0.999, 1e-9);
  EXPECT_NEAR(history.row(998)[1], 5.0, 1e-9);
  EXPECT_NEAR(history.row(998)[2], 0.1 / std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(history.row(998)[7], 5.0, 1e-9);
  EXPECT_EQ(history.row(999)[4], 0.1);
  EXPECT_EQ(history.row(999)[9], 0.6);
  joint.channel("gear_angle_rad").age_s = 0.0;
  joint.torque.monitor().reset(joint.t_s);
  (void)joint.step();
  EXPECT_FALSE(history.is_frozen());
  EXPECT_EQ(history.size(), 1U) << "begins again with the reset of the monitor";
}

TEST(MonitoredTorque, SubtractsAZeroFromSourcesAndSignals) {
  Joint joint;
  joint.torque.set_zero("joint_angle_rad", 0.3);
  joint.torque.set_zero("gear_angle_rad", 0.3);
  joint.channel("joint_angle_rad").value = 0.3;
  joint.channel("gear_angle_rad").value = 0.3 + 0.12;
  (void)joint.step();
  (void)joint.step();
  EXPECT_NEAR(joint.torque.estimates()[2].value, 60.0, 1e-9);
  EXPECT_NEAR(joint.torque.estimates()[1].value, 500.0 * (0.32 - 0.12), 1e-9);
  EXPECT_NE(joint.torque.monitor().active() & 1U << static_cast<unsigned>(MonitorCheck::range), 0U)
      << "a deflection of 0.12 rad with or without the zeros";
  joint.torque.set_zero("motor_current_A", 0.1);  // no signal uses it
  (void)joint.step();
  EXPECT_NEAR(joint.torque.estimates()[0].value, 4.0, 1e-9);
  EXPECT_THAT(test::error_message([&] { joint.torque.set_zero("joint_angel_rad", 0.0); }),
              HasSubstr("set_zero: expected one of motor_current_A, motor_angle_rad, "
                        "gear_angle_rad, joint_angle_rad, found 'joint_angel_rad'"));
  EXPECT_THROW(joint.torque.set_zero("oil_K", 0.0), UsageError);
  EXPECT_THROW(joint.torque.set_zero("joint_angle_rad", kNaN), UsageError);
}

TEST(MonitoredTorque, OneSpikeDoesNotReachTheSourcesButASecondSampleDoes) {
  MonitorSettings settings = test::joint_monitor();
  settings.signals.push_back({.name = "motor_current_A", .largest_rate = 1000.0});
  Joint joint;
  joint.torque = MonitoredTorque(test::torque_sources(test::joint_sources()),
                                 test::joint_redundancy(), settings);
  joint.step_for(10);
  const double sound_Nm = joint.torque.estimates()[0].value;
  joint.raw[0].value += 50.0;  // the current: 1 A in a tick is the most that it can
  (void)joint.step();
  EXPECT_EQ(joint.torque.estimates()[0].value, sound_Nm);
  (void)joint.step();
  EXPECT_EQ(joint.torque.estimates()[0].value, sound_Nm + 500.0);
  joint.raw[0].value = kNaN;
  (void)joint.step();
  EXPECT_EQ(joint.torque.estimates()[0].fault, Fault::input_not_finite);
}

TEST(MonitoredTorque, ASpikeDuringAMotionIsReplacedByTheMotion) {
  MonitorSettings settings = test::joint_monitor();
  settings.signals.push_back({.name = "motor_current_A", .largest_rate = 1000.0});
  Joint joint;
  joint.torque = {test::torque_sources(test::joint_sources()), test::joint_redundancy(), settings};
  double torque_Nm = 0.0;
  const auto move = [&] { joint.set_torque(torque_Nm += 0.02); };
  for (int n = 0; n < 60; ++n) {
    move();
    (void)joint.step();
  }
  move();
  joint.channel("motor_current_A").value += 50.0;
  (void)joint.step();
  EXPECT_NEAR(joint.torque.estimates()[0].value, torque_Nm, 1e-9);
  move();
  (void)joint.step();
  EXPECT_NEAR(joint.torque.estimates()[0].value, torque_Nm, 1e-9);
}

/// The current may change by 1 A in a tick.
Joint with_limited_current() {
  MonitorSettings settings = test::joint_monitor();
  settings.signals.push_back({.name = "motor_current_A", .largest_rate = 1000.0});
  Joint joint;
  joint.torque = {test::torque_sources(test::joint_sources()), test::joint_redundancy(), settings};
  return joint;
}

// The change over a gap was once compared with that of one tick, and an old value given to the
// sources.
TEST(MonitoredTorque, TheChangeOverAGapIsNoSpike) {
  for (const bool is_stale : {false, true}) {
    Joint joint = with_limited_current();
    joint.step_for(10);
    SignalSample& current = joint.channel("motor_current_A");
    for (int n = 1; n <= 5; ++n) {
      current = {.value = is_stale ? 0.5 : kNaN, .age_s = is_stale ? -1.0 : 0.0};
      (void)joint.step();
    }
    current = {.value = 0.5 + 0.9 * 6.0};
    EXPECT_FALSE(joint.step().has_replaced_input);
    EXPECT_NEAR(joint.torque.estimates()[0].value, 10.0 * current.value, 1e-9);
    // From here on the motion counts again: a spike is replaced along it.
    current.value += 0.9;
    (void)joint.step();
    const double next_A = current.value + 0.9;
    current.value += 90.0;
    EXPECT_TRUE(joint.step().has_replaced_input);
    EXPECT_NEAR(joint.torque.estimates()[0].value, 10.0 * next_A, 1e-9);
  }
}

TEST(MonitoredTorque, ASpikeAfterAGapIsAMissingSample) {
  Joint joint = with_limited_current();
  joint.step_for(10);
  SignalSample& current = joint.channel("motor_current_A");
  current.value = kNaN;
  (void)joint.step();
  current.value = 50.0;
  EXPECT_FALSE(joint.step().has_replaced_input);
  EXPECT_EQ(joint.torque.estimates()[0].fault, Fault::input_not_finite);
  current.value = 0.5;
  (void)joint.step();
  EXPECT_EQ(joint.torque.estimates()[0].fault, Fault::none);
  EXPECT_NEAR(joint.torque.estimates()[0].value, 5.0, 1e-9);
}

TEST(MonitoredTorque, ReportsThatAChannelWasReplaced) {
  Joint joint = with_limited_current();
  joint.step_for(10);
  EXPECT_FALSE(joint.step().has_replaced_input);
  joint.channel("motor_current_A").value += 50.0;
  EXPECT_TRUE(joint.step().has_replaced_input);
  EXPECT_FALSE(joint.step().has_replaced_input) << "the second sample is taken";
}

TEST(MonitoredTorque, AStepThatIsAJumpForASourceIsASpikeAsWell) {
  std::vector<Estimator> sources = test::joint_sources();
  EstimatorSettings settings = sources[0].settings();
  settings.disturbances.largest_step = {0.5};
  sources[0] = {settings, sources[0].model()};
  TorqueSources of = test::torque_sources(sources);
  EXPECT_EQ(of.largest_step("motor_current_A"), 1.0);
  EXPECT_EQ(of.largest_step("gear_angle_rad"), std::numeric_limits<double>::infinity());
  Joint joint;
  joint.torque = {std::move(of), test::joint_redundancy(), test::joint_monitor()};
  joint.start();
  joint.channel("motor_current_A").value += 1.5;
  (void)joint.step();
  EXPECT_EQ(joint.torque.estimates()[0].fault, Fault::none);
  EXPECT_NEAR(joint.torque.estimates()[0].value, 5.0, 1e-9);
}

TEST(MonitoredTorque, AResetMakesARunRepeatable) {
  Joint joint;
  const FusedTorque first = joint.step();
  joint.set_torque(-7.0);
  joint.step_for(20);
  joint.torque.reset();
  for (const Estimate& estimate : joint.torque.estimates())
    EXPECT_EQ(estimate.fault, Fault::warming_up);
  for (SignalSample& sample : joint.raw) sample.value = kNaN;
  EXPECT_EQ(joint.step().value_Nm, 0.0) << "no torque of before";
  joint.set_torque(5.0);
  EXPECT_EQ(joint.step().value_Nm, first.value_Nm);
}

TEST(MonitoredTorque, RefusesPartsThatDoNotFit) {
  const auto refusal = [](auto change) {
    std::vector<Estimator> sources = test::joint_sources();
    RedundancySettings redundancy = test::joint_redundancy();
    MonitorSettings monitor = test::joint_monitor();
    change(sources, redundancy, monitor);
    return test::error_message(
        [&] { MonitoredTorque(test::torque_sources(sources), redundancy, monitor); });
  };
  EXPECT_EQ(refusal([](auto&, auto&, auto&) {}), "");
  const std::string counts =
      "monitored torque: expected one model for each source of the redundancy and of the "
      "monitor, found ";
  EXPECT_EQ(refusal([](auto& s, auto&, auto&) { s.pop_back(); }),
            counts + "2 models, 3 and 3 sources");
  EXPECT_EQ(refusal([](auto& s, auto&, auto&) { s.clear(); }),
            "torque sources: expected at least one model, found none");
  EXPECT_EQ(refusal([](auto&, auto& r, auto&) { r.sources.pop_back(); }),
            counts + "3 models, 2 and 3 sources");
  EXPECT_EQ(refusal([](auto&, auto&, auto& m) {
              m.sources.pop_back();
              m.pairs.resize(1);
            }),
            counts + "3 models, 3 and 2 sources");
  EXPECT_EQ(refusal([](auto&, auto&, auto& m) { std::swap(m.sources[0], m.sources[1]); }),
            "monitored torque: expected source 1 to be 'current', found 'gear' in the monitor");
  EXPECT_EQ(refusal([](auto& s, auto&, auto&) {
              s[1] = test::proportional_source("gear_angle_rad", 1.0, 1000.0, "force_N");
            }),
            "torque sources: expected models with a torque in Nm as target, found 'force_N'");
  EXPECT_EQ(refusal([](auto& s, auto&, auto&) {
              s[2] = test::proportional_source("gear_angle_rad", 1.0, 500.0);
            }),
            "torque sources: expected models with a sample rate of 1000 Hz, found 500 Hz");
  EXPECT_EQ(refusal([](auto&, auto&, auto& m) { m.sample_period_s = 0.002; }),
            "monitored torque: expected a monitor with the period of the sources, 0.001 s, found "
            "0.002 s");
  EXPECT_NE(refusal([](auto&, auto& r, auto&) { r.sources.clear(); }), "");
  EXPECT_NE(refusal([](auto&, auto&, auto& m) { m.proof_s = -1.0; }), "");
  EXPECT_NE(refusal([](auto&, auto&, auto& m) { m.signals[0].name = "lowpass(gear_angle_rad"; }),
            "");
}

}  // namespace
}  // namespace torsio
