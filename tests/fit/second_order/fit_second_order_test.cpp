#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "evaluate/initial_state.hpp"
#include "fit/second_order/fit_dynamic_bouc_wen.hpp"
#include "fit/second_order/fit_rigid_drive.hpp"
#include "fit/second_order/simulation_fit.hpp"
#include "support/driven_record.hpp"
#include "support/error_message.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

using test::carriage;
using test::hysteretic;
using test::multisine;
using test::recorded;
using testing::Contains;
using testing::HasSubstr;

TrainingData carriage_record(double quadratic = 0.0, std::size_t samples = 3000) {
  std::vector<double> force = multisine(samples, 1000.0, 0.5, 4.0, 80.0);
  for (double& each : force) each -= 3.0;
  return recorded(carriage(quadratic), force, 1e-6);
}

TEST(FitDynamicBoucWen, FindsWhatMadeTheRecordWithinItsErrorBars) {
  const TrainingData data = recorded(hysteretic(), multisine(3000, 750.0, 5.0, 100.0, 60.0), 5e-6);
  const auto fitted = fit_dynamic_bouc_wen(data, {});
  const std::vector<double> truth{2.0, 10.0, 5e4, 5e4, 800.0, -1100.0};
  ASSERT_EQ(fitted.table.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const FittedParameter& each = fitted.table[i];
    EXPECT_NEAR(each.value, truth[i], 4.0 * each.std_error) << each.name;
    EXPECT_LT(each.std_error, 0.05 * std::abs(truth[i])) << each.name;
  }
  EXPECT_EQ(fitted.table[0].unit, "N s^2/m");
  EXPECT_EQ(fitted.table[4].unit, "1/m");
  EXPECT_EQ(fitted.parameters.mass, fitted.table[0].value);
}

TEST(FitDynamicBoucWen, FindsTheExponentIfRequested) {
  const TrainingData data =
      recorded(hysteretic(1.5), multisine(1500, 750.0, 5.0, 100.0, 60.0), 1e-7);
  const auto fitted = fit_dynamic_bouc_wen(data, {.exponent = NAN});
  EXPECT_NEAR(fitted.parameters.exponent, 1.5, 0.05);
}

TEST(FitDynamicBoucWen, StatesWhichParametersTheRecordDoesNotDetermine) {
  // Without hysteresis in the record: a spring is a spring, whichever of the two carries it.
  auto parameters = hysteretic().parameters();
  parameters.loss = parameters.skew = 0.0;
  const TrainingData data =
      recorded(DynamicBoucWen(parameters), multisine(2000, 750.0, 5.0, 100.0, 60.0), 0.0);
  const auto fitted = fit_dynamic_bouc_wen(data, {});
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("the data do not determine")));
  EXPECT_TRUE(std::isnan(fitted.table[2].std_error));
}

TEST(FitDynamicBoucWen, StatesWhyItCannotFit) {
  const std::vector<double> force = multisine(600, 750.0, 5.0, 100.0, 60.0);
  const TrainingData good = recorded(hysteretic(), force, 5e-6);
  const auto refused = [&](auto change, DynamicBoucWenOptions options = {}) {
    TrainingData data = good;
    change(data);
    return test::error_message([&] { (void)fit_dynamic_bouc_wen(data, options); });
  };
  EXPECT_THAT(refused([](TrainingData& data) {
                std::ranges::fill(data.sequences[0].features.values, 3.0);
              }),
              HasSubstr("a force that changes"));
  EXPECT_THAT(refused([](TrainingData& data) { std::ranges::fill(data.sequences[0].target, 3.0); }),
              HasSubstr("a target that moves"));
  EXPECT_THAT(refused([](TrainingData& data) {
                Sequence& sequence = data.sequences[0];
                sequence.features.values.resize(12);
                sequence.features.rows = 12;
                sequence.target.resize(12);
                sequence.use.resize(12);
              }),
              HasSubstr("too short to simulate"));
  EXPECT_THAT(refused([](TrainingData&) {}, {.iterations = 1}), HasSubstr("no convergence"));
}

TEST(FitRigidDrive, FindsWhatMadeTheRecord) {
  const auto fitted = fit_rigid_drive(carriage_record(), {});
  EXPECT_NEAR(fitted.parameters.inertia, 95.0, 0.3);
  EXPECT_NEAR(fitted.parameters.viscous, 200.0, 4.0);
  EXPECT_NEAR(fitted.parameters.coulomb, 20.0, 0.2);
  EXPECT_NEAR(fitted.parameters.offset, -3.0, 0.05);
  EXPECT_EQ(fitted.table.size(), 4U);
  EXPECT_EQ(fitted.table[1].unit, "N s/m");
}

TEST(FitRigidDrive, ScalesEverythingByTheGain) {
  const auto plain = fit_rigid_drive(carriage_record(), {}).parameters;
  const auto scaled = fit_rigid_drive(carriage_record(), {.gain = 2.0}).parameters;
  EXPECT_NEAR(scaled.inertia, 2.0 * plain.inertia, 0.01 * plain.inertia);
  EXPECT_NEAR(scaled.coulomb, 2.0 * plain.coulomb, 0.02 * plain.coulomb);
}

TEST(FitRigidDrive, ChoosesATermThatIsThere) {
  const auto with = fit_rigid_drive(carriage_record(300.0, 2400), {.terms = "auto"});
  EXPECT_GT(with.parameters.viscous_quadratic, 200.0);
  EXPECT_THAT(with.notes, Contains(HasSubstr("chosen terms: quadratic")));
}

/// The data of a fit for which the last third is held out.
TrainingData without_last_third(TrainingData data) {
  Sequence& sequence = data.sequences[0];
  for (std::size_t n = 2 * sequence.use.size() / 3; n < sequence.use.size(); ++n)
    sequence.use[n] = 0;
  return data;
}

TEST(FitRigidDrive, ChoosesATermWhereALastThirdIsNotUsed) {
  const auto with =
      fit_rigid_drive(without_last_third(carriage_record(300.0, 3600)), {.terms = "auto"});
  EXPECT_GT(with.parameters.viscous_quadratic, 200.0);
  EXPECT_THAT(with.notes, Contains(HasSubstr("chosen terms: quadratic")));
}

TEST(FitRigidDrive, CutsTheUsableSamplesIntoEqualBlocks) {
  const TrainingData data = without_last_third(carriage_record(0.0, 3000));
  const TrainingData blocks = in_blocks(data, 4);
  ASSERT_EQ(blocks.sequences.size(), 4U);
  std::size_t begin = 0;
  for (const Sequence& block : blocks.sequences) {
    EXPECT_EQ(std::ranges::count(block.use, 1), 500);
    EXPECT_EQ(block.target.front(), data.sequences[0].target[begin]);
    begin += block.target.size();
  }
  EXPECT_EQ(begin, 2000U);
  TrainingData none = data;
  std::ranges::fill(none.sequences[0].use, 0);
  EXPECT_TRUE(in_blocks(none, 4).sequences.empty());
}

TEST(FitRigidDrive, FindsFrictionUnderLoadAndHeating) {
  std::vector<double> force = multisine(8000, 1000.0, 0.3, 3.0, 90.0);
  RigidDrive::Parameters truth = carriage().parameters();
  truth.variable_friction =
      VariableFriction{.load_share = 0.15, .heating = 0.02, .heating_time_s = 20.0};
  const TrainingData data = recorded(RigidDrive(truth), force, 1e-7);
  const RigidDrive::Parameters load = fit_rigid_drive(data, {.terms = "load+heating"}).parameters;
  ASSERT_TRUE(load.variable_friction);
  EXPECT_NEAR(load.variable_friction->load_share, 0.15, 0.02);
  EXPECT_NEAR(load.variable_friction->heating, 0.02, 0.004);
  EXPECT_FALSE(fit_rigid_drive(data, {}).parameters.variable_friction);
}

TEST(FitRigidDrive, StatesWhyItCannotFit) {
  EXPECT_THAT(test::error_message(
                  [] { (void)fit_rigid_drive(carriage_record(), {.terms = "lugre+stribek"}); }),
              testing::AllOf(HasSubstr("stribek"), HasSubstr("Did you mean")));
  TrainingData backward = carriage_record();
  for (double& y : backward.sequences[0].target) y = -y;
  EXPECT_THAT(test::error_message([&] { (void)fit_rigid_drive(backward, {}); }),
              HasSubstr("accelerates the target in its own direction"));
}

/// Pushed by an external force that is not recorded, from a speed of 0.3 m/s on.
Recording drifting_record() {
  std::vector<double> force = multisine(4000, 1000.0, 0.5, 4.0, 80.0);
  RigidDrive drive = carriage();
  drive.set_state(std::vector<double>{0.1, 0.3, 0.0});
  std::vector<double> position;
  for (std::size_t n = 0; n < force.size(); ++n) {
    const double pushed = force[n] + 15.0 * std::sin(1e-3 * static_cast<double>(n));
    position.push_back(drive.step({&pushed, 1}).value);
  }
  Recording recording("drifting", 1000.0);
  recording.add(Channel{"force_N", std::move(force)});
  recording.add(Channel{"position_m", std::move(position)});
  return recording;
}

TEST(FitRigidDrive, EstimatesAStartFromTheFirstSamplesHoweverFarTheRunDrifts) {
  Dataset dataset;
  dataset.target = "position_m";
  Recording recording = drifting_record();
  dataset.records.push_back({recording, whole_record(recording.size(), Role::train)});
  const auto choices = model_choices(dataset, "rigid_drive", {"force_N"});
  const TrainedModel trained = train_model(dataset, choices[0], 1);
  const Channel& target = recording.channel("position_m");
  const Prediction estimate = predict(make_estimator(trained.file), recording, {&target, 50});
  const auto miss = [&](std::size_t n) {
    return std::abs(estimate.estimates[n].value - target.values[n]);
  };
  EXPECT_EQ(estimate.initialised, 50U);
  EXPECT_LT(miss(49), 2e-5);
  double largest = 0.0;
  for (std::size_t n = 50; n < recording.size(); ++n) largest = std::max(largest, miss(n));
  EXPECT_GT(largest, 5e-3);
}

TEST(InitialState, OfAMassOnAHystereticSpringIsFoundFromItsFirstSamples) {
  DynamicBoucWen model = hysteretic();
  const std::vector<double> start{4e-4, 0.06, 15.0};
  model.set_state(start);
  const TrainingData data = recorded(model, multisine(50, 750.0, 5.0, 100.0, 60.0), 0.0);
  AnyModel found(hysteretic());
  start_where_measured(found, data.sequences[0].features, data.sequences[0].target, 1e-6);
  ASSERT_EQ(found.state().size(), 3U);
  EXPECT_NEAR(found.state()[0], start[0], 1e-7);
  EXPECT_NEAR(found.state()[1], start[1], 1e-4);
  EXPECT_NEAR(found.state()[2], start[2], 0.1);
}

TEST(InitialState, OfADriveIsItsPositionAndSpeed) {
  RigidDrive model = carriage();
  model.set_state(std::vector<double>{0.2, -0.05, 0.0});
  const TrainingData data = recorded(model, std::vector<double>(50, 10.0), 0.0);
  AnyModel found(carriage());
  start_where_measured(found, data.sequences[0].features, data.sequences[0].target, 1e-6);
  EXPECT_NEAR(found.state()[0], 0.2, 1e-5);
  EXPECT_NEAR(found.state()[1], -0.05, 1e-3);
}

}  // namespace
}  // namespace torsio
