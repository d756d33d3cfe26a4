#include "fit/narx/fit_narx_polynomial.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using Model = Narx<MultivariatePolynomial>;

const std::array<std::string, 1> kInputs{"u_1"};

/// y_k = 0.7 y_{k-1} - 0.2 y_{k-2} + 0.4 u_{k-1} + 0.15 u_{k-1}^2 - 0.05 u_k y_{k-1}^2 + e_k, measured
/// with noise.
TrainingData known_system(std::size_t samples, double disturbance, double noise,
                          std::uint64_t seed) {
  Random random(seed);
  TrainingData data{.inputs = {{"u_1"}}, .target = "y_1", .sample_rate_Hz = 50.0, .sequences = {}};
  Sequence sequence{.recording = "a",
                    .features = Matrix(samples, 1),
                    .target = std::vector<double>(samples),
                    .use = std::vector<std::uint8_t>(samples, 1)};
  std::vector<double> y(samples, 0.0);
  double u = 0.0;
  for (std::size_t n = 0; n < samples; ++n) {
    const double before = u;
    u = 0.5 * u + 0.8 * random.normal();
    sequence.features(n, 0) = u;
    if (n >= 2)
      y[n] = 0.7 * y[n - 1] - 0.2 * y[n - 2] + 0.4 * before + 0.15 * before * before -
             0.05 * u * y[n - 1] * y[n - 1] + disturbance * random.normal();
    sequence.target[n] = y[n] + noise * random.normal();
  }
  data.sequences.push_back(std::move(sequence));
  return data;
}

/// Coefficient in the channels' units of the term with these powers of u_k, u_k-1, u_k-2, y_k-1,
/// y_k-2; NaN where there is none.
double coefficient(const Model::Parameters& parameters, const std::vector<double>& powers) {
  const auto& f = parameters.model;
  for (std::size_t j = 0; j < f.powers.rows; ++j) {
    if (!std::ranges::equal(f.powers.row(j), powers)) continue;
    double value = f.coefficients[j];
    for (std::size_t i = 0; i < powers.size(); ++i) value /= std::pow(f.scales[i], powers[i]);
    return value;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

void expect_the_system(const Model::Parameters& found, double tolerance) {
  EXPECT_NEAR(coefficient(found, {0, 0, 0, 1, 0}), 0.7, tolerance);
  EXPECT_NEAR(coefficient(found, {0, 0, 0, 0, 1}), -0.2, tolerance);
  EXPECT_NEAR(coefficient(found, {0, 1, 0, 0, 0}), 0.4, tolerance);
  EXPECT_NEAR(coefficient(found, {0, 2, 0, 0, 0}), 0.15, tolerance);
  EXPECT_NEAR(coefficient(found, {1, 0, 0, 2, 0}), -0.05, tolerance);
}

TEST(FitNarxPolynomial, FindsTermsAndCoefficientsOfAKnownSystemUnderADisturbance) {
  const auto fitted = fit_narx_polynomial(known_system(4000, 0.05, 0.0, 1),
                                          {.terms = 5, .training = NarxTraining::one_step});
  expect_the_system(fitted.parameters, 0.01);
}

TEST(FitNarxPolynomial, FindsTheNumberOfTermsByItself) {
  const auto fitted = fit_narx_polynomial(known_system(4000, 0.0, 0.0, 2), {});
  EXPECT_EQ(fitted.parameters.model.powers.rows, 5U);
  expect_the_system(fitted.parameters, 1e-9);
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("5 of 56 terms, the number by the free run "
                                                        "on a fifth held out")));
}

TEST(FitNarxPolynomial, IsBiasedByNoiseOfTheSensorUntilItIsRefined) {
  const TrainingData data = known_system(6000, 0.0, 0.1, 3);
  const auto error = [&](NarxTraining training) {
    const auto fitted = fit_narx_polynomial(data, {.terms = 5, .training = training});
    return std::abs(coefficient(fitted.parameters, {0, 0, 0, 1, 0}) - 0.7);
  };
  EXPECT_GT(error(NarxTraining::one_step), 0.03);
  EXPECT_LT(error(NarxTraining::free_run), 0.01);
}

TEST(FitNarxPolynomial, ReportsItsEquationAndWhatEachTermExplains) {
  TrainingData data = known_system(4000, 0.0, 0.0, 4);
  const auto fitted = fit_narx_polynomial(data, {.terms = 5});
  const std::string equation = equation_of(fitted.parameters, kInputs, "y_1");
  EXPECT_THAT(equation, HasSubstr("y_1[k] = "));
  EXPECT_THAT(equation, HasSubstr("0.7 y_1[k-1]"));
  EXPECT_THAT(equation, HasSubstr("- 0.2 y_1[k-2]"));
  EXPECT_THAT(equation, HasSubstr("0.15 u_1[k-1]^2"));
  EXPECT_THAT(equation, HasSubstr("- 0.05 u_1[k] y_1[k-1]^2"));
  EXPECT_THAT(fitted.notes, testing::Contains(equation));
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("error reduction one step ahead in %")));
}

TEST(FitNarxPolynomial, ShortensExpressionsInItsEquation) {
  Model::Parameters parameters{
      .model = {.scales = {2.0, 1.0}, .powers = Matrix(2, 2), .coefficients = {-4.0, 0.5}},
      .inputs = 1};
  parameters.model.powers.values = {2.0, 0.0, 0.0, 0.0};
  const std::array<std::string, 1> inputs{"a_rad - b_rad"};
  EXPECT_EQ(equation_of(parameters, inputs, "y_1"),
            "y_1[k] = -1 u1[k]^2 + 0.5, u1 = a_rad - b_rad");
}

TEST(FitNarxPolynomial, ConstantAndDoubledInputsAreNoTerms) {
  TrainingData data = known_system(3000, 0.05, 0.0, 5);
  Sequence& sequence = data.sequences[0];
  const Matrix one = sequence.features;
  data.inputs = {{"u_1"}, {"same_1"}, {"support_m"}};
  sequence.features = Matrix(one.rows, 3);
  for (std::size_t n = 0; n < one.rows; ++n) {
    sequence.features(n, 0) = one(n, 0);
    sequence.features(n, 1) = one(n, 0);
    sequence.features(n, 2) = 0.033;
  }
  const auto fitted = fit_narx_polynomial(data, {.terms = 5, .training = NarxTraining::one_step});
  for (std::size_t j = 0; j < 5; ++j)
    for (const std::size_t of_others : {1U, 2U, 4U, 5U, 7U, 8U})
      EXPECT_EQ(fitted.parameters.model.powers(j, of_others), 0.0);
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("support_m is constant")));
}

TEST(FitNarxPolynomial, HoldsOutWholeRecordsOfMany) {
  TrainingData data = known_system(600, 0.02, 0.0, 6);
  for (std::uint64_t seed = 7; seed < 12; ++seed)
    data.sequences.push_back(known_system(600, 0.02, 0.0, seed).sequences[0]);
  const auto fitted = fit_narx_polynomial(data, {});
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("on a fifth held out")));
  const auto shorter = fit_narx_polynomial(known_system(600, 0.02, 0.0, 6), {});
  EXPECT_THAT(shorter.notes, testing::Contains(HasSubstr("too short to hold any out")));
}

TEST(FitNarxPolynomial, NoiseIsOfTheSeedAndAFitOfTheData) {
  const TrainingData data = known_system(1000, 0.05, 0.0, 8);
  const auto fit = [&](NarxTraining training, std::uint64_t seed) {
    return fit_narx_polynomial(data, {.training = training}, {.seed = seed}).parameters;
  };
  EXPECT_EQ(fit(NarxTraining::noise, 1), fit(NarxTraining::noise, 1));
  EXPECT_NE(fit(NarxTraining::noise, 1), fit(NarxTraining::noise, 2));
  EXPECT_EQ(fit(NarxTraining::free_run, 1), fit(NarxTraining::free_run, 2));
}

TEST(FitNarxPolynomial, RefusesWhatItCannotDo) {
  const TrainingData data = known_system(300, 0.05, 0.0, 9);
  const auto message = [&](const NarxPolynomialOptions& options) {
    return test::error_message([&] { (void)fit_narx_polynomial(data, options); });
  };
  EXPECT_THAT(message({.lags = {.inputs = 2, .outputs = 400}, .degree = 1}),
              HasSubstr("longer than the lags of 400 samples"));
  EXPECT_THAT(message({.lags = {.inputs = 100, .outputs = 100}}), HasSubstr("Set degree=2"));
  EXPECT_THAT(
      test::error_message([] { (void)fit_narx_polynomial(known_system(40, 0.05, 0.0, 9), {}); }),
      HasSubstr("one of more than 50 samples of y_1, found 40"));
  EXPECT_THAT(message({.terms = 61}), HasSubstr("at least 305"));
  EXPECT_THROW((void)fit_narx_polynomial(data, {.lags = {.inputs = 0, .outputs = 0}}), UsageError);
  EXPECT_THROW((void)fit_narx_polynomial(data, {.degree = 0}), UsageError);
  TrainingData constant = data;
  for (double& value : constant.sequences[0].target) value = 1.0;
  EXPECT_THROW((void)fit_narx_polynomial(constant, {}), Error);
}

}  // namespace
}  // namespace torsio
