#include "torsio/fit/transfer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fit/common/model_run.hpp"
#include "fit/transfer/refit.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/linear/linear.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using test::BenchOptions;
using testing::HasSubstr;

const std::vector<std::string> kFamilies{"linear", "grey_box", "dgmm", "mlp", "lstm", "gru"};

std::map<std::string, std::string> small(const std::string& family) {
  if (family == "grey_box") return {{"residual", "none"}};
  if (family == "dgmm") return {{"components", "40"}, {"em_iterations", "2"}};
  if (family == "mlp") return {{"epochs", "20"}, {"layers", "8"}};
  if (family == "lstm" || family == "gru") return {{"epochs", "2"}, {"layers", "4"}};
  return {};
}

ModelFile base_model(const std::string& family, const BenchOptions& bench = {}) {
  return train_model(test::one_recording(bench),
                     {.family = family,
                      .options = small(family),
                      .features = {.inputs = {"spring_deflection_rad",
                                              "lowpass(rate(spring_deflection_rad), 10Hz)"},
                                   .definitions = {{"spring_deflection_rad",
                                                    "gear_angle_rad - joint_angle_rad"}}}},
                     1)
      .file;
}

std::vector<double> estimates(const ModelFile& file, const Recording& recording) {
  std::vector<double> values;
  Estimator estimator = make_estimator(file);
  std::vector<double> raw(estimator.raw_inputs().size());
  for (std::size_t n = 0; n < recording.size(); ++n) {
    for (std::size_t k = 0; k < raw.size(); ++k)
      raw[k] = recording.channel(estimator.raw_inputs()[k]).values[n];
    values.push_back(estimator.step(raw).value);
  }
  return values;
}

Recording with_scaled_deflection(const Recording& recording, double scale) {
  Recording scaled(recording.name(), recording.sample_rate_Hz());
  for (Channel channel : recording.channels()) {
    if (channel.name == "gear_angle_rad" || channel.name == "joint_angle_rad")
      for (double& value : channel.values) value *= scale;
    scaled.add(std::move(channel));
  }
  return scaled;
}

double rmse_of(const ModelFile& file, const Dataset& dataset) {
  const Recording& recording = dataset.records[0].recording;
  const std::vector<double> values = estimates(file, recording);
  const std::vector<double>& target = recording.channel("torque_Nm").values;
  double sum = 0.0;
  for (std::size_t n = 100; n < values.size(); ++n) sum += std::pow(values[n] - target[n], 2);
  return std::sqrt(sum / static_cast<double>(values.size() - 100));
}

class MappedFamily : public testing::TestWithParam<std::string> {};

TEST_P(MappedFamily, IsTheBaseOfScaledInputsWithGainAndOffset) {
  const ModelFile base = base_model(GetParam());
  const TransferMap map{.input_scale = 0.5, .gain = 3.0, .offset = -2.0};
  const ModelFile file = mapped(base, map);
  const Recording recording = test::one_recording({.seed = 9}).records[0].recording;
  const std::vector<double> whole = estimates(base, recording);
  const std::vector<double> doubled = estimates(file, with_scaled_deflection(recording, 2.0));
  ASSERT_GT(whole.size(), 200U);
  for (std::size_t n = 200; n < whole.size(); ++n)
    ASSERT_NEAR(doubled[n], 3.0 * whole[n] - 2.0, 1e-4 * (1.0 + std::abs(doubled[n]))) << n;
  EXPECT_EQ(file.settings.fallback.residual_std, 3.0 * base.settings.fallback.residual_std);
}

TEST_P(MappedFamily, ComesCloserToANewJointThanTheBase) {
  const ModelFile base = base_model(GetParam());
  const Dataset joint =
      test::one_recording({.stiffness_Nm_rad = 250.0, .offset_Nm = 2.0, .seed = 4});
  const TransferResult result = transfer_model(base, joint);
  ASSERT_EQ(result.trials.size(), 5U) << "none, offset, gain_offset, scaled, refit";
  const double before = rmse_of(base, joint);
  const double after = rmse_of(result.best().file, joint);
  EXPECT_LT(after, 0.5 * before);
  EXPECT_LE(result.best().held_out_rmse, result.trials[0].held_out_rmse);
}

INSTANTIATE_TEST_SUITE_P(Families, MappedFamily, testing::ValuesIn(kFamilies),
                         [](const auto& of) { return of.param; });

TEST(Transfer, TheUncertaintyOfTheTargetIsThatOfTheNewRecordings) {
  ModelFile base = base_model("linear");
  base.settings.target_uncertainty = {.constant = 0.5, .relative = 0.02};
  EXPECT_EQ(mapped(base, {.gain = 3.0}).settings.target_uncertainty,
            (SensorUncertainty{.constant = 1.5, .relative = 0.02}));
  Dataset joint = test::one_recording({.seed = 4});
  EXPECT_EQ(transfer_model(base, joint, {.method = TransferMethod::none})
                .best()
                .file.settings.target_uncertainty,
            base.settings.target_uncertainty);
  const SensorUncertainty stated{.constant = 0.1, .relative = 0.003};
  joint.records[0].recording.uncertainties = {{"torque_Nm", stated}};
  for (const TransferTrial& each : transfer_model(base, joint).trials)
    EXPECT_EQ(each.file.settings.target_uncertainty, stated) << name(each.method);
}

TEST(Transfer, TheOffsetIsTheMeanErrorOfTheFirstSamples) {
  const ModelFile base = base_model("linear");
  const Dataset joint = test::one_recording({.offset_Nm = 5.0, .friction_Nm = 0.0, .seed = 4});
  const TransferResult result =
      transfer_model(base, joint, {.method = TransferMethod::offset, .offset_samples = 100});
  ASSERT_EQ(result.trials.size(), 1U);
  EXPECT_EQ(result.best().map.gain, 1.0);
  EXPECT_EQ(result.best().map.input_scale, 1.0);
  EXPECT_NEAR(result.best().map.offset, 5.0, 0.6);
}

TEST(Transfer, DataSheetsGiveScaleAndGain) {
  const ModelFile base = base_model("linear", {.friction_Nm = 0.0, .noise_Nm = 0.0});
  const Dataset joint = test::one_recording(
      {.stiffness_Nm_rad = 250.0, .friction_Nm = 0.0, .noise_Nm = 0.0, .seed = 4});
  const TransferResult result =
      transfer_model(base, joint,
                     {.method = TransferMethod::data_sheets,
                      .ratios = TransferRatios{.stiffness = 0.5, .torque = 0.25}});
  EXPECT_DOUBLE_EQ(result.best().map.input_scale, 2.0);
  EXPECT_DOUBLE_EQ(result.best().map.gain, 0.25);
  EXPECT_LT(rmse_of(result.best().file, joint), 0.01);
  const TransferRatios ratios = transfer_ratios(data_sheet("dfki-300"), data_sheet("dfki-120"));
  EXPECT_NEAR(ratios.stiffness, 19.8 / 39.3, 1e-12);
  EXPECT_DOUBLE_EQ(ratios.torque, 0.4);
}

TEST(Transfer, ARefitKeepsSlipForcesPositive) {
  const ModelFile base =
      train_model(test::one_recording({.friction_Nm = 0.3}),
                  {.family = "grey_box",
                   .options = {{"residual", "none"}, {"passive", "true"}},
                   .features = {.inputs = {"gear_angle_rad - joint_angle_rad"}, .definitions = {}}},
                  1)
          .file;
  // Without friction the least squares alone would make some of them negative.
  const Dataset joint =
      test::one_recording({.stiffness_Nm_rad = 300.0, .friction_Nm = 0.0, .seed = 8});
  const TransferResult result = transfer_model(base, joint, {.method = TransferMethod::refit});
  const auto& box = result.best().file.parameters.get<GreyBox::Parameters>();
  for (std::size_t j = box.terms.first_slip(); j < box.terms.first_slope(); ++j)
    EXPECT_GE(box.coefficients.values(0, j), 0.0);
}

TEST(Refitted, ScalesStiffnessAndFrictionBeyondTheNewMotion) {
  const ModelFile base =
      train_model(test::one_recording({.friction_Nm = 1.0}),
                  {.family = "grey_box",
                   .options = {{"residual", "none"}},
                   .features = {.inputs = {"gear_angle_rad - joint_angle_rad"}, .definitions = {}}},
                  1)
          .file;
  // Stiffness and friction differ by different factors; the motion is two thirds of that of the base.
  test::BenchOptions joint{
      .stiffness_Nm_rad = 540.0, .friction_Nm = 1.6, .amplitude_rad = 0.02, .seed = 8};
  const auto data = [&] {
    return training_data(test::one_recording(joint), base.settings.features);
  };
  constexpr double kStrong = 0.1;
  const AnyModel refit(refitted(base.parameters, base.settings.ranges, data(), kStrong));
  joint.amplitude_rad = 0.03;
  // With a prior around the base itself it is 0.63.
  EXPECT_LT(evaluate(refit, data()).rmse, 0.55 * evaluate(AnyModel(base.parameters), data()).rmse);
}

TEST(Transfer, ARefitKeepsTheFrictionOfARatePositive) {
  const std::map<std::string, std::string> passive{{"residual", "none"}, {"passive", "true"}};
  const FeatureSpec features{
      .inputs = {"gear_angle_rad - joint_angle_rad", "rate(gear_angle_rad - joint_angle_rad)"},
      .definitions = {}};
  const ModelFile base =
      train_model(test::one_recording({.friction_Nm = 0.3}),
                  {.family = "grey_box", .options = passive, .features = features}, 1)
          .file;
  // A torque that drives the motion: less than that of the spring where it moves upwards.
  Dataset joint = test::one_recording({.stiffness_Nm_rad = 300.0, .friction_Nm = 0.0, .seed = 8});
  const Recording given = joint.records[0].recording;
  Recording driven(given.name(), given.sample_rate_Hz());
  const std::vector<double>& gear = given.channel("gear_angle_rad").values;
  for (Channel channel : given.channels()) {
    if (channel.name == "torque_Nm")
      for (std::size_t n = 1; n < gear.size(); ++n)
        channel.values[n] -= 2.0 * std::tanh(1e3 * (gear[n] - gear[n - 1]) / 0.01);
    driven.add(std::move(channel));
  }
  joint.records[0].recording = std::move(driven);
  const TransferResult result = transfer_model(base, joint, {.method = TransferMethod::refit});
  const auto& before = base.parameters.get<GreyBox::Parameters>();
  const auto& box = result.best().file.parameters.get<GreyBox::Parameters>();
  for (const std::size_t j : {box.terms.first_slope() + 1, box.terms.first_coulomb() + 1}) {
    EXPECT_GE(before.coefficients.values(0, j), 0.0);
    EXPECT_GE(box.coefficients.values(0, j), 0.0);
  }
}

TEST(Transfer, RefusesATorqueThatCannotBeThatOfTheJoint) {
  const ModelFile base = base_model("linear");
  const auto refusal = [&](const std::function<double(std::size_t, double)>& sensor) {
    Dataset joint = test::one_recording({.stiffness_Nm_rad = 300.0, .seed = 8});
    const Recording given = joint.records[0].recording;
    Recording changed(given.name(), given.sample_rate_Hz());
    for (Channel channel : given.channels()) {
      if (channel.name == "torque_Nm")
        for (std::size_t n = 0; n < channel.values.size(); ++n)
          channel.values[n] = sensor(n, channel.values[n]);
      changed.add(std::move(channel));
    }
    joint.records[0].recording = std::move(changed);
    return test::error_message([&] { static_cast<void>(transfer_model(base, joint)); });
  };
  EXPECT_THAT(refusal([](std::size_t, double torque) { return 1000.0 * torque; }),
              HasSubstr("of another size"));
  EXPECT_THAT(refusal([](std::size_t, double torque) { return -torque; }),
              HasSubstr("the opposite sign"));
  EXPECT_THAT(refusal([](std::size_t n, double torque) { return n < 1000 ? torque : 1.0; }),
              HasSubstr("does not change in a part of the motion"));
}

TEST(Transfer, TheFileStatesTheTransferAndItsRecordings) {
  Dataset joint = test::one_recording({.stiffness_Nm_rad = 300.0, .seed = 8});
  joint.records[0].recording.source.file = "new_joint.csv";
  const ModelFile base = base_model("linear");
  const TransferResult result =
      transfer_model(base, joint, {.method = TransferMethod::gain_offset});
  const ModelCard& card = result.best().file.card;
  EXPECT_EQ(card.options.at("transfer.method"), "gain_offset");
  EXPECT_TRUE(card.options.contains("transfer.gain"));
  EXPECT_EQ(card.training_files.size(), base.card.training_files.size() + 1);
}

TEST(Transfer, ErrorBarsAreAtLeastThoseOfTheBase) {
  // New data in a small part of the range: nothing is known of the errors elsewhere.
  const ModelFile base = base_model("linear");
  Dataset joint = test::one_recording({.amplitude_rad = 0.004, .seed = 8});
  const TransferResult result = transfer_model(base, joint, {.method = TransferMethod::offset});
  const ResidualTable& before = base.settings.residuals;
  const ResidualTable& after = result.best().file.settings.residuals;
  EXPECT_NEAR(after.edges.front(), before.edges.front() + result.best().map.offset, 1e-9);
  EXPECT_GE(after.std_dev.front(), before.std_dev.front());
  EXPECT_GE(after.std_dev.back(), before.std_dev.back());
}

TEST(Transfer, TheBaseStaysAsItWas) {
  const ModelFile base = base_model("dgmm");
  const std::vector<std::byte> before = model_bytes(base);
  static_cast<void>(transfer_model(base, test::one_recording({.stiffness_Nm_rad = 250.0})));
  EXPECT_EQ(model_bytes(base), before);
}

TEST(Transfer, TheResultIsAModelFile) {
  const ModelFile base = base_model("grey_box");
  const TransferResult result = transfer_model(base, test::one_recording({.seed = 5}));
  for (const TransferTrial& trial : result.trials) {
    const std::vector<std::byte> bytes = model_bytes(trial.file);
    EXPECT_EQ(model_bytes(parse_model(bytes, "transferred")), bytes) << name(trial.method);
  }
}

TEST(Transfer, RefusesWhatItCannotUse) {
  const ModelFile base = base_model("linear");
  const Dataset joint = test::one_recording({.seed = 4});
  const auto message = [&](const ModelFile& from, const Dataset& dataset,
                           const TransferOptions& options = {}) {
    return test::error_message([&] { static_cast<void>(transfer_model(from, dataset, options)); });
  };
  EXPECT_THAT(message(base, test::one_recording({.samples = 150})), HasSubstr("at least 50"));
  Dataset dead = joint;
  Recording recording("dead", 1000.0);
  for (Channel channel : dead.records[0].recording.channels()) {
    if (channel.name == "torque_Nm") std::ranges::fill(channel.values, 1.0);
    recording.add(std::move(channel));
  }
  dead.records[0].recording = recording;
  EXPECT_THAT(message(base, dead), HasSubstr("a target that changes"));
  Dataset other = joint;
  Recording without("log", 1000.0);
  for (const Channel& channel : joint.records[0].recording.channels())
    if (channel.name != "gear_angle_rad") without.add(channel);
  other.records[0].recording = without;
  EXPECT_THAT(message(base, other), HasSubstr("gear_angle_rad"));
  EXPECT_THAT(message(base, joint, {.method = TransferMethod::data_sheets}),
              HasSubstr("rated torque of both joints"));
  EXPECT_THAT(message(base, joint, {.held_out_share = 1.0}), HasSubstr("held-out share"));
  EXPECT_THAT(message(base_model("polynomial"), joint), HasSubstr("family polynomial"));
  EXPECT_THAT(test::error_message([&] { static_cast<void>(mapped(base, {.gain = -1.0})); }),
              HasSubstr("a positive scale and gain"));
}

}  // namespace
}  // namespace torsio
