#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "report/monitor.hpp"
#include "support/error_message.hpp"
#include "support/two_torques.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/evaluate/monitor_replay.hpp"

namespace torsio {
namespace {

using test::TwoTorques;
using testing::HasSubstr;

CalibratedMonitor calibrated(double minutes, const CalibrationOptions& options = {}) {
  const TwoTorques joint;
  return calibrate_monitor(joint.models(), TwoTorques::plan(),
                           TwoTorques::fault_free(60.0 * minutes), options);
}
MonitoredTorque monitored(const CalibratedMonitor& monitor) {
  return {TorqueSources(TwoTorques().models()), monitor.redundancy, monitor.monitor};
}

TEST(CalibrateMonitor, ChoosesThresholdsAboveTheFaultFreeDifferences) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  ASSERT_EQ(monitor.pairs.size(), 1U);
  // The difference has a standard deviation of 0.45 Nm; what persists for 5 ms is far smaller.
  EXPECT_GT(monitor.pairs[0].largest_difference_Nm, 1.2);
  EXPECT_LT(monitor.pairs[0].typical_threshold_Nm, monitor.pairs[0].largest_difference_Nm);
  EXPECT_GT(monitor.pairs[0].typical_threshold_Nm, 0.05);
  EXPECT_GT(monitor.pairs[0].detected_in_these_states_Nm, monitor.pairs[0].largest_difference_Nm);
  EXPECT_NEAR(monitor.hours, 5.0 / 60.0, 1e-9);
  EXPECT_FALSE(monitor.is_extrapolated);
  // Other fault-free data give no alarm.
  const MonitorReplay replay = replay_monitor(monitored(monitor), TwoTorques::recording(60.0, 99));
  EXPECT_TRUE(std::isnan(replay.stopped_at_s));
  EXPECT_LT(replay.watching_from_s, 0.2);
  EXPECT_TRUE(replay.events.empty());
}

TEST(CalibrateMonitor, FindsAFaultAndNamesWhatExplainsIt) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  const MonitorReplay replay =
      replay_monitor(monitored(monitor), TwoTorques::recording(10.0, 99, 1.5, 4.25));
  EXPECT_GE(replay.stopped_at_s, 4.25);
  EXPECT_LT(replay.stopped_at_s, 4.30);
  ASSERT_FALSE(replay.events.empty());
  EXPECT_EQ(replay.events.back().check, MonitorCheck::disagreement);
  EXPECT_THAT(replay.suspects, testing::UnorderedElementsAre("encoder", "current_sensor"));
  const std::string text = replays_text({replay}, monitor.monitor);
  EXPECT_THAT(text, HasSubstr("would stop at 4.2"));
  EXPECT_THAT(text, HasSubstr("the torques of spring and current differ by"));
  EXPECT_THAT(replays_json({replay}, monitor.monitor), HasSubstr("\"check\": \"disagreement\""));
}

TEST(CalibrateMonitor, RefusesARateThatTheDataCannotSupport) {
  const CalibrationOptions rare{.false_alarms_per_hour = 1.0};
  EXPECT_THAT(test::error_message([&] { calibrated(5.0, rare); }),
              testing::AllOf(HasSubstr("at least 36 per hour"), HasSubstr("found 1 per hour")));
  const CalibratedMonitor monitor =
      calibrated(5.0, {.false_alarms_per_hour = 1.0, .extrapolate = true});
  EXPECT_TRUE(monitor.is_extrapolated);
  EXPECT_THAT(calibration_text(monitor), HasSubstr("extrapolated: the recordings support 36"));
  EXPECT_GT(monitor.pairs[0].typical_threshold_Nm,
            calibrated(5.0, {.false_alarms_per_hour = 40.0}).pairs[0].typical_threshold_Nm);
}

TEST(CalibrateMonitor, MeasuresTheCorrelationOfTheErrorsWhereTheTorqueIsKnown) {
  const std::vector<double> rows =
      calibrated(5.0, {.false_alarms_per_hour = 40.0}).redundancy.correlation;
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0], 1.0);
  EXPECT_NEAR(rows[1], 0.0, 0.05);  // independent noise
  // Twice the same sensor has the correlation 1, taken a little towards none.
  const TwoTorques joint;
  const std::vector<SourceModel> twice{{.torque = make_estimator(joint.spring)},
                                       {.torque = make_estimator(joint.spring)}};
  const CalibratedMonitor same = calibrate_monitor(
      twice, TwoTorques::plan(), TwoTorques::fault_free(300.0), {.false_alarms_per_hour = 40.0});
  EXPECT_NEAR(same.redundancy.correlation[1], 0.95, 1e-6);
}

TEST(CalibrateMonitor, TakesTheLimitsOfSignalsFromTheDataUnlessTheyAreGiven) {
  MonitorPlan plan = TwoTorques::plan();
  plan.signals[1].highest = 50.0;
  const CalibratedMonitor monitor = calibrate_monitor(
      TwoTorques().models(), plan, TwoTorques::fault_free(300.0), {.false_alarms_per_hour = 40.0});
  const MonitoredSignal& spring = monitor.monitor.signals[0];
  EXPECT_GT(spring.highest, 0.5);
  EXPECT_LT(spring.highest, 1.1);
  EXPECT_NEAR(spring.lowest, -spring.highest, 0.05);
  EXPECT_GT(spring.largest_rate, 50.0);
  EXPECT_NEAR(spring.longest_age_s, 1.5e-3, 1e-12);
  EXPECT_EQ(monitor.monitor.signals[1].highest, 50.0);
}

// The largest of a short recording is exceeded in a longer one.
TEST(CalibrateMonitor, TheLimitsOfSignalsFollowTheWantedRate) {
  const auto spring = [](double per_hour) {
    return calibrated(5.0, {.false_alarms_per_hour = per_hour, .extrapolate = true})
        .monitor.signals[0];
  };
  EXPECT_GT(spring(1e-12).largest_rate, 1.1 * spring(40.0).largest_rate);
}

TEST(CalibrateMonitor, NoThresholdIsBelowTheSmallestOne) {
  const CalibratedMonitor free = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  const double least_Nm = 2.0 * free.monitor.pairs[0].floor_Nm;
  const CalibratedMonitor limited =
      calibrated(5.0, {.false_alarms_per_hour = 40.0, .least_threshold_Nm = least_Nm});
  EXPECT_EQ(limited.monitor.pairs[0].floor_Nm, least_Nm);
  EXPECT_GE(limited.pairs[0].typical_threshold_Nm, least_Nm);
}

/// Two torques whose current has an error bar of 0.4 Nm below 3 Nm and of `above_Nm` from there on.
CalibratedMonitor with_two_error_bars(double above_Nm, const CalibrationOptions& options) {
  TwoTorques joint;
  joint.current.settings.residuals = {.edges = {-1000.0, 3.0, 1000.0}, .std_dev = {0.4, above_Nm}};
  return calibrate_monitor(joint.models(), TwoTorques::plan(), TwoTorques::fault_free(300.0),
                           options);
}

TEST(CalibrateMonitor, ACeilingEndsTheGrowthOfAThreshold) {
  const CalibratedMonitor monitor = with_two_error_bars(4.0, {.false_alarms_per_hour = 40.0});
  const PairLimits& pair = monitor.monitor.pairs[0];
  EXPECT_FALSE(monitor.pairs[0].is_factor_from_floor);
  // The largest threshold of the recordings is detected in all their states, and the ceiling leaves
  // a margin.
  const double largest_Nm =
      monitor.pairs[0].detected_in_these_states_Nm - monitor.pairs[0].largest_difference_Nm;
  EXPECT_GT(largest_Nm, 2.0 * monitor.pairs[0].typical_threshold_Nm);
  EXPECT_NEAR(pair.ceiling_Nm, 1.25 * largest_Nm, 1e-9);
  // What has to be found is not hidden by longer error bars.
  const CalibratedMonitor required =
      with_two_error_bars(4.0, {.false_alarms_per_hour = 40.0, .required_Nm = 5.0});
  EXPECT_GT(largest_Nm, 5.0);
  EXPECT_NEAR(required.monitor.pairs[0].ceiling_Nm, 4.0, 1e-9);
  EXPECT_NEAR(required.pairs[0].detected_in_these_states_Nm,
              required.pairs[0].largest_difference_Nm + 4.0, 1e-9);
  EXPECT_THAT(calibration_text(monitor),
              testing::AllOf(HasSubstr("detected in these states Nm"),
                             HasSubstr("which a difference must exceed for 5 ms")));
}

// Samples at which the error bars change size were once each taken for a difference that persists.
TEST(CalibrateMonitor, ADifferencePersistsAcrossAChangeOfTheErrorBars) {
  const CalibratedMonitor one = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  const CalibratedMonitor two = with_two_error_bars(0.401, {.false_alarms_per_hour = 40.0});
  EXPECT_NEAR(two.monitor.pairs[0].floor_Nm, one.monitor.pairs[0].floor_Nm,
              0.2 * one.monitor.pairs[0].floor_Nm);
}

TEST(CalibrateMonitor, WithConstantErrorBarsTheFactorIsTheFloorOverTheirSize) {
  // What persists for two samples is larger than the error bars of the models, which are too small.
  TwoTorques joint;
  const CalibratedMonitor monitor =
      calibrate_monitor(joint.models(), TwoTorques::plan(), TwoTorques::fault_free(300.0),
                        {.false_alarms_per_hour = 40.0, .persistence_s = 1e-3});
  EXPECT_TRUE(monitor.pairs[0].is_factor_from_floor);
  const PairLimits& pair = monitor.monitor.pairs[0];
  EXPECT_GT(pair.factor, 1.0);
  EXPECT_NEAR(pair.factor * 0.447, pair.floor_Nm, 0.02);
  EXPECT_THAT(calibration_text(monitor), HasSubstr("the error bars hardly change"));
}

TEST(CalibrateMonitor, ADisagreementThatHasToBeFoundLimitsWhatIsArmed) {
  const CalibratedMonitor monitor =
      with_two_error_bars(4.0, {.false_alarms_per_hour = 40.0, .required_Nm = 5.0});
  EXPECT_EQ(monitor.monitor.pairs[0].largest_armed_Nm, 4.0);
  const CalibratedMonitor narrow =
      with_two_error_bars(4.0, {.false_alarms_per_hour = 40.0, .required_Nm = 1e-3});
  EXPECT_EQ(narrow.monitor.pairs[0].largest_armed_Nm, 1.1 * narrow.monitor.pairs[0].floor_Nm);
  EXPECT_THAT(test::error_message([] {
                TwoTorques joint;
                joint.current.settings.residuals = {.edges = {-1000.0, 3.0, 1000.0},
                                                    .std_dev = {0.8, 0.81}};
                Dataset unmeasured = TwoTorques::fault_free(300.0);
                unmeasured.target = "none";
                static_cast<void>(calibrate_monitor(
                    joint.models(), TwoTorques::plan(), unmeasured,
                    {.false_alarms_per_hour = 40.0, .persistence_s = 1.0, .required_Nm = 0.01}));
              }),
              testing::AllOf(HasSubstr("pair spring, current"), HasSubstr("never be ready")));
}

TEST(CalibrateMonitor, TheLimitOfADriftFollowsTheRecordings) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  EXPECT_EQ(monitor.monitor.pairs[0].drift_allowance, 0.75);
  EXPECT_GE(monitor.monitor.pairs[0].drift_limit_s, 1.0);
  EXPECT_LT(monitor.monitor.pairs[0].drift_limit_s, 2.0);
}

TEST(CalibrateMonitor, RefusesWhatItCannotUse) {
  const TwoTorques joint;
  const Dataset sound = TwoTorques::fault_free(300.0);
  const CalibrationOptions options{.false_alarms_per_hour = 40.0};
  const auto message = [&](const std::vector<SourceModel>& sources, const MonitorPlan& plan,
                           const Dataset& dataset, const CalibrationOptions& with) {
    return test::error_message(
        [&] { static_cast<void>(calibrate_monitor(sources, plan, dataset, with)); });
  };
  EXPECT_THAT(
      message({{.torque = make_estimator(joint.spring)}}, TwoTorques::plan(), sound, options),
      HasSubstr("one model for each source of the plan"));
  EXPECT_THAT(message(joint.models(), TwoTorques::plan(), {}, options),
              HasSubstr("there is no recording"));
  EXPECT_THAT(message(joint.models(), TwoTorques::plan(), sound, {.least_threshold_Nm = -1.0}),
              HasSubstr("smallest threshold"));
  EXPECT_THAT(message(joint.models(), TwoTorques::plan(), sound, {.false_alarms_per_hour = 0.0}),
              HasSubstr("a positive number per hour"));
  EXPECT_THAT(message(joint.models(), TwoTorques::plan(), TwoTorques::fault_free(50.0),
                      {.false_alarms_per_hour = 1e4}),
              HasSubstr("at least 100 s without a fault"));
  MonitorPlan other = TwoTorques::plan();
  other.signals.push_back({.name = "gear_angle_rad"});
  EXPECT_THAT(message(joint.models(), other, sound, options), HasSubstr("gear_angle_rad"));
  ModelFile narrow = joint.spring;
  narrow.settings.ranges = {.lowest = {-0.2}, .highest = {0.2}};
  EXPECT_THAT(
      message({{.torque = make_estimator(narrow)}, {.torque = make_estimator(joint.current)}},
              TwoTorques::plan(), sound, options),
      HasSubstr("% of the samples with a fault (outside_training_range "));
}

TEST(CalibrateMonitor, RefusesASingleSource) {
  MonitorPlan plan = TwoTorques::plan();
  plan.sources.pop_back();
  EXPECT_THAT(test::error_message([&] {
                static_cast<void>(calibrate_monitor(
                    {{.torque = make_estimator(TwoTorques().spring)}}, plan,
                    TwoTorques::fault_free(300.0), {.false_alarms_per_hour = 40.0}));
              }),
              HasSubstr("at least two sources"));
}

TEST(CalibrateMonitor, ReportsThePartsThatNoComparisonCovers) {
  const TwoTorques joint;
  MonitorPlan plan = TwoTorques::plan();
  const auto text = [&] {
    const CalibratedMonitor monitor = calibrate_monitor(
        joint.models(), plan, TwoTorques::fault_free(300.0), {.false_alarms_per_hour = 40.0});
    return calibration_text(monitor) + calibration_json(monitor);
  };
  EXPECT_THAT(text(), testing::AllOf(HasSubstr("every source depends on it: clock\n"),
                                     HasSubstr("\"not_redundant\": [\n    \"clock\""),
                                     testing::Not(HasSubstr("states no parts"))));
  plan.sources[1].depends_on.clear();
  EXPECT_THAT(text(), testing::AllOf(HasSubstr("warning: current states no parts"),
                                     testing::Not(HasSubstr("every source depends on it"))));
}

TEST(CalibrateMonitor, WarnsOfAThresholdAboveTheLargestTorque) {
  const auto text = [](double least_Nm) {
    return calibration_text(
        calibrated(5.0, {.false_alarms_per_hour = 40.0, .least_threshold_Nm = least_Nm}));
  };
  EXPECT_THAT(text(0.0), testing::Not(HasSubstr("above the largest torque")));
  EXPECT_THAT(text(8.0),
              HasSubstr("spring, current: the threshold of 8 Nm is above the largest torque"));
}

TEST(CalibrateMonitor, RefusesACompanionThatIsNotWatchedOrDoesNotMove) {
  MonitorPlan plan = TwoTorques::plan();
  Dataset sound = TwoTorques::fault_free(300.0);
  const auto message = [&] {
    return test::error_message([&] {
      static_cast<void>(
          calibrate_monitor(TwoTorques().models(), plan, sound, {.false_alarms_per_hour = 40.0}));
    });
  };
  plan.signals[0].moves_with = "motor_angle_rad";
  EXPECT_THAT(message(), testing::AllOf(HasSubstr("signal spring_deflection_rad"),
                                        HasSubstr("add --signal 'motor_angle_rad'")));
  plan.signals.push_back({.name = "motor_angle_rad", .lowest = -1.0, .highest = 1.0});
  Recording& recording = sound.records[0].recording;
  recording.add({.name = "motor_angle_rad", .values = std::vector<double>(recording.size(), 0.0)});
  EXPECT_THAT(message(), HasSubstr("motor_angle_rad, with which it is to move, is constant"));
}

TEST(CalibrateMonitor, ReportsAShortRecordingBeforeItsRate) {
  EXPECT_THAT(test::error_message([] { calibrated(0.5); }),
              testing::AllOf(HasSubstr("at least 100 s without a fault"), HasSubstr("found 30 s")));
}

TEST(ReplayMonitor, ReportsARecordingThatItCannotArm) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  Recording without_spring("log", 1000.0);
  const Recording sound = TwoTorques::recording(5.0, 5);
  for (Channel channel : sound.channels()) {
    if (channel.name == "spring_deflection_rad") std::ranges::fill(channel.values, kNotMeasured);
    without_spring.add(std::move(channel));
  }
  const MonitorReplay replay = replay_monitor(monitored(monitor), without_spring);
  EXPECT_TRUE(std::isnan(replay.watching_from_s));
  EXPECT_TRUE(replay.events.empty());
  EXPECT_THAT(replays_text({replay}, monitor.monitor),
              testing::AllOf(HasSubstr("was never ready"),
                             HasSubstr("for 5.000 s  not_finite: spring_deflection_rad is not a"),
                             HasSubstr("for 5.000 s  redundancy_lost: 1 valid torque is left")));
  EXPECT_THAT(replays_json({replay}, monitor.monitor), HasSubstr("\"present_s\": 5.0"));
  Recording slow("slow", 500.0);
  slow.add({.name = "spring_deflection_rad", .values = {0.0}});
  EXPECT_THAT(
      test::error_message([&] { static_cast<void>(replay_monitor(monitored(monitor), slow)); }),
      testing::AllOf(HasSubstr("1000 Hz"), HasSubstr("--rate")));
}

TEST(ReplayMonitor, ReportsErrorBarsThatAreTooWideToBegin) {
  CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  for (PairLimits& pair : monitor.monitor.pairs) {
    pair.floor_Nm = 0.01;
    pair.largest_armed_Nm = 0.02;
  }
  const MonitorReplay replay = replay_monitor(monitored(monitor), TwoTorques::recording(5.0, 5));
  EXPECT_TRUE(std::isnan(replay.watching_from_s));
  EXPECT_TRUE(replay.not_ready.empty());
  EXPECT_NEAR(replay.threshold_too_large_s, 5.0, 1e-6);
  EXPECT_THAT(replays_text({replay}, monitor.monitor),
              HasSubstr("for 5.000 s the error bars made a threshold larger"));
  // One that is too short for the proof.
  monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  EXPECT_THAT(replays_text({replay_monitor(monitored(monitor), TwoTorques::recording(0.03, 5))},
                           monitor.monitor),
              HasSubstr("no check found anything, but for less than 0.05 s"));
}

// A source that is lost once kept its last value in the table, without a fault.
TEST(ReplayMonitor, HasTheFaultOfEachSource) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  Recording log("log", 1000.0);
  const Recording sound = TwoTorques::recording(1.0, 5);
  for (Channel channel : sound.channels()) {
    if (channel.name == "spring_deflection_rad") channel.values[500] = kNotMeasured;
    log.add(std::move(channel));
  }
  const MonitorReplay replay = replay_monitor(monitored(monitor), log);
  const auto at = [&](const std::string& channel, std::size_t n) {
    return replay.estimated.channels.channel(channel).values[n];
  };
  EXPECT_EQ(at("spring_fault_1", 499), 0.0);
  EXPECT_TRUE(std::isfinite(at("spring_torque_Nm", 499)));
  EXPECT_EQ(at("spring_fault_1", 500), static_cast<double>(Fault::input_not_finite));
  EXPECT_TRUE(std::isnan(at("spring_torque_Nm", 500)));
  EXPECT_EQ(at("current_fault_1", 500), 0.0);
  EXPECT_TRUE(std::isfinite(at("current_torque_Nm", 500)));
}

TEST(ReplayMonitor, NamesTheFaultOfASource) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  TwoTorques joint;
  joint.spring.settings.ranges = {.lowest = {-0.2}, .highest = {0.2}};
  const MonitorReplay replay =
      replay_monitor({TorqueSources(joint.models()), monitor.redundancy, monitor.monitor},
                     TwoTorques::recording(2.0, 5));
  EXPECT_THAT(replays_text({replay}, monitor.monitor),
              testing::ContainsRegex("source_fault: the torque of spring .*limit 0.015 s "
                                     "\\(outside_training_range\\)"));
  EXPECT_THAT(replays_json({replay}, monitor.monitor),
              HasSubstr("\"fault\": \"outside_training_range\""));
}

// Reports once did not mention an injection, so that one that was missed read as a sound joint.
TEST(ReplayMonitor, ListsTheOutcomeOfEachInjection) {
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  MonitorReplay replay =
      replay_monitor(monitored(monitor), TwoTorques::recording(10.0, 99, 1.5, 4.25));
  replay.injections = {{"gain", 4.25}, {"second", 9.0}, {"third", 20.0}};
  EXPECT_THAT(
      replays_text({replay}, monitor.monitor),
      testing::AllOf(testing::ContainsRegex("injected at 4.250 s, gain: stop after [0-9]+ ms"),
                     HasSubstr("9.000 s, second: the joint had stopped before"),
                     HasSubstr("20.000 s, third: after the end of the recording")));
  EXPECT_THAT(replays_json({replay}, monitor.monitor),
              testing::AllOf(HasSubstr("\"stopped_after_s\": 0.0"),
                             HasSubstr("\"outcome\": \"the joint had stopped before\"")));
  MonitorReplay sound = replay_monitor(monitored(monitor), TwoTorques::recording(5.0, 99));
  sound.injections = {{"nothing", 2.0}};
  EXPECT_THAT(replays_text({sound}, monitor.monitor),
              HasSubstr("injected at 2.000 s, nothing: not detected"));
  sound.events = {
      {{.t_s = 2.5, .check = MonitorCheck::source_lost, .action = MonitorAction::warn}}};
  EXPECT_THAT(replays_text({sound}, monitor.monitor),
              HasSubstr("nothing: no stop, a warning after 500 ms"));
  sound.watching_from_s = kNotMeasured;
  EXPECT_THAT(replays_text({sound}, monitor.monitor),
              HasSubstr("nothing: not detected, since the monitor was never ready"));
}

// Two findings in one tick were once one event, and it was the last one whichever had begun.
TEST(ReplayMonitor, ListsEachFindingThatBegins) {
  CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  monitor.monitor.actions.fill(MonitorAction::warn);
  monitor.monitor.longest_loss_s = 100.0;
  Recording log("log", 1000.0);
  const Recording sound = TwoTorques::recording(2.0, 5);
  for (Channel channel : sound.channels()) {
    const bool is_spring = channel.name == "spring_deflection_rad";
    for (std::size_t n = 500; n < 1500 && is_spring; ++n) channel.values[n] = kNotMeasured;
    for (std::size_t n = 1000; n < 1500 && channel.name == "motor_current_A"; ++n)
      channel.values[n] = 20.0;
    log.add(std::move(channel));
  }
  const MonitorReplay replay = replay_monitor(monitored(monitor), log);
  ASSERT_TRUE(std::isnan(replay.stopped_at_s));
  const auto begins = [&](MonitorCheck check) {
    std::vector<double> times_s;
    for (const MonitorEvent& event : replay.events)
      if (event.check == check) times_s.push_back(event.t_s);
    return times_s;
  };
  EXPECT_THAT(begins(MonitorCheck::not_finite), testing::ElementsAre(0.5));
  EXPECT_THAT(begins(MonitorCheck::source_lost), testing::ElementsAre(0.5));
  EXPECT_THAT(begins(MonitorCheck::redundancy_lost), testing::ElementsAre(0.5));
  EXPECT_THAT(begins(MonitorCheck::range), testing::ElementsAre(1.001));
}

TEST(ReplayMonitor, TakesTheZerosThatTheMappingSubtracted) {
  TwoTorques joint;
  joint.spring.settings.zeroed_channels = {"spring_deflection_rad"};
  const CalibratedMonitor monitor = calibrated(5.0, {.false_alarms_per_hour = 40.0});
  const MonitoredTorque sources(TorqueSources(joint.models()), monitor.redundancy, monitor.monitor);
  Recording zeroed = TwoTorques::recording(5.0, 5);
  EXPECT_TRUE(std::isnan(replay_monitor(sources, zeroed).watching_from_s));
  zeroed.zeros.push_back({.channel = "spring_deflection_rad", .first_s = 1.0});
  const MonitorReplay replay = replay_monitor(sources, zeroed);
  EXPECT_LT(replay.watching_from_s, 0.2);
  EXPECT_TRUE(std::isnan(replay.stopped_at_s));
}

}  // namespace
}  // namespace torsio
