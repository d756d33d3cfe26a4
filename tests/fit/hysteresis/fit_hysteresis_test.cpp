#include "fit/hysteresis/fit_hysteresis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "fit/hysteresis/operator_data.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "support/examples/hysteresis.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// A slow wander over +-0.1 rad with its rate, long enough for many inner loops.
Matrix wander(std::size_t samples) {
  Matrix features(samples, 2);
  const auto deflection = [](double t) {
    return 0.06 * std::sin(1.1 * t) + 0.025 * std::sin(3.7 * t + 1.0) +
           0.015 * std::sin(9.1 * t + 2.0);
  };
  for (std::size_t n = 0; n < samples; ++n) {
    const double t = 0.002 * static_cast<double>(n);
    features(n, 0) = deflection(t);
    features(n, 1) = (deflection(t + 1e-4) - deflection(t - 1e-4)) / 2e-4;
  }
  return features;
}

/// The output of a model for that input, with noise.
template <class M>
TrainingData recording_of(M model, double noise = 0.0, std::size_t samples = 12000) {
  Random random(12);
  return test::training_data_of(
      test::deflection_and_rate(), wander(samples),
      [&](std::span<const double> x) { return model.step(x).value + noise * random.normal(); });
}

/// Root of the mean squared miss on another, faster and larger wander.
template <class M>
double rmse_elsewhere(M truth, M fitted) {
  double sum = 0.0;
  const Matrix features = wander(5000);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const std::vector x{0.95 * features(features.rows - 1 - n, 0),
                        -0.95 * features(features.rows - 1 - n, 1)};
    const double miss = truth.step(x).value - fitted.step(x).value;
    sum += miss * miss;
  }
  return std::sqrt(sum / static_cast<double>(features.rows));
}

TEST(FitMaxwellSlip, FindsTheElementsWhoseThresholdsItHas) {
  auto truth = test::example<MaxwellSlipModel>().parameters();
  const double half_range = [] {
    double largest = 0.0;
    double least = 0.0;
    const Matrix features = wander(12000);
    for (std::size_t n = 0; n < features.rows; ++n) {
      largest = std::max(largest, features(n, 0));
      least = std::min(least, features(n, 0));
    }
    return 0.5 * (largest - least);
  }();
  for (std::size_t i = 0; i < 5; ++i)
    truth.thresholds[i] = half_range * std::pow(128.0, -static_cast<double>(4 - i) / 4.0);
  const auto fitted =
      fit_maxwell_slip(recording_of(MaxwellSlipModel(truth)), {.thresholds = 5, .rates = true});
  ASSERT_EQ(fitted.parameters.thresholds.size(), 5U);
  const auto& expected = truth.coefficients.values.values;
  const auto& found = fitted.parameters.coefficients.values.values;
  for (std::size_t j = 0; j < expected.size(); ++j)
    EXPECT_NEAR(found[j], expected[j], 1e-6 * (1.0 + std::abs(expected[j]))) << j;
}

TEST(FitMaxwellSlip, ComesNearWithGenericThresholds) {
  const auto truth = test::example<MaxwellSlipModel>();
  const auto data = recording_of(truth, 0.05);
  const auto fitted = fit_maxwell_slip(data, {.rates = true});
  EXPECT_LT(rmse_elsewhere(truth, MaxwellSlipModel(fitted.parameters)), 0.2);
  EXPECT_GE(fitted.table.size(), 4U);
  for (const FittedParameter& each : fitted.table) {
    EXPECT_GT(each.std_error, 0.0) << each.name;
    EXPECT_EQ(each.unit, each.name == "b" ? "Nm" : "Nm/rad") << each.name;
  }
}

TEST(FitPrandtlIshlinskii, IsEquivalentToTheFitOfStops) {
  const auto truth = test::example<PrandtlIshlinskii>();
  const auto data = recording_of(truth, 0.05);
  const auto passive = fit_prandtl_ishlinskii(data, {.rates = true});
  EXPECT_LT(rmse_elsewhere(truth, PrandtlIshlinskii(passive.parameters)), 0.6);
  const auto& values = passive.parameters.coefficients.values.values;
  for (std::size_t j = 3; j < values.size(); ++j) EXPECT_LE(values[j], 0.0);
  const auto any = fit_prandtl_ishlinskii(data, {.passive = false, .rates = true});
  EXPECT_LT(rmse_elsewhere(truth, PrandtlIshlinskii(any.parameters)), 0.6);
}

TEST(FitOperators, AgainstTheSignOfFrictionNothingIsFitted) {
  TrainingData data = recording_of(test::example<MaxwellSlipModel>());
  for (double& each : data.sequences[0].target) each = -each;
  const auto fitted = fit_maxwell_slip(data, {});
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("differ in sign")));
  const auto smooth = fit_bouc_wen(data, {});
  EXPECT_THAT(smooth.notes, Contains(HasSubstr("differ in sign")));
}

TEST(FitBoucWen, FindsItsParameters) {
  const auto truth = test::example<BoucWenModel>();
  const auto fitted = fit_bouc_wen(recording_of(truth, 0.02), {.rates = true});
  const auto& p = truth.parameters();
  const auto& q = fitted.parameters;
  EXPECT_NEAR(q.stiffness, p.stiffness, 0.02 * p.stiffness);
  EXPECT_NEAR(q.elastic_share, p.elastic_share, 0.01);
  EXPECT_NEAR(q.exponent, p.exponent, 0.1);
  EXPECT_NEAR(q.gamma / q.beta, p.gamma / p.beta, 0.1);
  EXPECT_NEAR(q.bias, p.bias, 0.01);
  EXPECT_NEAR(q.slopes[1], 0.25, 0.01);
  EXPECT_LT(rmse_elsewhere(truth, BoucWenModel(q)), 0.03);
  ASSERT_EQ(fitted.table.size(), 6U);
  const double z_max = std::pow(p.beta + p.gamma, -1.0 / p.exponent);
  EXPECT_NEAR(fitted.table[0].value, z_max, 5.0 * fitted.table[0].std_error);
  EXPECT_EQ(fitted.table[4].unit, "Nm/rad");
}

TEST(FitNonlinearBacklash, FindsTheBoundariesAndTheSpringBetween) {
  const auto truth = test::example<NonlinearBacklash>();
  const auto fitted = fit_nonlinear_backlash(recording_of(truth, 0.02), {.rates = true});
  EXPECT_NEAR(fitted.parameters.stiffness, 3000.0, 60.0);
  EXPECT_LT(rmse_elsewhere(truth, NonlinearBacklash(fitted.parameters)), 0.1);
}

TEST(FitNonlinearBacklash, TheImprovedOneFindsTheGrowthByRate) {
  const auto truth = test::example<ImprovedNonlinearBacklash>();
  const auto fitted = fit_improved_nonlinear_backlash(recording_of(truth, 0.02), {});
  EXPECT_LT(rmse_elsewhere(truth, ImprovedNonlinearBacklash(fitted.parameters)), 0.3);
  EXPECT_NEAR(fitted.parameters.rate.gain, 0.1, 0.03);
  EXPECT_NEAR(fitted.parameters.rate.exponent, 0.6, 0.2);
}

TEST(FitExponentialLoading, FindsBothDecays) {
  const auto truth = test::example<ExponentialLoading>();
  const auto fitted =
      fit_exponential_loading(recording_of(truth, 0.02), {.degree = 3, .rates = true});
  EXPECT_NEAR(fitted.parameters.rising_decay, 60.0, 3.0);
  EXPECT_NEAR(fitted.parameters.falling_decay, 90.0, 4.0);
  EXPECT_LT(rmse_elsewhere(truth, ExponentialLoading(fitted.parameters)), 0.05);
}

TEST(FitImprovedPrandtlIshlinskii, FindsAsymmetryAndGrowthByRate) {
  const auto truth = test::example<ImprovedPrandtlIshlinskii>();
  const auto data = recording_of(truth, 0.02);
  const auto fitted = fit_improved_prandtl_ishlinskii(data, {.rates = true});
  const double improved = rmse_elsewhere(truth, ImprovedPrandtlIshlinskii(fitted.parameters));
  auto plain = PrandtlIshlinskii(fit_prandtl_ishlinskii(data, {.rates = true}).parameters);
  auto reference = truth;
  double sum = 0.0;
  const Matrix features = wander(5000);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double miss = reference.step(features.row(n)).value - plain.step(features.row(n)).value;
    sum += miss * miss;
  }
  EXPECT_LT(improved, 0.5 * std::sqrt(sum / static_cast<double>(features.rows)));
  for (const double weight : fitted.parameters.weights) EXPECT_LE(weight, 0.0);
}

TEST(FitOperators, UnusableSamplesMoveTheOperatorButAreNotLearnedFrom) {
  const auto truth = test::example<BoucWenModel>();
  TrainingData data = recording_of(truth);
  Sequence& sequence = data.sequences[0];
  for (std::size_t n = 0; n < sequence.target.size(); ++n)
    if (n % 500 < 250) {
      sequence.use[n] = 0;
      sequence.target[n] = 1e6;
    }
  const auto fitted = fit_bouc_wen(data, {.rates = true});
  EXPECT_LT(rmse_elsewhere(truth, BoucWenModel(fitted.parameters)), 0.02);
  const auto slip = fit_maxwell_slip(data, {.rates = true});
  EXPECT_LT(std::abs(slip.parameters.coefficients.values.values[0]), 2.0);
}

TEST(FitOperators, StateWhatIsMissing) {
  TrainingData still = recording_of(test::example<MaxwellSlipModel>(), 0.0, 400);
  for (std::size_t n = 0; n < 400; ++n) still.sequences[0].features(n, 0) = 0.1;
  EXPECT_THAT(test::error_message([&] { static_cast<void>(fit_maxwell_slip(still, {})); }),
              HasSubstr("constant in the training data"));
  TrainingData few = recording_of(test::example<MaxwellSlipModel>(), 0.0, 20);
  EXPECT_THAT(test::error_message([&] { static_cast<void>(fit_nonlinear_backlash(few, {})); }),
              HasSubstr("too few training samples"));
  TrainingData no_rate = recording_of(test::example<MaxwellSlipModel>(), 0.0, 2000);
  no_rate.inputs[1].is_rate = false;
  EXPECT_THAT(
      test::error_message([&] { static_cast<void>(fit_improved_nonlinear_backlash(no_rate, {})); }),
      HasSubstr("nonlinear_backlash_improved has no input that is a rate"));
  TrainingData data = recording_of(test::example<BoucWenModel>(), 0.1, 3000);
  EXPECT_THAT(
      test::error_message([&] { static_cast<void>(fit_bouc_wen(data, {.max_iterations = 1})); }),
      HasSubstr("did not converge"));
}

TEST(Bernstein, PolynomialsAddUpToOneAndBecomePowers) {
  const std::vector<double> weights{0.3, 0.0, 2.0, 0.7, 1.1};
  const std::vector<double> polynomial = powers_of_bernstein(weights);
  std::vector<double> basis(weights.size());
  std::vector<double> power(weights.size());
  for (double z = -1.0; z <= 1.0; z += 0.125) {
    bernstein(z, basis);
    powers(z, power);
    EXPECT_NEAR(std::accumulate(basis.begin(), basis.end(), 0.0), 1.0, 1e-14);
    EXPECT_NEAR(std::inner_product(basis.begin(), basis.end(), weights.begin(), 0.0),
                std::inner_product(power.begin(), power.end(), polynomial.begin(), 0.0), 1e-13);
  }
}

}  // namespace
}  // namespace torsio
