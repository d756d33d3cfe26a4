#include "torsio/fit/train_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

TEST(TrainModel, TakesTheZerosOfTheTrainingRecords) {
  Dataset dataset = test::bench_dataset();
  std::swap(dataset.records[0], dataset.records[2]);  // the first is for the test
  for (const std::size_t i : {1, 2})
    dataset.records[i].recording.zeros = {{.channel = "gear_angle_rad", .first_s = 0.1}};
  const ModelChoice choice{.family = "linear", .features = resolve_inputs(dataset, {})};
  const TrainedModel trained = train_model(dataset, choice, 1);
  EXPECT_EQ(trained.file.card.zeros, dataset.records[1].recording.zeros);
  EXPECT_EQ(trained.file.settings.zeroed_channels, std::vector<std::string>{"gear_angle_rad"});

  dataset.records[2].recording.zeros[0].channel = "joint_angle_rad";
  const std::string message = test::error_message([&] { (void)train_model(dataset, choice, 1); });
  EXPECT_NE(message.find("first: zero"), std::string::npos) << message;
  dataset.records[2].recording.zeros.clear();
  EXPECT_THROW((void)train_model(dataset, choice, 1), Error);
}

TEST(TrainModel, TakesTheLargestUncertaintyOfTheTargetThatATrainingRecordStates) {
  Dataset dataset = test::bench_dataset();  // the last one is for the test
  const ModelChoice choice{.family = "linear", .features = resolve_inputs(dataset, {})};
  const ModelFile plain = train_model(dataset, choice, 1).file;
  EXPECT_FALSE(plain.settings.target_uncertainty.is_stated());
  dataset.records[0].recording.uncertainties = {{"torque_Nm", {.constant = 0.2, .relative = 0.01}},
                                                {"gear_angle_rad", {.constant = 9.0}}};
  dataset.records[2].recording.uncertainties = {{"torque_Nm", {.constant = 7.0}}};
  TrainedModel trained = train_model(dataset, choice, 1);
  EXPECT_EQ(trained.file.settings.target_uncertainty,
            (SensorUncertainty{.constant = 0.2, .relative = 0.01}));
  EXPECT_EQ(
      trained.notes.front(),
      "the error bars contain the error of the reference sensor as it was stated, sqrt((0.2 Nm)^2 "
      "+ (1 % of the value)^2) (standard uncertainty); 1 of 2 recordings state none");
  EXPECT_EQ(trained.notes.at(1),
            "the uncertainty of gear_angle_rad has no effect on the error bars: only that of the "
            "target, torque_Nm has one");
  dataset.records[1].recording.uncertainties = {{"torque_Nm", {.constant = 0.3}}};
  trained = train_model(dataset, choice, 1);
  EXPECT_EQ(trained.file.settings.target_uncertainty,
            (SensorUncertainty{.constant = 0.3, .relative = 0.01}));
  EXPECT_NE(trained.notes.front().find(", the largest of the recordings"), std::string::npos);
  EXPECT_EQ(trained.file.settings.residuals.std_dev, plain.settings.residuals.std_dev)
      << "a term of its own";
  dataset.load_target = {.file = "load.yaml", .computed_from = {"joint_angle_rad"}};
  EXPECT_FALSE(train_model(dataset, choice, 1).file.settings.target_uncertainty.is_stated())
      << "the error of a known load is in the residuals";
}

TEST(TrainModel, StatesWhyErrorBarsOfFewRecordingsAreWider) {
  Dataset dataset = test::bench_dataset();
  const ModelChoice choice{.family = "linear_coulomb", .features = resolve_inputs(dataset, {})};
  const auto notes = [&] {
    std::string text;
    for (const std::string& note : train_model(dataset, choice, 1).notes) text += note + "\n";
    return text;
  };
  const std::string of_two = notes();
  EXPECT_NE(of_two.find("the error bars are 1.3 times as wide as the training shows: two "
                        "recordings do not determine"),
            std::string::npos)
      << of_two;
  dataset.records.erase(dataset.records.begin());
  EXPECT_NE(notes().find("the error bars are 1.4 times as wide"), std::string::npos) << notes();
  dataset.records.back().segments.front().role = Role::validation;
  EXPECT_EQ(notes().find("times as wide"), std::string::npos) << notes();
}

TEST(TrainModel, RecordsTheEpochsOfANetworkAndNoneOfAnotherFamily) {
  const Dataset dataset = test::bench_dataset();
  const FeatureSpec inputs = resolve_inputs(dataset, {});
  const TrainedModel network = train_model(
      dataset,
      {.family = "mlp", .options = {{"epochs", "4"}, {"patience", "0"}}, .features = inputs}, 1);
  ASSERT_GE(network.history.size(), 4U);
  for (std::size_t k = 0; k < network.history.size(); ++k) {
    EXPECT_EQ(network.history[k].epoch, k % 4 + 1) << "each start has four epochs";
    EXPECT_GT(network.history[k].training_error, 0.0);
    EXPECT_GT(network.history[k].held_out_error, 0.0);
  }
  EXPECT_LT(network.history[3].training_error, network.history[0].training_error);
  EXPECT_TRUE(train_model(dataset, {.family = "linear", .features = inputs}, 1).history.empty());
}

TEST(TrainModel, RefusesAnInverseWhoseTargetIsOffByUnknownZeros) {
  Dataset dataset = test::bench_dataset();
  dataset.target = "spring_deflection_rad";
  for (DatasetRecord& record : dataset.records) {
    std::vector<double> deflection_rad = record.recording.channel("gear_angle_rad").values;
    const std::vector<double>& joint_rad = record.recording.channel("joint_angle_rad").values;
    for (std::size_t i = 0; i < deflection_rad.size(); ++i) deflection_rad[i] -= joint_rad[i];
    record.recording.add({.name = "spring_deflection_rad", .values = std::move(deflection_rad)});
    record.recording.zeros = {{.channel = "gear_angle_rad", .first_s = 0.1}};
  }
  const auto refusal = [&](const std::vector<std::string>& inputs) {
    const ModelChoice choice{.family = "linear", .features = resolve_inputs(dataset, inputs)};
    return test::error_message([&] { (void)train_model(dataset, choice, 1); });
  };
  EXPECT_NE(refusal({"torque_Nm"}).find("a zero: rule for gear_angle_rad"), std::string::npos);
  EXPECT_EQ(refusal({"lowpass(joint_angle_rad, 10Hz)"}), "") << "no inverse";
}

/// One recording of an input and the torque, all of it for training.
Dataset dataset_of(const std::string& input, double rate_Hz, std::vector<double> values,
                   std::vector<double> torque_Nm) {
  Recording recording("own", rate_Hz);
  recording.add({.name = input, .values = std::move(values)});
  recording.add({.name = "torque_Nm", .values = std::move(torque_Nm)});
  Dataset dataset;
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  return dataset;
}

/// A ramp with small reversals: its last third is beyond the other two.
Dataset dataset_that_never_returns() {
  std::vector<double> deflection_rad;
  std::vector<double> torque_Nm;
  for (int n = 0; n < 1500; ++n) {
    deflection_rad.push_back(1e-4 * n + 1e-3 * std::sin(0.2 * n));
    torque_Nm.push_back(200.0 * deflection_rad.back() + 0.3 * std::cos(0.2 * n));
  }
  return dataset_of("spring_deflection_rad", 100.0, std::move(deflection_rad),
                    std::move(torque_Nm));
}

TEST(TrainModel, AMotionThatNeverReturnsIsRefusedWithAModelThatCanBeTrained) {
  const Dataset dataset = dataset_that_never_returns();
  const auto refusal = [&](const char* model) {
    const auto choices = model_choices(dataset, model, {"spring_deflection_rad"});
    return test::error_message([&] { (void)train_model(dataset, choices.front(), 1); });
  };
  const std::string message = refusal("maxwell_slip");
  EXPECT_NE(message.find("comes back to where it was"), std::string::npos) << message;
  constexpr const char* kAdvised = "polynomial:branch=false";
  EXPECT_NE(message.find(kAdvised), std::string::npos) << message;
  EXPECT_EQ(refusal(kAdvised), "");
}

/// A joint that is driven at ten speeds, each for two seconds.
TEST(TrainModel, ConstantSpeedsDetermineFriction) {
  std::vector<double> speed_rad_s;
  std::vector<double> torque_Nm;
  for (const double speed : {0.2, 0.4, 0.8, 1.2, 2.0, -0.2, -0.4, -0.8, -1.2, -2.0})
    for (int n = 0; n < 100; ++n) {
      speed_rad_s.push_back(speed + 0.002 * std::sin(1.7 * n));
      torque_Nm.push_back(0.52 * speed + std::copysign(0.57, speed) + 0.02 * std::sin(2.9 * n));
    }
  const Dataset dataset =
      dataset_of("joint_speed_rad_s", 50.0, std::move(speed_rad_s), std::move(torque_Nm));
  const auto row_of = [&](const char* model, const char* name) {
    const auto choices = model_choices(dataset, model, {"joint_speed_rad_s"});
    const TrainedModel trained = train_model(dataset, choices.front(), 1);
    const auto row = std::ranges::find_if(
        trained.table, [&](const auto& each) { return each.name.starts_with(name); });
    return row == trained.table.end() ? kNotMeasured : row->value;
  };
  EXPECT_NEAR(row_of("linear_coulomb:rates=true", "c ("), 0.57, 0.02);
  EXPECT_NEAR(row_of("linear_coulomb:rates=true", "k1 ("), 0.52, 0.02);
}

}  // namespace
}  // namespace torsio
