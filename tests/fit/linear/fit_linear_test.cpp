#include "fit/linear/fit_linear.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "fit/common/model_run.hpp"
#include "support/example_data.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::deflection_and_rate;
using test::oscillation;
using test::training_data_of;

using Row = std::span<const double>;

void expect_coefficients(const CoefficientSchedule& found, const std::vector<double>& expected,
                         double tolerance = 1e-9) {
  ASSERT_EQ(found.values.values.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(found.values.values[i], expected[i], tolerance * (1.0 + std::abs(expected[i])))
        << "coefficient " << i;
}

/// The example with a third input that has the value of each third of the samples.
TrainingData with_condition(const std::vector<double>& conditions,
                            const std::function<double(Row)>& target) {
  const Matrix two = oscillation(3000);
  Matrix features(two.rows, 3);
  for (std::size_t n = 0; n < two.rows; ++n) {
    std::ranges::copy(two.row(n), features.row(n).begin());
    features(n, 2) = conditions[n * conditions.size() / two.rows];
  }
  auto inputs = deflection_and_rate();
  inputs.push_back({.expression = "support_m"});
  return training_data_of(inputs, features, target);
}

TEST(FitLinear, RecoversASpringAndLeavesRatesOut) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(500),
                                     [](Row x) { return 0.7 + 350.0 * x[0]; });
  const auto fitted = fit_linear(data, {});
  expect_coefficients(fitted.parameters.coefficients, {0.7, 350.0, 0.0});
  EXPECT_EQ(fitted.parameters.coefficients.values(0, 2), 0.0);
  EXPECT_TRUE(fitted.notes.empty());
}

TEST(FitLinear, WarnsWhereSlopesOfRatesWouldReduceTheError) {
  const auto target = [](double friction) {
    return
        [friction](Row x) { return 350.0 * x[0] + friction * x[1] + 0.05 * std::sin(1e4 * x[0]); };
  };
  const auto notes_of = [&](double friction, bool rates) {
    return fit_linear(training_data_of(deflection_and_rate(), oscillation(500), target(friction)),
                      {.rates = rates})
        .notes;
  };
  const auto notes = notes_of(2.0, false);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_TRUE(notes.front().starts_with("warning: linear has no slope over rates"))
      << notes.front();
  EXPECT_NE(notes.front().find("--set rates=true"), std::string::npos) << notes.front();
  EXPECT_TRUE(notes_of(2.0, true).empty());
  EXPECT_TRUE(notes_of(0.0, false).empty());
}

TEST(FitLinear, ReportsTheStiffnessWithUnitAndError) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(500), [](Row x) {
    return 0.7 + 350.0 * x[0] + 0.01 * std::sin(1e4 * x[0]);
  });
  const auto table = fit_linear(data, {}).table;
  ASSERT_EQ(table.size(), 2U);
  EXPECT_EQ(table[1].name, "k1 (spring_deflection_rad)");
  EXPECT_EQ(table[1].unit, "Nm/rad");
  EXPECT_NEAR(table[1].value, 350.0, 3.0 * table[1].std_error);
  EXPECT_GT(table[1].std_error, 0.0);
  const auto coulomb = fit_linear_coulomb(data, {.rates = true}).table;
  ASSERT_EQ(coulomb.size(), 5U);
  EXPECT_EQ(coulomb[2].unit, "Nm/(rad/s)");
  EXPECT_EQ(coulomb[4].name, "v");
  EXPECT_EQ(coulomb[4].unit, "rad/s");
}

TEST(FitLinear, GivesRatesASlopeIfRequested) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(500),
                                     [](Row x) { return 0.7 + 350.0 * x[0] - 2.0 * x[1]; });
  expect_coefficients(fit_linear(data, {.rates = true}).parameters.coefficients,
                      {0.7, 350.0, -2.0});
}

TEST(FitLinear, LearnsOnlyFromUsableSamples) {
  auto data = training_data_of(deflection_and_rate(), oscillation(500),
                               [](Row x) { return 0.7 + 350.0 * x[0]; });
  for (std::size_t n = 0; n < 100; ++n) {
    data.sequences[0].target[n] = n % 2 == 0 ? kNotMeasured : 1e6;
    data.sequences[0].use[n] = 0;
  }
  expect_coefficients(fit_linear(data, {}).parameters.coefficients, {0.7, 350.0, 0.0});
}

TEST(FitLinear, LeavesAConstantInputOutAndReportsIt) {
  const auto data = with_condition({0.033}, [](Row x) { return 1.0 + 10.0 * x[0]; });
  const auto fitted = fit_linear(data, {});
  expect_coefficients(fitted.parameters.coefficients, {1.0, 10.0, 0.0, 0.0});
  EXPECT_EQ(fitted.notes,
            std::vector<std::string>{"input support_m is constant in the training data: no term"});
}

TEST(FitLinear, LeavesADependentInputOutAndReportsIt) {
  auto data = with_condition({0.0, 1.0}, [](Row x) { return 1.0 + 10.0 * x[0]; });
  for (std::size_t n = 0; n < data.sequences[0].features.rows; ++n)
    data.sequences[0].features(n, 2) = 3.0 - 2.0 * data.sequences[0].features(n, 0);
  const auto fitted = fit_linear(data, {});
  expect_coefficients(fitted.parameters.coefficients, {1.0, 10.0, 0.0, 0.0});
  ASSERT_EQ(fitted.notes.size(), 1U);
  EXPECT_NE(fitted.notes[0].find("depends linearly"), std::string::npos);
}

TEST(FitLinear, IsNotDisturbedByInputsOfVeryDifferentSize) {
  auto data =
      with_condition({-3e7, 1e7, 5e7}, [](Row x) { return 1.0 + 1e5 * x[0] + 1e-7 * x[2]; });
  for (std::size_t n = 0; n < data.sequences[0].features.rows; ++n)
    data.sequences[0].features(n, 0) *= 1e-5;
  expect_coefficients(fit_linear(data, {}).parameters.coefficients, {1.0, 1e10, 0.0, 1e-7}, 1e-8);
}

TEST(FitLinear, SchedulesOverACondition) {
  const auto data = with_condition(
      {0.0, 0.2, 0.45}, [](Row x) { return 1.0 + x[2] + (100.0 + 400.0 * x[2] * x[2]) * x[0]; });
  const auto fitted = fit_linear(data, {.schedule = "support_m"});
  EXPECT_EQ(fitted.parameters.coefficients.knots, (std::vector{0.0, 0.2, 0.45}));
  expect_coefficients(fitted.parameters.coefficients, {1.0, 100.0, 0.0, 0.0,  //
                                                       1.2, 116.0, 0.0, 0.0,  //
                                                       1.45, 181.0, 0.0, 0.0});
  EXPECT_TRUE(fitted.notes.empty()) << "the scheduling input has no term on purpose";
  EXPECT_LT(evaluate(Linear(fitted.parameters), data).rmse, 1e-9);
}

template <class Fit>
std::string refusal(const Fit& fit) {
  try {
    (void)fit();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(FitLinear, RefusesAScheduleItCannotFit) {
  const auto target = [](Row x) { return x[0]; };
  const auto one = with_condition({0.3}, target);
  EXPECT_THROW((void)fit_linear(one, {.schedule = "suport_m"}), UsageError);
  EXPECT_NE(refusal([&] {
              return fit_linear(one, {.schedule = "suport_m"});
            }).find("spring_deflection_rad, rate(spring_deflection_rad), support_m"),
            std::string::npos);
  EXPECT_NE(
      refusal([&] { return fit_linear(one, {.schedule = "support_m"}); }).find("found one value"),
      std::string::npos);
  EXPECT_NE(refusal([&] {
              return fit_linear(one, {.schedule = "spring_deflection_rad"});
            }).find("2 to 64 distinct values"),
            std::string::npos);
  auto few = with_condition({0.0, 1.0}, target);
  for (std::size_t n = 4; n < 1500; ++n) few.sequences[0].use[n] = 0;
  EXPECT_NE(refusal([&] {
              return fit_linear(few, {.schedule = "support_m"});
            }).find("too few training samples where support_m is 0"),
            std::string::npos);
}

TEST(FitLinear, NeedsAnInputThatIsNoRate) {
  const auto data = training_data_of({{.expression = "rate(x)", .is_rate = true}},
                                     Matrix(100, 1, 1.0), [](Row) { return 1.0; });
  EXPECT_NE(refusal([&] { return fit_linear(data, {}); }).find("--set rates=true"),
            std::string::npos);
}

TEST(FitLinearCoulomb, RecoversItsFourNumbers) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(4000), [](Row x) {
    return 0.5 + 600.0 * x[0] + 1.3 * std::tanh(x[1] / 0.07);
  });
  const auto fitted = fit_linear_coulomb(data, {});
  EXPECT_EQ(fitted.parameters.rate_feature, 1U);
  EXPECT_NEAR(fitted.parameters.rate_scale, 0.07, 1e-6);
  expect_coefficients(fitted.parameters.coefficients, {0.5, 600.0, 0.0, 1.3}, 1e-5);
  EXPECT_TRUE(fitted.notes.empty());
}

TEST(FitLinearCoulomb, TakesTheScaleThatIsGiven) {
  const auto fitted = fit_linear_coulomb(test::noisy_spring(), {.rate_scale = 0.3});
  EXPECT_EQ(fitted.parameters.rate_scale, 0.3);
}

TEST(FitLinearCoulomb, SharesOneScaleBetweenAllKnots) {
  const auto data = with_condition(
      {0.0, 1.0}, [](Row x) { return 10.0 * x[0] + (1.0 + x[2]) * std::tanh(x[1] / 0.1); });
  const auto fitted = fit_linear_coulomb(data, {.schedule = "support_m"});
  EXPECT_NEAR(fitted.parameters.rate_scale, 0.1, 1e-6);
  expect_coefficients(fitted.parameters.coefficients,
                      {0.0, 10.0, 0.0, 0.0, 1.0, 0.0, 10.0, 0.0, 0.0, 2.0}, 1e-5);
}

TEST(FitLinearCoulomb, ReportsWhenTheFrictionIsViscous) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(2000),
                                     [](Row x) { return 600.0 * x[0] + 2.0 * x[1]; });
  const auto fitted = fit_linear_coulomb(data, {});
  ASSERT_EQ(fitted.notes.size(), 2U);
  EXPECT_NE(fitted.notes[0].find("viscous"), std::string::npos);
  EXPECT_NE(fitted.notes[1].find("--set rates=true"), std::string::npos) << fitted.notes[1];
}

TEST(FitLinearCoulomb, NeedsARateThatMoves) {
  const auto target = [](Row) { return 1.0; };
  const auto none = training_data_of({{.expression = "x"}}, Matrix(100, 1, 1.0), target);
  EXPECT_NE(refusal([&] { return fit_linear_coulomb(none, {}); }).find("no input that is a rate"),
            std::string::npos);
  const auto still = training_data_of(deflection_and_rate(), Matrix(100, 2), target);
  EXPECT_NE(refusal([&] { return fit_linear_coulomb(still, {}); }).find("0 throughout"),
            std::string::npos);
}

/// A spring beside one Maxwell-slip element (specification 3.7), swept slowly: a loop that neither
/// family can hold exactly.
TrainingData hysteresis_sweep() {
  Matrix features(20000, 2);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double t = 0.001 * static_cast<double>(n);
    features(n, 0) = 0.1 * std::sin(t);
    features(n, 1) = 0.1 * std::cos(t);
  }
  double slip = 0.0;
  double before = 0.0;
  return training_data_of(deflection_and_rate(), features, [&](Row x) {
    slip = std::clamp(slip + 400.0 * (x[0] - before), -1.3, 1.3);
    before = x[0];
    return 600.0 * x[0] + slip;
  });
}

TEST(FitLinearCoulomb, BeatsLinearOnAHysteresisLoop) {
  const TrainingData data = hysteresis_sweep();
  const double linear = evaluate(Linear(fit_linear(data, {}).parameters), data).rmse;
  const double coulomb =
      evaluate(LinearCoulomb(fit_linear_coulomb(data, {}).parameters), data).rmse;
  EXPECT_LT(coulomb, 0.5 * linear);
  EXPECT_GT(coulomb, 0.01 * linear)
      << "a loop with memory is not a function of deflection and rate";
}

}  // namespace
}  // namespace torsio
