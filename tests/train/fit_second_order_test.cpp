#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/train/fit_dynamic_bouc_wen.hpp"
#include "torsio/train/fit_friction_drive.hpp"
#include "torsio/train/initial_state.hpp"

namespace torsio {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// A sum of sines with phases of its own.
std::vector<double> multisine(std::size_t samples, double rate_Hz, double lowest_Hz,
                              double highest_Hz, double amplitude) {
  constexpr int kSines = 20;
  Random random(3);
  std::vector<double> force(samples, 0.0);
  for (int i = 0; i < kSines; ++i) {
    const double turn =
        6.283185307179586 * (lowest_Hz + (highest_Hz - lowest_Hz) * i / kSines) / rate_Hz;
    const double phase = 6.283185307179586 * random.uniform();
    for (std::size_t n = 0; n < samples; ++n)
      force[n] += amplitude / std::sqrt(kSines) * std::sin(turn * static_cast<double>(n) + phase);
  }
  return force;
}

template <class M>
TrainingData recorded(M model, const std::vector<double>& force, double noise) {
  Random random(5);
  TrainingData data;
  data.inputs = {{.expression = "force_N"}};
  data.target = "position_m";
  data.sample_rate_Hz = 1.0 / model.sample_period();
  Sequence sequence{.recording = "bench", .features = Matrix(force.size(), 1)};
  sequence.features.values = force;
  for (const double each : force)
    sequence.target.push_back(model.step({&each, 1}).value + noise * random.normal());
  sequence.use.assign(force.size(), 1);
  data.sequences.push_back(std::move(sequence));
  return data;
}

DynamicBoucWen hysteretic(double exponent = 1.0) {
  return DynamicBoucWen({.mass = 2.0,
                         .damping = 10.0,
                         .stiffness = 5e4,
                         .hysteretic_stiffness = 5e4,
                         .loss = exponent == 1.0 ? 800.0 : 60.0,
                         .skew = exponent == 1.0 ? -1100.0 : -20.0,
                         .exponent = exponent,
                         .time = {.sample_period_s = 1.0 / 750.0, .substeps = 4},
                         .lowest = -1.0,
                         .highest = 1.0});
}

FrictionDrive carriage(double quadratic = 0.0) {
  return FrictionDrive({.inertia = 95.0,
                        .viscous = 200.0,
                        .coulomb = 20.0,
                        .offset = -3.0,
                        .viscous_quadratic = quadratic,
                        .time = {.sample_period_s = 1e-3},
                        .lowest = -10.0,
                        .highest = 10.0});
}

TrainingData carriage_record(double quadratic = 0.0) {
  std::vector<double> force = multisine(6000, 1000.0, 0.3, 3.0, 60.0);
  for (double& each : force) each -= 3.0;
  return recorded(carriage(quadratic), force, 1e-6);
}

TEST(FitDynamicBoucWen, FindsWhatMadeTheRecordWithinItsErrorBars) {
  const TrainingData data = recorded(hysteretic(), multisine(4000, 750.0, 5.0, 100.0, 60.0), 5e-6);
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

TEST(FitDynamicBoucWen, FindsTheExponentIfAsked) {
  const TrainingData data =
      recorded(hysteretic(1.5), multisine(4000, 750.0, 5.0, 100.0, 60.0), 1e-7);
  const auto fitted = fit_dynamic_bouc_wen(data, {.exponent = NAN});
  EXPECT_NEAR(fitted.parameters.exponent, 1.5, 0.05);
}

TEST(FitDynamicBoucWen, SaysWhichParametersTheRecordCannotTell) {
  // Without hysteresis in the record: a spring is a spring, whichever of the two carries it.
  auto parameters = hysteretic().parameters();
  parameters.loss = parameters.skew = 0.0;
  const TrainingData data =
      recorded(DynamicBoucWen(parameters), multisine(2000, 750.0, 5.0, 100.0, 60.0), 0.0);
  const auto fitted = fit_dynamic_bouc_wen(data, {});
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("the data cannot tell")));
  EXPECT_TRUE(std::isnan(fitted.table[2].std_error));
}

TEST(FitDynamicBoucWen, SaysWhyItCannotFit) {
  const std::vector<double> force = multisine(1500, 750.0, 5.0, 100.0, 60.0);
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
                for (double& y : data.sequences[0].target) y = -y;
              }),
              testing::AnyOf(HasSubstr("Check the signs"), HasSubstr("no convergence"), ""));
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

TEST(FitFrictionDrive, FindsWhatMadeTheRecord) {
  const auto fitted = fit_friction_drive(carriage_record(), {});
  EXPECT_NEAR(fitted.parameters.inertia, 95.0, 0.3);
  EXPECT_NEAR(fitted.parameters.viscous, 200.0, 2.0);
  EXPECT_NEAR(fitted.parameters.coulomb, 20.0, 0.2);
  EXPECT_NEAR(fitted.parameters.offset, -3.0, 0.05);
  EXPECT_EQ(fitted.table.size(), 4U);
  EXPECT_EQ(fitted.table[1].unit, "N s/m");
}

TEST(FitFrictionDrive, ScalesEverythingByTheGain) {
  const auto plain = fit_friction_drive(carriage_record(), {}).parameters;
  const auto scaled = fit_friction_drive(carriage_record(), {.gain = 2.0}).parameters;
  EXPECT_NEAR(scaled.inertia, 2.0 * plain.inertia, 0.01 * plain.inertia);
  EXPECT_NEAR(scaled.coulomb, 2.0 * plain.coulomb, 0.02 * plain.coulomb);
}

TEST(FitFrictionDrive, ChoosesATermThatIsThereAndNoneThatIsNot) {
  const auto with = fit_friction_drive(carriage_record(300.0), {.terms = "auto"});
  EXPECT_GT(with.parameters.viscous_quadratic, 200.0);
  EXPECT_THAT(with.notes, Contains(HasSubstr("chosen terms: quadratic")));
}

TEST(FitFrictionDrive, SaysWhyItCannotFit) {
  EXPECT_THAT(test::error_message(
                  [] { (void)fit_friction_drive(carriage_record(), {.terms = "lugre+stribek"}); }),
              testing::AllOf(HasSubstr("stribek"), HasSubstr("Did you mean")));
  TrainingData backward = carriage_record();
  for (double& y : backward.sequences[0].target) y = -y;
  EXPECT_THAT(test::error_message([&] { (void)fit_friction_drive(backward, {}); }),
              HasSubstr("accelerates the target in its own direction"));
}

TEST(InitialState, OfAMassOnAHystereticSpringIsFoundFromItsFirstSamples) {
  DynamicBoucWen model = hysteretic();
  const std::vector<double> start{4e-4, 0.06, 15.0};
  model.set_state(start);
  const TrainingData data = recorded(model, multisine(50, 750.0, 5.0, 100.0, 60.0), 0.0);
  AnyModel found(hysteretic());
  start_where_measured(found, data.sequences[0].features, data.sequences[0].target);
  ASSERT_EQ(found.state().size(), 3U);
  EXPECT_NEAR(found.state()[0], start[0], 1e-7);
  EXPECT_NEAR(found.state()[1], start[1], 1e-4);
  EXPECT_NEAR(found.state()[2], start[2], 0.1);
}

TEST(InitialState, OfADriveIsItsPositionAndSpeed) {
  FrictionDrive model = carriage();
  model.set_state(std::vector<double>{0.2, -0.05, 0.0});
  const TrainingData data = recorded(model, std::vector<double>(50, 10.0), 0.0);
  AnyModel found(carriage());
  start_where_measured(found, data.sequences[0].features, data.sequences[0].target);
  EXPECT_NEAR(found.state()[0], 0.2, 1e-5);
  EXPECT_NEAR(found.state()[1], -0.05, 1e-3);
}

}  // namespace
}  // namespace torsio
