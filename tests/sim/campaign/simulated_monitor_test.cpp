#include "sim/campaign/simulated_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "report/monitor.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/campaign/fault_campaign.hpp"
#include "sim/campaign/fault_classes.hpp"
#include "sim/campaign/fused_accuracy.hpp"
#include "sim/campaign/monitor_recipe.hpp"
#include "support/monitored_joint.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/files/monitor_file.hpp"

namespace torsio {
namespace {

/// Shorter recordings than a real calibration needs.
SimulatedCalibration short_calibration() {
  return {.training_s = 400.0, .fault_free_hours = 0.3, .false_alarms_per_hour = 1e-3};
}

TEST(SimulatedMonitor, FindsAFaultOfEachSensorOfASeriesElasticJoint) {
  const DataSheet sheet = data_sheet("dfki-50#07");
  const SimulatedMonitor monitor = calibrate_simulated(sheet, short_calibration());
  ASSERT_EQ(monitor.sources.size(), 3U);
  EXPECT_TRUE(monitor.sources[0].friction.has_value());
  EXPECT_TRUE(monitor.calibrated.is_extrapolated);
  const auto replay = [&](const std::string& injection) {
    DutyRun work{.seed = 77, .duration_s = 20.0};
    if (!injection.empty()) work.faults.faults = {parse_injection(injection, sheet)};
    return replay_monitor(monitor.monitored(), duty_recording(sheet, work));
  };
  EXPECT_TRUE(std::isnan(replay("").stopped_at_s));
  for (const std::string injection :
       {"motor_angle=nan@16s", "gear_angle=0.1deg@16s", "joint_angle=2deg@16s", "current=3A@16s"}) {
    const MonitorReplay found = replay(injection);
    EXPECT_GE(found.stopped_at_s, 16.0) << injection;
    EXPECT_LE(found.stopped_at_s, 16.02) << injection;
  }

  // From its files it is the same.
  const TemporaryFolder folder;
  save_simulated_monitor(folder.path("joint.monitor.json"), monitor, full_name(sheet));
  EXPECT_EQ(folder.files(), 5U) << "three torques, one friction, the monitor";
  const MonitoredTorque loaded =
      load_monitor(folder.path("joint.monitor.json"), {.serial = full_name(sheet)});
  const Recording log = duty_recording(sheet, {.seed = 5, .duration_s = 3.0});
  const auto torque = [&](const MonitoredTorque& of) {
    return replay_monitor(of, log).estimated.channels.channel("estimated_torque_Nm").values;
  };
  EXPECT_EQ(torque(loaded), torque(monitor.monitored()));

  const FusedAccuracy accuracy = fused_accuracy(sheet, loaded, 2, 9, 30.0);
  EXPECT_EQ(accuracy.sources.size(), 3U);
  EXPECT_GT(accuracy.fused_rmse_Nm, 0.0);
  EXPECT_LT(accuracy.fused_rmse_Nm, accuracy.source_rmse_Nm[0]);
  EXPECT_GT(accuracy.mean_ratio, 0.3);
  EXPECT_LT(accuracy.mean_ratio, 1.5);
  EXPECT_EQ(accuracy.without.size(), 3U);
  EXPECT_GT(accuracy.within_2_std_dev, accuracy.within_std_dev);
  EXPECT_NE(accuracy_text({accuracy}).find("dfki-50#07"), std::string::npos);
  EXPECT_NE(accuracy_json({accuracy}).find("\"within_2_std_dev\""), std::string::npos);
}

TEST(MonitorRecipe, EveryActuatorHasSourcesFromItsLoggedChannels) {
  for (const DataSheet& sheet : data_sheets()) {
    const MonitorRecipe recipe = monitor_recipe(sheet);
    EXPECT_GE(recipe.sources.size(), 2U) << sheet.name;
    EXPECT_EQ(recipe.sources.size(), recipe.plan.sources.size());
    const Recording log = duty_recording(sheet, {.seed = 1, .duration_s = 0.1});
    for (const SourceRecipe& source : recipe.sources) {
      const FeaturePipeline pipeline(source.features, 1000.0);
      for (const std::string& channel : pipeline.raw_inputs())
        EXPECT_TRUE(log.has(channel)) << sheet.name << ": " << channel;
    }
    for (const MonitoredSignal& signal : recipe.plan.signals)
      for (const std::string& channel : channels_of(signal.name))
        EXPECT_TRUE(log.has(channel)) << sheet.name << ": " << channel;
  }
}

TEST(SimulatedMonitor, TheHashOfACalibrationIsThatOfItsSettings) {
  EXPECT_EQ(calibration_hash({}), calibration_hash({}));
  EXPECT_NE(calibration_hash({}), calibration_hash({.fault_free_hours = 4.0}));
  EXPECT_NE(calibration_hash({}), calibration_hash({.spring_serial = 4}));
}

TEST(FaultClasses, AStepOfTheTorqueConstantHasTheLimitOfADisagreement) {
  const DataSheet sheet = data_sheet("dfki-50");
  const MonitoredTorque current{
      test::torque_sources({test::proportional_source("motor_current_A", 10.0)}),
      {.sources = {{"current", {}}}, .correlation = {}},
      {.sources = {"current"}, .signals = {}, .pairs = {}, .correlation = {}}};
  Random random(1);
  int found = 0;
  for (const FaultClass& of : fault_classes(sheet, current)) {
    const bool is_step = of.name == "torque constant";
    if (!is_step && of.name != "drift torque constant") continue;
    ++found;
    EXPECT_EQ(of.limit_s, is_step ? 0.02 : 0.1);
    for (int n = 0; n < 20; ++n)
      EXPECT_EQ(of.draw(random, 0.5).faults.front().over_s == 0.0, is_step);
  }
  EXPECT_EQ(found, 2);
}

TEST(SourceDelay, IsThatOfAnInputOfTheSources) {
  Recording log("log", 1000.0);
  std::vector<double> step(100, 0.0);
  for (std::size_t n = 50; n < step.size(); ++n) step[n] = 1.0;
  log.add({.name = "torque_Nm", .values = step});
  log.add({.name = "truth_torque_Nm", .values = step});
  log.add({.name = "motor_current_A", .values = step});
  const Recording delayed = with_source_delay(log);
  EXPECT_EQ(delayed.channel("motor_current_A").values, step);
  EXPECT_EQ(delayed.channel("truth_torque_Nm").values, delayed.channel("torque_Nm").values);
  FeaturePipeline input({.inputs = {"lag(lowpass(motor_current_A, 100Hz), 1)"}, .definitions = {}},
                        1000.0);
  for (std::size_t n = 0; n < step.size(); ++n)
    EXPECT_EQ(delayed.channel("torque_Nm").values[n], input.step({&step[n], 1})[0]) << n;
}

// The campaign of docs/results/fault_campaign.txt on a small scale.
void expect_neither_misses_nor_false_alarms(double hours, std::size_t injections) {
  const DataSheet sheet = data_sheet("dfki-28#07");
  const SimulatedMonitor monitor =
      calibrate_simulated(sheet, {.training_s = 800.0, .fault_free_hours = 0.5 * hours});
  const CampaignResult result = run_fault_campaign(
      {{.name = full_name(sheet), .sheet = sheet, .monitor = [&] { return monitor.monitored(); }}},
      {.seed = 11,
       .injections = injections,
       .injections_of_a_size = 0,
       .fault_free_hours = hours,
       .low_load_hours = 0.5 * hours});
  EXPECT_EQ(result.classes.size(), 23U);
  for (const ClassResult& of : result.classes) {
    EXPECT_EQ(of.injected, injections) << of.name;
    EXPECT_EQ(of.detected, of.must_stop ? injections : 0U) << of.name;
    EXPECT_EQ(of.late, 0U) << of.name << ": " << of.latency.longest_ms << " ms";
    EXPECT_EQ(of.stops_with_gain, 0U) << of.name;
  }
  EXPECT_GT(result.work.joint_hours, 0.95 * hours);
  EXPECT_EQ(result.work.false_alarms, 0U);
  EXPECT_EQ(result.low_load.false_alarms, 0U);
}

TEST(SimulatedMonitor, MissesNoFaultAndGivesNoFalseAlarmInHalfAnHour) {
  expect_neither_misses_nor_false_alarms(0.5, 3);
}
TEST(SimulatedMonitor, MissesNoFaultAndGivesNoFalseAlarmInTwoHours) {
  expect_neither_misses_nor_false_alarms(2.0, 8);
}

}  // namespace
}  // namespace torsio
