#include "sim/campaign/fault_campaign.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "report/fault_campaign.hpp"
#include "sim/campaign/fault_classes.hpp"
#include "sim/campaign/fault_free_run.hpp"
#include "sim/campaign/injection_run.hpp"
#include "sim/campaign/stop_energy.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "toy_monitor.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::toy_group;

CampaignSettings few(std::vector<std::string> classes, std::size_t injections) {
  return {.seed = 3,
          .injections = injections,
          .injections_of_a_size = 0,
          .fault_free_hours = 0.0,
          .low_load_hours = 0.0,
          .classes = std::move(classes)};
}

const FaultClass& class_of(const std::vector<FaultClass>& all, const std::string& name) {
  return *std::ranges::find(all, name, &FaultClass::name);
}

std::vector<InjectionOutcome> outcomes(const std::string& name, std::size_t first,
                                       std::size_t count, double size = 0.0) {
  const DataSheet sheet = data_sheet("dfki-50");
  const JointMonitor monitor(test::toy_monitor(), sheet);
  const std::vector<FaultClass> classes = fault_classes(sheet, monitor.monitored());
  return run_injections({.sheet = sheet,
                         .monitor = monitor,
                         .fault = class_of(classes, name),
                         .seed = 17,
                         .first = first,
                         .count = count,
                         .size = size});
}

TEST(FaultClasses, AreThoseOfTheSensorsThatTheMonitorUses) {
  const std::vector<std::string> names = campaign_classes(toy_group());
  const auto has = [&](const char* name) { return std::ranges::count(names, name) == 1; };
  for (const char* const name :
       {"freeze motor_angle_rad", "freeze gear_angle_rad", "freeze joint_angle_rad",
        "offset gear_angle_rad", "sign joint_angle_rad", "broken spring", "bottomed spring",
        "spike", "spikes", "silent", "nan", "wrap", "zero at start", "model not finite", "overrun"})
    EXPECT_TRUE(has(name)) << name;
  // The toy has no source with the current.
  EXPECT_FALSE(has("torque constant"));
  EXPECT_FALSE(has("freeze torque_Nm"));
}

TEST(Injections, ASignalThatIsNotANumberStopsWithinTwoCycles) {
  for (const InjectionOutcome& of : outcomes("nan", 0, 12)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::detected);
    EXPECT_LE(of.latency_ticks, 2);
    EXPECT_EQ(of.check, static_cast<int>(MonitorCheck::not_finite));
  }
}

TEST(Injections, AnOffsetOfTheSharedEncoderStopsWithin20Ms) {
  for (const InjectionOutcome& of : outcomes("offset gear_angle_rad", 0, 16)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::detected);
    EXPECT_LE(of.latency_ticks, 20);
    EXPECT_GT(of.disagreement, 0.2);
    EXPECT_LT(of.energy_gain, 1e-3);
  }
}

TEST(Injections, ASmallOffsetIsNotDetectedAndItsDisagreementIsMeasured) {
  for (const InjectionOutcome& of : outcomes("offset gear_angle_rad", 0, 8, 0.025)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::missed);
    EXPECT_GT(of.disagreement, 0.015);
    EXPECT_LT(of.disagreement, 0.04);
  }
}

TEST(Injections, AnOverrunCountsStepsOfTheLoop) {
  for (const InjectionOutcome& of : outcomes("overrun", 0, 8)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::detected);
    EXPECT_LE(of.latency_ticks, 4);
    EXPECT_EQ(of.check, static_cast<int>(MonitorCheck::period));
  }
}

TEST(Injections, AModelThatFailsStops) {
  for (const InjectionOutcome& of : outcomes("model not finite", 0, 8)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::detected);
    EXPECT_LE(of.latency_ticks, 20);
    EXPECT_EQ(of.check, static_cast<int>(MonitorCheck::source_fault));
  }
}

TEST(Injections, ABrokenSpringStops) {
  for (const InjectionOutcome& of : outcomes("broken spring", 0, 8)) {
    EXPECT_EQ(of.kind, InjectionOutcome::Kind::detected);
    EXPECT_LE(of.latency_ticks, 20);
  }
}

// A monitor that would not watch with the sound signals either once counted as one that detects the
// fault.
TEST(Injections, AZeroAtStartCountsOnlyWhereTheMonitorWouldWatch) {
  const DataSheet sheet = data_sheet("dfki-50");
  const auto kinds = [&](const JointMonitor& monitor) {
    const std::vector<FaultClass> classes = fault_classes(sheet, monitor.monitored());
    std::vector<InjectionOutcome::Kind> all;
    for (const InjectionOutcome& of : run_injections({.sheet = sheet,
                                      .monitor = monitor,
                                      .fault = class_of(classes, "zero at start"),
                                      .seed = 17,
                                      .count = 8}))
      all.push_back(of.kind);
    return all;
  };
  EXPECT_EQ(kinds(JointMonitor(test::toy_monitor(), sheet)),
            std::vector(8, InjectionOutcome::Kind::detected));
  MonitoredTorque toy = test::toy_monitor();
  MonitorSettings never = toy.monitor().settings();
  never.proof_s = 100.0;
  EXPECT_EQ(kinds(JointMonitor({toy.sources(), toy.redundancy().settings(), never}, sheet)),
            std::vector(8, InjectionOutcome::Kind::unreached));
}

TEST(Injections, AreTheSameInAnyBatch) {
  const auto key = [](const InjectionOutcome& of) {
    return std::tuple(of.kind, of.latency_ticks, of.attempts, of.check, of.near_impact,
                      of.disagreement);
  };
  const std::vector<InjectionOutcome> together = outcomes("freeze joint_angle_rad", 0, 10);
  const std::vector<InjectionOutcome> later = outcomes("freeze joint_angle_rad", 7, 3);
  bool has_near = false;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(key(together[7 + i]), key(later[i]));
  for (const InjectionOutcome& of : outcomes("nan", 0, 12)) has_near = has_near || of.near_impact;
  EXPECT_TRUE(has_near);
}

TEST(FaultFree, CountsAlarmsAndTheirCauses) {
  const DataSheet sheet = data_sheet("dfki-50");
  const JointMonitor sound(test::toy_monitor(), sheet);
  const FaultFreeOutcome quiet =
      run_fault_free({.sheets = {sheet, sheet}, .monitor = sound, .seed = 5, .ticks = 60'000});
  EXPECT_EQ(quiet.ticks, 120'000U);
  EXPECT_GT(quiet.watched_ticks, 119'000U);
  EXPECT_TRUE(quiet.alarms.empty());
  EXPECT_GT(quiet.impacts, 2U);
  // The same models, but the spring of another actuator.
  DataSheet soft = sheet;
  std::get<SpringSheet>(soft.second).stiffness_Nm_rad = assumed(300.0);
  const FaultFreeOutcome alarmed =
      run_fault_free({.sheets = {soft}, .monitor = sound, .seed = 5, .ticks = 60'000});
  EXPECT_GT(alarmed.alarms.at("disagreement gear spring"), 0U);
  EXPECT_LT(alarmed.watched_ticks, alarmed.ticks);
}

TEST(StopEnergy, DoesNotIncreaseFromAMotionUnderLoad) {
  const DataSheet sheet = data_sheet("dfki-120");
  const double ratio = total_ratio(plant_parameters(sheet));
  const Load load = lever(9.0, 0.5);
  const double gain = stop_energy_gain(sheet,
                                       {.rotor_angle_rad = 0.73 * ratio,
                                        .rotor_speed_rad_s = 0.5 * ratio,
                                        .middle_angle_rad = 0.73,
                                        .middle_speed_rad_s = 0.5,
                                        .joint_angle_rad = 0.70,
                                        .joint_speed_rad_s = 0.5},
                                       load);
  EXPECT_LT(gain, 1e-3);
}

TEST(StopEnergy, IsDefinedForEveryActuator) {
  for (const DataSheet& sheet : data_sheets())
    EXPECT_LT(stop_energy_gain(sheet, {.rotor_speed_rad_s = 1.0}, {}), 1e-3) << sheet.name;
}

TEST(FaultCampaign, DetectsWhatItInjectsAndBoundsWhatItMisses) {
  CampaignSettings settings = few({"nan", "offset", "spike"}, 20);
  settings.injections_of_a_size = 8;
  const CampaignResult result = run_fault_campaign({toy_group()}, settings);
  ASSERT_EQ(result.classes.size(), 4U);  // spike and spikes
  for (const ClassResult& of : result.classes) {
    EXPECT_EQ(of.injected, 20U) << of.name;
    if (!of.must_stop) {
      EXPECT_EQ(of.name, "spike");
      EXPECT_EQ(of.detected, 0U);
      continue;
    }
    EXPECT_EQ(of.late, 0U) << of.name;
    if (of.name == "spikes") {
      // The toy has no limit of a rate: only spikes in most samples are a disagreement.
      EXPECT_GT(of.detected, 0U);
      EXPECT_GT(of.missed_upper_95, 1.0 - static_cast<double>(of.detected) / 20.0);
      continue;
    }
    EXPECT_EQ(of.detected, 20U) << of.name;
    EXPECT_NEAR(of.missed_upper_95, 1.0 - std::pow(0.05, 1.0 / 20.0), 1e-9);
  }
  EXPECT_EQ(result.sizes.size(), 4U);
  const auto json = nlohmann::json::parse(fault_campaign_json(result));
  EXPECT_EQ(json["classes"].size(), 4U);
  for (const auto& of : json["classes"]) {
    for (const char* const key :
         {"class", "group", "injected", "detected", "latency_ms_p50", "latency_ms_p99"})
      EXPECT_TRUE(of.contains(key)) << key;
  }
  EXPECT_TRUE(json["fault_free"].contains("joint_hours"));
  EXPECT_TRUE(json["fault_free"].contains("false_alarms"));
  EXPECT_TRUE(json["fault_free"]["upper_95"].is_null());  // no hours
  EXPECT_NE(fault_campaign_text(result).find("offset gear_angle_rad"), std::string::npos);
}

TEST(FaultCampaign, IsTheSameOnAnyNumberOfThreadsAndAfterAnInterruption) {
  const TemporaryFolder folder;
  const std::string path = folder.path("campaign.jsonl");
  CampaignSettings settings = few({"nan", "silent"}, 40);  // two units each
  settings.threads = 1;
  const std::string wanted = fault_campaign_json(run_fault_campaign({toy_group()}, settings));
  settings.threads = 3;
  EXPECT_EQ(fault_campaign_json(run_fault_campaign({toy_group()}, settings)), wanted);

  settings.threads = 1;
  settings.resume = path;
  int units = 0;
  EXPECT_THROW((void)run_fault_campaign({toy_group()}, settings,
                                        [&](double, std::string_view) { return ++units < 2; }),
               Cancelled);
  const auto lines = [&] {
    std::ifstream in(path);
    std::vector<std::string> all;
    for (std::string line; std::getline(in, line);) all.push_back(line);
    return all;
  };
  EXPECT_EQ(lines().size(), 3U);  // the campaign and two units
  // A line that was not finished.
  std::ofstream(path, std::ios::app) << R"({"unit":"dfki-50: ni)";
  EXPECT_EQ(fault_campaign_json(run_fault_campaign({toy_group()}, settings)), wanted);
  EXPECT_EQ(lines().size(), 5U);
  // All is known now.
  EXPECT_EQ(fault_campaign_json(run_fault_campaign({toy_group()}, settings)), wanted);
  EXPECT_EQ(lines().size(), 5U);

  CampaignGroup other = toy_group();
  other.monitor_hash = "another";
  EXPECT_NE(error_message([&] { (void)run_fault_campaign({other}, settings); }).find("another"),
            std::string::npos);
  other.monitor_hash = "";
  EXPECT_NE(
      error_message([&] { (void)run_fault_campaign({other}, settings); }).find("no monitor_hash"),
      std::string::npos);
  settings.seed = 4;
  EXPECT_NE(
      error_message([&] { (void)run_fault_campaign({toy_group()}, settings); }).find("\"seed\":4"),
      std::string::npos);
  std::ofstream(path) << "t_s,torque_Nm\n";
  EXPECT_NE(error_message([&] {
              (void)run_fault_campaign({toy_group()}, settings);
            }).find("the file of a campaign"),
            std::string::npos);
}

TEST(FaultCampaign, RefusesWhatItCannotDo) {
  const auto message = [](const CampaignSettings& settings) {
    return error_message([&] { (void)run_fault_campaign({toy_group()}, settings); });
  };
  EXPECT_NE(message(few({"nun"}, 1)).find("the beginning of one of: "), std::string::npos);
  EXPECT_NE(message({.fault_free_hours = -1.0}).find("0 to 1e+06 h"), std::string::npos);
  EXPECT_NE(message({.fault_free_hours = kNotMeasured}).find("0 to 1e+06 h"), std::string::npos);
  EXPECT_NE(error_message([] { (void)run_fault_campaign({}, {}); }).find("at least one"),
            std::string::npos);
  CampaignGroup wrong = toy_group();
  wrong.sheet = data_sheet("elastomer");
  EXPECT_NE(error_message([&] {
              (void)run_fault_campaign({wrong}, few({}, 1));
            }).find("inputs that its sensors measure"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio
