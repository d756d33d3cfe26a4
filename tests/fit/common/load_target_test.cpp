#include "torsio/fit/common/load_target.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "fit/common/load_leak.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kExactLoad =
    "load: {pendulum: {mass: 9kg, length: lever_m}, joint_inertia: 0.15kg_m2, zero: 0deg}\n";

/// Sweeps of dfki-50 without its load cell: three levers to train on and a fourth that is tilted.
const Dataset& sweeps_without_sensor() {
  static const Dataset made = [] {
    const SweepProtocol protocol = sweep_protocol(data_sheet("dfki-50"));
    Dataset dataset;
    const auto add = [&](double lever_m, double inclination_rad, Role role) {
      const Recording sweep = simulate({.actuator = "dfki-50",
                                        .experiment = "sweep",
                                        .seed = 11 + dataset.records.size(),
                                        .duration_s = 34.0,
                                        .lever_m = lever_m,
                                        .inclination_rad = inclination_rad,
                                        .with_truth = true});
      Recording kept("lever " + std::to_string(lever_m), sweep.sample_rate_Hz());
      for (const char* const name : {"gear_angle_rad", "joint_angle_rad", "truth_torque_Nm"})
        kept.add(sweep.channel(name));
      kept.add_condition("lever_m", lever_m);
      kept.add_condition("tilt_rad", inclination_rad);
      const std::size_t samples = kept.size();
      dataset.records.push_back({std::move(kept), whole_record(samples, role)});
    };
    for (const double lever_m : protocol.train_lever_m) add(lever_m, 0.0, Role::train);
    add(protocol.test_lever_m, protocol.test_inclination_rad, Role::test);
    return dataset;
  }();
  return made;
}

Dataset with_load(const std::string& sheet, const LoadTarget& before = {}) {
  Dataset dataset = sweeps_without_sensor();
  add_load_target(dataset, parse_load_sheet(sheet, "load.yaml"), resolve_inputs(dataset, {}),
                  before);
  return dataset;
}

constexpr const char* kTiltedLoad =
    "load: {pendulum: {mass: 9kg, length: lever_m, inclination: tilt_rad}, "
    "joint_inertia: 0.15kg_m2, zero: 0deg}\n";

/// RMS of the difference of a channel to the truth where it was measured.
double rms_from_truth(const Recording& recording, const std::string& channel) {
  const std::vector<double>& values = recording.channel(channel).values;
  const std::vector<double>& truth = recording.channel("truth_torque_Nm").values;
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!std::isfinite(values[n])) continue;
    sum += (values[n] - truth[n]) * (values[n] - truth[n]);
    count += 1.0;
  }
  return std::sqrt(sum / count);
}

TEST(LoadTarget, IsNearTheTrueTorqueAndStatesItsError) {
  const Dataset dataset = with_load(kTiltedLoad);
  for (const DatasetRecord& record : dataset.records) {
    const double error_Nm = rms_from_truth(record.recording, "torque_Nm");
    EXPECT_LT(error_Nm, 0.05) << record.recording.name();
  }
  ASSERT_EQ(dataset.load_target.loads.size(), 3U);  // the training recordings
  for (std::size_t r = 0; r < 3; ++r)
    EXPECT_NEAR(dataset.load_target.loads[r].motion_error_Nm /
                    rms_from_truth(dataset.records[r].recording, "torque_Nm"),
                1.0, 0.5);
  EXPECT_GT(dataset.load_target.half_width_s, 0.01);
  EXPECT_LT(dataset.load_target.half_width_s, 0.06);
  EXPECT_THAT(dataset.load_target.computed_from,
              testing::ElementsAre("joint_angle_rad", "lever_m", "tilt_rad"));
}

TEST(LoadTarget, StatesTheErrorOfEachRecordingAlone) {
  const Dataset& all = sweeps_without_sensor();
  for (std::size_t r = 0; r < 3; ++r) {
    Dataset dataset;
    dataset.records = {all.records[r]};
    add_load_target(dataset, parse_load_sheet(kExactLoad, "load.yaml"), {});
    const double error_Nm = rms_from_truth(dataset.records[0].recording, "torque_Nm");
    EXPECT_LT(error_Nm, 0.05) << r;
    EXPECT_NEAR(dataset.load_target.motion_error_Nm / error_Nm, 1.0, 0.5) << r;
  }
}

TEST(LoadTarget, TrainsASpringWithoutASensor) {
  const Dataset dataset = with_load(kTiltedLoad);
  const FeatureSpec features = resolve_inputs(dataset, {});
  EXPECT_EQ(find_leak(dataset, features), "");
  const TrainedModel trained = train_model(dataset, {"grey_box", {}, "", features}, 1);
  Dataset against_truth = dataset;
  against_truth.target = "truth_torque_Nm";
  const SplitScore score = evaluate(make_estimator(trained.file), against_truth, Role::test);
  EXPECT_LT(score.together.metrics.rmse, 0.08);
  EXPECT_GT(score.together.within_2_std_dev, 0.9);
  EXPECT_EQ(trained.file.card.load_target, dataset.load_target);
}

TEST(LoadTarget, WidensTheErrorBarsByTheErrorsOfTheFacts) {
  const std::string wrong =
      "load: {pendulum: {mass: 9.09kg, length: lever_m, inclination: tilt_rad}, "
      "joint_inertia: 0.15kg_m2, zero: 0.5deg}\n";
  const auto test_score = [](const Dataset& dataset) {
    const TrainedModel trained =
        train_model(dataset, {"linear", {}, "", resolve_inputs(dataset, {})}, 1);
    Dataset against_truth = dataset;
    against_truth.target = "truth_torque_Nm";
    return evaluate(make_estimator(trained.file), against_truth, Role::test).together;
  };
  const Score blind = test_score(with_load(wrong));
  const Score knowing = test_score(with_load(wrong + "load_uncertainty: {mass: 5%, zero: 0.5deg}"));
  EXPECT_NEAR(knowing.metrics.rmse, blind.metrics.rmse, 1e-9);
  EXPECT_GT(knowing.mean_std_dev, 1.05 * blind.mean_std_dev);
  EXPECT_GT(knowing.within_std_dev, blind.within_std_dev);
}

TEST(LoadTarget, StatesWhatEachFactChanges) {
  const LoadTarget target =
      with_load(std::string(kExactLoad) + "load_uncertainty: {mass: 1%, length: 2%}").load_target;
  ASSERT_EQ(target.facts.size(), 2U);
  EXPECT_EQ(target.facts[0].fact, "mass");
  EXPECT_NEAR(target.facts[1].error_Nm / target.facts[0].error_Nm, 2.0, 0.1);
  EXPECT_NEAR(target.load_error_Nm, std::hypot(target.facts[0].error_Nm, target.facts[1].error_Nm),
              1e-9);
}

TEST(LoadTarget, FitsInertiaAndZeroFromTheLevers) {
  const Dataset dataset = with_load(
      "load: {pendulum: {mass: 9kg, length: lever_m, inclination: tilt_rad}, joint_inertia: fit, "
      "zero: fit}");
  ASSERT_EQ(dataset.load_target.fitted.size(), 2U);
  const LoadTarget::Fitted& inertia = dataset.load_target.fitted[0];
  const LoadTarget::Fitted& zero = dataset.load_target.fitted[1];
  EXPECT_EQ(inertia.fact, "joint_inertia");
  EXPECT_LT(std::abs(inertia.value - 0.15), 3.0 * inertia.standard_error);
  EXPECT_LT(std::abs(zero.value), 3.0 * zero.standard_error);
  EXPECT_LT(zero.standard_error, 0.01);
  EXPECT_THAT(load_target_notes(dataset.load_target), testing::Contains(HasSubstr("fitted: zero")));
}

TEST(LoadTarget, TakesFittedFactsFromTheModelThatIsCompared) {
  LoadTarget before;
  before.fitted = {{"joint_inertia", 0.123, 0.01}};
  const Dataset dataset = with_load(
      "load: {pendulum: {mass: 9kg, length: lever_m}, joint_inertia: fit, zero: 0deg}", before);
  EXPECT_EQ(dataset.load_target.fitted, before.fitted);
}

TEST(LoadTarget, DoesNotReplaceWhatWasMeasured) {
  Dataset dataset = sweeps_without_sensor();
  const LoadSheet sheet = parse_load_sheet(kExactLoad, "load.yaml");
  const FeatureSpec features = resolve_inputs(dataset, {});
  dataset.target = "truth_torque_Nm";
  EXPECT_THAT(error_message([&] { add_load_target(dataset, sheet, features); }),
              HasSubstr("--target load_torque_Nm"));
  dataset.target = "spring_deflection_rad";
  EXPECT_THAT(error_message([&] { add_load_target(dataset, sheet, features); }),
              HasSubstr("ends in _Nm"));
}

TEST(LoadTarget, StaysInTheModelFile) {
  const Dataset dataset = with_load(std::string(kExactLoad) + "load_uncertainty: {mass: 1%}");
  const TrainedModel trained =
      train_model(dataset, {"linear", {}, "", resolve_inputs(dataset, {})}, 1);
  EXPECT_EQ(parse_model(model_bytes(trained.file), "m").card.load_target, dataset.load_target);
}

FeatureSpec spec_of(const std::vector<std::string>& inputs) {
  return {inputs,
          {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"},
           {"joint_speed_rad_s", "rate(joint_angle_rad)"}}};
}

TEST(LoadLeak, AcceptsDeflectionsAndSpeeds) {
  EXPECT_EQ(
      load_leak(spec_of({"spring_deflection_rad", "lowpass(rate(spring_deflection_rad), 10Hz)",
                         "lowpass(joint_speed_rad_s, 10Hz)", "motor_current_A", "lever_m",
                         "rate(motor_angle_rad)", "motor_angle_rad / 120 - joint_angle_rad"})),
      "");
}

TEST(LoadLeak, FindsTheComputationOfTheTorque) {
  for (const char* const input :
       {"joint_angle_rad", "sin(joint_angle_rad)", "lowpass(gear_angle_rad, 10Hz)",
        "rate(joint_speed_rad_s)", "rate( lowpass(rate(joint_angle_rad), 10Hz))",
        "joint_acceleration_rad_s2", "joint_speed_rad_s - lag(joint_speed_rad_s, 5)",
        "motor_current_A * cos(joint_angle_rad)"})
    EXPECT_EQ(load_leak(spec_of({"spring_deflection_rad", input})), input);
}

TEST(LoadLeak, IsNotTheTwistBetweenTwoSensorsOfTheDrive) {
  EXPECT_EQ(load_leak(spec_of({"motor_angle_rad / 2 - wave_generator_angle_rad",
                               "lowpass(rate(motor_angle_rad / 2 - wave_generator_angle_rad), "
                               "10Hz)"})),
            "");
  for (const std::string input :
       {"motor_angle_rad / 2 + wave_generator_angle_rad", "motor_angle_rad - motor_angle_rad / 2",
        "motor_angle_rad - 0.5", "motor_angle_rad - lag(wave_generator_angle_rad, 2)"})
    EXPECT_EQ(load_leak(spec_of({input})), input);
}

TEST(LoadLeak, IsRefusedWithAdvice) {
  const Dataset dataset = with_load(kExactLoad);
  const FeatureSpec features =
      resolve_inputs(dataset, {"spring_deflection_rad", "rate(rate(joint_angle_rad))"});
  EXPECT_THAT(
      error_message([&] { (void)refuse_leak(dataset, features, false); }),
      AllOf(HasSubstr("rate(rate(joint_angle_rad))"), HasSubstr("only occurs in the deflection")));
}

}  // namespace
}  // namespace torsio
