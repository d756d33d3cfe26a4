#include "torsio/evaluate/drift.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <variant>

#include "actuator/stage_wear.hpp"
#include "evaluate/drift/joint_difference.hpp"
#include "report/drift.hpp"
#include "sim/campaign/drift_campaign.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

constexpr const char* kActuator = "dfki-50#11";

void record(Dataset& dataset, const DataSheet& sheet, const ExperimentSpec& spec, Role role) {
  Recording recording = simulate(sheet, spec);
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

Dataset recorded(const DataSheet& sheet, std::uint64_t seed, Role role) {
  Dataset dataset;
  for (const double lever_m : {0.10, 0.17, 0.24})
    record(dataset, sheet, {.experiment = "sweep", .seed = seed++, .lever_m = lever_m}, role);
  record(dataset, sheet, {.experiment = "random-walk", .seed = seed}, role);
  return dataset;
}

const Dataset& calibration() {
  static const Dataset data = recorded(data_sheet(kActuator), 1, Role::train);
  return data;
}

const ModelFile& model() {
  static const ModelFile file =
      train_model(calibration(),
                  {.family = "grey_box", .features = resolve_inputs(calibration(), {})}, 1)
          .file;
  return file;
}

/// Today: another lever, noise of other seeds, warmer.
Dataset today(const DataSheet& sheet) {
  Dataset dataset;
  record(dataset, sheet,
         {.experiment = "sweep",
          .seed = 51,
          .lever_m = 0.21,
          .inclination_rad = 0.3,
          .conditions = {.temperature_K = 303.15}},
         Role::test);
  record(dataset, sheet, {.experiment = "random-walk", .seed = 52}, Role::test);
  return dataset;
}

/// The dataset with another torque.
Dataset with_torque(const Dataset& from, const std::function<double(double)>& torque) {
  Dataset dataset = from;
  for (DatasetRecord& record : dataset.records) {
    Recording changed(record.recording.name(), record.recording.sample_rate_Hz());
    for (Channel channel : record.recording.channels()) {
      if (channel.name == dataset.target)
        for (double& value : channel.values) value = torque(value);
      changed.add(std::move(channel));
    }
    record.recording = std::move(changed);
  }
  return dataset;
}

const DriftQuantity& of(const Drift& drift, const std::string& name) {
  for (const DriftQuantity& quantity : drift.quantities)
    if (quantity.name == name) return quantity;
  throw std::out_of_range(name);
}

TEST(Drift, AJointThatHasNotChangedIsReportedAsSuch) {
  const Drift drift = detect_drift(model(), today(data_sheet(kActuator)));
  EXPECT_EQ(drift.joint, DriftVerdict::not_changed);
  for (const char* name : {"stiffness or gain", "friction", "backlash", "zero"})
    EXPECT_EQ(of(drift, name).verdict, DriftVerdict::not_changed) << name;
  EXPECT_EQ(drift.advice, DriftAdvice::none);
  EXPECT_NEAR(of(drift, "stiffness or gain").before, 600.0, 100.0);
  EXPECT_THAT(drift_text(drift, "torque_Nm"), HasSubstr("The joint has not changed"));
}

// Age widens the break-away angles with the friction, which looks like more stiffness.
TEST(Drift, OfAnAgedJointIsSofterWithinItsInterval) {
  for (const double age : {0.3, 0.6, 1.0}) {
    Dataset dataset;
    record(dataset, data_sheet(kActuator),
           {.experiment = "sweep", .seed = 51, .lever_m = 0.17, .conditions = {.age = age}},
           Role::test);
    const Drift drift = detect_drift(model(), dataset);
    const DriftQuantity& stiffness = of(drift, "stiffness or gain");
    EXPECT_LT(stiffness.relative, 0.0) << age;
    EXPECT_LT(stiffness.lowest, -0.1 * age * stiffness.before) << age;
    EXPECT_GT(stiffness.highest, -0.1 * age * stiffness.before) << age;
    const DriftQuantity& friction = of(drift, "friction");
    EXPECT_EQ(friction.verdict, DriftVerdict::changed) << age;
    EXPECT_GT(friction.relative, 0.6 * age) << age;
  }
}

TEST(Drift, FindsAChangeOfTheStiffness) {
  const Drift drift =
      detect_drift(model(), today(worn(data_sheet(kActuator), {.stiffness = 0.95})));
  const DriftQuantity& stiffness = of(drift, "stiffness or gain");
  EXPECT_EQ(stiffness.verdict, DriftVerdict::changed);
  EXPECT_NEAR(stiffness.relative, -0.05, 0.01);
  EXPECT_LT(stiffness.lowest, -0.05 * stiffness.before);
  EXPECT_GT(stiffness.highest, -0.05 * stiffness.before);
  EXPECT_EQ(of(drift, "friction").verdict, DriftVerdict::not_changed);
  EXPECT_EQ(drift.joint, DriftVerdict::changed);
  EXPECT_EQ(drift.advice, DriftAdvice::calibrate);
  EXPECT_LT(drift.corrected_rmse, 0.5 * drift.zeroed_rmse);
}

TEST(Drift, FindsAChangeOfTheFriction) {
  const Drift drift = detect_drift(model(), today(worn(data_sheet(kActuator), {.friction = 1.3})));
  EXPECT_EQ(of(drift, "friction").verdict, DriftVerdict::changed);
  EXPECT_NEAR(of(drift, "friction").relative, 0.3, 0.05);
  EXPECT_EQ(of(drift, "stiffness or gain").verdict, DriftVerdict::not_changed);
}

DataSheet with_asymmetry(double more) {
  DataSheet sheet = data_sheet(kActuator);
  SheetValue& asymmetry = std::get<SpringSheet>(sheet.second).asymmetry;
  asymmetry = assumed(asymmetry.value + more);
  return sheet;
}

// Sound joints of a type differ in it, which `detect_drift` takes for stiffness and zero.
TEST(JointDifference, AsymmetryIsNotTakenForStiffness) {
  const Drift drift = joint_difference(model(), today(with_asymmetry(0.03)));
  EXPECT_NEAR(of(drift, "asymmetry").relative, 0.03, 0.006);
  EXPECT_NEAR(of(drift, "stiffness or gain").relative, 0.0, 0.006);
  EXPECT_LT(std::abs(of(drift, "zero").change), 0.1);
  const Drift same = joint_difference(model(), today(data_sheet(kActuator)));
  EXPECT_EQ(of(same, "asymmetry").verdict, DriftVerdict::not_changed);
  EXPECT_LT(std::abs(of(same, "break-away angles").relative), 0.15);
}

TEST(JointDifference, FrictionWithWiderBreakAwayAnglesIsFound) {
  const Drift drift =
      joint_difference(model(), today(worn(data_sheet(kActuator), {.friction = 1.5})));
  EXPECT_NEAR(of(drift, "friction").relative, 0.5, 0.06);
  EXPECT_GT(of(drift, "break-away angles").relative, 0.3);
  EXPECT_NEAR(of(drift, "stiffness or gain").relative, 0.0, 0.012);
}

/// Sweeps of today with white noise of the load cell in addition.
Dataset noisy_sweeps(const DataSheet& sheet, double noise_Nm, std::size_t count) {
  Dataset dataset;
  Random random(7);
  for (std::size_t k = 0; k < count; ++k)
    record(dataset, sheet, {.experiment = "sweep", .seed = 51 + k, .lever_m = 0.21}, Role::test);
  return with_torque(dataset, [&](double torque) { return torque + noise_Nm * random.normal(); });
}

TEST(Drift, NoiseOfTheLoadCellAveragesOut) {
  const Drift healthy = detect_drift(model(), noisy_sweeps(data_sheet(kActuator), 0.5, 1));
  EXPECT_EQ(of(healthy, "friction").verdict, DriftVerdict::not_changed);
  const Drift worn_out =
      detect_drift(model(), noisy_sweeps(worn(data_sheet(kActuator), {.friction = 1.3}), 0.5, 1));
  EXPECT_EQ(of(worn_out, "friction").verdict, DriftVerdict::changed);
  EXPECT_NEAR(of(worn_out, "friction").relative, 0.3, 0.1);
}

TEST(Drift, RecordingAsLongAsAdvisedDeterminesTheFriction) {
  const Drift once = detect_drift(model(), noisy_sweeps(data_sheet(kActuator), 1.5, 1));
  const DriftQuantity& friction = of(once, "friction");
  ASSERT_EQ(friction.verdict, DriftVerdict::undetermined);
  ASSERT_THAT(friction.reason, testing::MatchesRegex("record [0-9]+ times as long"));
  const std::size_t times = std::stoul(friction.reason.substr(std::string("record ").size()));
  ASSERT_LE(times, 40U);
  const Drift longer = detect_drift(model(), noisy_sweeps(data_sheet(kActuator), 1.5, times));
  EXPECT_EQ(of(longer, "friction").verdict, DriftVerdict::not_changed) << times;
}

TEST(Drift, ADeflectionThatIsCountedTheOtherWayGivesTheSame) {
  const ModelFile mirrored =
      train_model(calibration(),
                  {.family = "grey_box",
                   .features = {.inputs = {"joint_angle_rad - gear_angle_rad"}, .definitions = {}}},
                  1)
          .file;
  const Drift healthy = detect_drift(mirrored, today(data_sheet(kActuator)));
  EXPECT_EQ(healthy.joint, DriftVerdict::not_changed);
  EXPECT_NEAR(of(healthy, "stiffness or gain").before, 600.0, 100.0);
  const Drift softer =
      detect_drift(mirrored, today(worn(data_sheet(kActuator), {.stiffness = 0.95})));
  EXPECT_EQ(of(softer, "stiffness or gain").verdict, DriftVerdict::changed);
  EXPECT_NEAR(of(softer, "stiffness or gain").relative, -0.05, 0.01);
  EXPECT_EQ(of(softer, "friction").verdict, DriftVerdict::not_changed);
}

TEST(Drift, TheErrorWithoutTheZeroIsNeverBelowTheCorrectedOne) {
  Dataset data = today(data_sheet(kActuator));
  // Each recording has its own zero.
  data.records[0].recording =
      with_torque(data, [](double t) { return t + 0.4; }).records[0].recording;
  const Drift drift = detect_drift(model(), data);
  EXPECT_GE(drift.zeroed_rmse, drift.corrected_rmse);
}

TEST(Drift, StatesTheRatioOfTheErrors) {
  ModelFile file = model();
  const Drift drift = detect_drift(file, today(data_sheet(kActuator)));
  EXPECT_THAT(drift_text(drift, "torque_Nm"), HasSubstr("times that of the calibration: a new"));
  file.card.metrics.clear();
  file.settings.residuals = {};
  const Drift unknown = detect_drift(file, today(data_sheet(kActuator)));
  EXPECT_THAT(drift_text(unknown, "torque_Nm"), HasSubstr("cannot be determined"));
}

TEST(Drift, AModelOfTheGearIsAReference) {
  const auto with_gear = [](const std::vector<std::string>& inputs) {
    return train_model(calibration(),
                       {.family = "linear", .features = {.inputs = inputs, .definitions = {}}}, 1)
        .file;
  };
  const ModelFile gear =
      with_gear({"lowpass(motor_angle_rad / 120 - gear_angle_rad, 100Hz)",
                 "stop(lowpass(motor_angle_rad / 120 - gear_angle_rad, 100Hz), 1e-4)"});
  const Drift drift = detect_drift(model(), today(data_sheet(kActuator)), {.reference = &gear});
  EXPECT_TRUE(std::isfinite(of(drift, "gain of the torque sensor").highest));
  EXPECT_LT(of(drift, "gain of the torque sensor").lowest, 0.0);
  EXPECT_GT(of(drift, "gain of the torque sensor").highest, 0.0);
  const ModelFile other = [&] {
    ModelFile file = gear;
    file.settings.target = "motor_current_A";
    return file;
  }();
  EXPECT_THROW((void)detect_drift(model(), today(data_sheet(kActuator)), {.reference = &other}),
               UsageError);
}

/// A model of the torque from the motor current, with or without the friction of the drive.
ModelFile drive_model(bool with_friction) {
  std::vector<std::string> inputs{"motor_current_A"};
  if (with_friction)
    inputs.insert(inputs.end(), {"tanh(lowpass(rate(motor_angle_rad), 50Hz) / 0.6)",
                                 "rate(lowpass(rate(gear_angle_rad), 20Hz))"});
  return train_model(calibration(),
                     {.family = "linear",
                      .options = {{"rates", "true"}},
                      .features = {.inputs = inputs, .definitions = {}}},
                     1)
      .file;
}

const ModelFile& drive() {
  static const ModelFile file = drive_model(true);
  return file;
}

TEST(Drift, FindsAChangeOfTheFrictionOfTheDrive) {
  DataSheet changed = data_sheet(kActuator);
  changed.friction.coulomb_Nm.value *= 2.0;
  changed.friction.viscous_Nms_rad.value *= 2.0;
  changed.friction.load_factor.value *= 2.0;
  const Drift drift = detect_drift(model(), today(changed), {.reference = &drive()});
  const DriftQuantity& friction = of(drift, "friction of the drive");
  EXPECT_EQ(friction.verdict, DriftVerdict::changed);
  EXPECT_NEAR(friction.relative, 1.0, 0.3);
  EXPECT_FALSE(friction.is_of_joint);
  EXPECT_EQ(of(drift, "friction").verdict, DriftVerdict::not_changed);
}

TEST(Drift, FiveDegreesAreNoChangeOfTheFrictionOfTheDrive) {
  const Drift drift = detect_drift(model(), today(data_sheet(kActuator)), {.reference = &drive()});
  EXPECT_EQ(of(drift, "friction of the drive").verdict, DriftVerdict::not_changed);
}

TEST(Drift, AReferenceThatLacksFrictionDeterminesNeitherItNorTheGain) {
  const ModelFile without = drive_model(false);
  const Drift drift = detect_drift(model(), today(data_sheet(kActuator)), {.reference = &without});
  for (const char* name : {"friction of the drive", "gain of the torque sensor"}) {
    EXPECT_EQ(of(drift, name).verdict, DriftVerdict::undetermined) << name;
    EXPECT_THAT(of(drift, name).reason, HasSubstr("direction of motion")) << name;
  }
}

TEST(Drift, FindsMorePlay) {
  const Drift drift = detect_drift(model(), today(worn(data_sheet(kActuator), {.play = 8.0})));
  EXPECT_EQ(of(drift, "backlash").verdict, DriftVerdict::changed);
  EXPECT_NEAR(of(drift, "backlash").change, 7.0 * 2.6e-4, 7.0 * 1.3e-4);
  EXPECT_NE(of(drift, "friction").verdict, DriftVerdict::changed);
}

TEST(Drift, ANewZeroIsNoChangeOfTheJoint) {
  const Dataset moved =
      with_torque(today(data_sheet(kActuator)), [](double torque) { return torque + 0.5; });
  const Drift drift = detect_drift(model(), moved);
  EXPECT_EQ(of(drift, "zero").verdict, DriftVerdict::changed);
  EXPECT_NEAR(of(drift, "zero").change, 0.5, 0.1);
  EXPECT_EQ(drift.joint, DriftVerdict::not_changed);
  EXPECT_EQ(drift.advice, DriftAdvice::set_zero);
}

TEST(Drift, AMotionInOneDirectionDoesNotDetermineTheFriction) {
  Dataset part = today(data_sheet(kActuator));
  part.records.erase(part.records.begin() + 1, part.records.end());
  Recording& recording = part.records.front().recording;
  Recording cut(recording.name(), recording.sample_rate_Hz());
  for (Channel channel : recording.channels()) {
    channel.values.resize(9'000);  // the sweep has not reversed
    if (!channel.fresh.empty()) channel.fresh.resize(9'000);
    cut.add(std::move(channel));
  }
  recording = std::move(cut);
  part.records.front().segments = whole_record(9'000, Role::test);
  const Drift drift = detect_drift(model(), part);
  EXPECT_EQ(of(drift, "friction").verdict, DriftVerdict::undetermined);
  EXPECT_FALSE(of(drift, "friction").reason.empty());
  EXPECT_NE(drift.joint, DriftVerdict::changed);
}

TEST(Drift, AModelWithoutALoopDoesNotDetermineTheFriction) {
  const ModelFile line =
      train_model(calibration(),
                  {.family = "linear",
                   .features = {.inputs = {"gear_angle_rad - joint_angle_rad"}, .definitions = {}}},
                  1)
          .file;
  const Drift drift = detect_drift(line, today(data_sheet(kActuator)));
  EXPECT_EQ(of(drift, "friction").verdict, DriftVerdict::undetermined);
  EXPECT_THAT(of(drift, "friction").reason, HasSubstr("no hysteresis loop"));
}

TEST(Drift, RefusesWhatCannotBeCompared) {
  const Dataset sound = today(data_sheet(kActuator));
  const auto message = [](const Dataset& data) {
    return error_message([&] { (void)detect_drift(model(), data); });
  };
  EXPECT_THAT(message(with_torque(sound, [](double) { return 3.0; })),
              HasSubstr("the torque does not follow the motion"));
  EXPECT_THAT(message(with_torque(sound, [](double torque) { return -torque; })),
              HasSubstr("the opposite sign"));
  EXPECT_THAT(message(with_torque(sound, [](double torque) { return torque * 57.29577951308232; })),
              HasSubstr("units"));
  EXPECT_THAT(
      message(with_torque(sound, [](double) { return std::numeric_limits<double>::quiet_NaN(); })),
      HasSubstr("torque_Nm"));
  Dataset brief = sound;
  for (DatasetRecord& each : brief.records) {
    Recording cut(each.recording.name(), each.recording.sample_rate_Hz());
    for (Channel channel : each.recording.channels()) {
      channel.values.resize(100);
      if (!channel.fresh.empty()) channel.fresh.resize(100);
      cut.add(std::move(channel));
    }
    each.recording = std::move(cut);
    each.segments = whole_record(100, Role::test);
  }
  EXPECT_THAT(message(brief), HasSubstr("too short"));
  EXPECT_THROW((void)detect_drift(model(), sound, {.resamples = 10}), UsageError);
}

TEST(DriftCampaign, FindsTheChangesAndDoesNotDependOnTheThreads) {
  const DriftCampaignResult one = run_drift_campaign({.seed = 7, .specimens = 2, .threads = 1});
  EXPECT_EQ(one.found, 2);
  EXPECT_EQ(one.false_alarms, 0);
  EXPECT_NEAR(one.missed_upper_95, 1.0 - std::sqrt(0.05), 1e-6);
  const DriftCampaignResult two = run_drift_campaign({.seed = 7, .specimens = 2, .threads = 2});
  EXPECT_EQ(drift_campaign_json(one), drift_campaign_json(two));
}

TEST(DriftCampaign, TakesAnySeedAndOthersHaveOtherSpecimens) {
  const DriftCampaignResult one = run_drift_campaign({.seed = 4242, .specimens = 1});
  const DriftCampaignResult two = run_drift_campaign({.seed = 5242, .specimens = 1});
  EXPECT_EQ(one.specimens.size(), 2U);
  EXPECT_NE(one.specimens[1].scale, two.specimens[1].scale);
}

}  // namespace
}  // namespace torsio::test
