#include "fit/linear/fit_polynomial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "fit/common/model_run.hpp"
#include "fit/linear/fit_linear.hpp"
#include "support/example_data.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::deflection_and_rate;
using test::oscillation;
using test::training_data_of;

using Row = std::span<const double>;

double quintic(double x) {
  const double z = x / 0.1;
  return 1.0 + 40.0 * z - 3.0 * z * z + 7.0 * z * z * z + 2.0 * std::pow(z, 5);
}

/// Slow triangle of +-0.1 with 2000 samples a period.
Matrix triangle(std::size_t samples) {
  Matrix features(samples, 1);
  for (std::size_t n = 0; n < samples; ++n) {
    const double phase = std::fmod(static_cast<double>(n) / 2000.0 + 0.25, 1.0);
    features(n, 0) = 0.1 * (1.0 - 4.0 * std::abs(phase - 0.5));
  }
  return features;
}

TEST(FitPolynomial, RecoversACurveOfItsDegree) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(3000),
                                     [](Row x) { return quintic(x[0]); });
  const auto fitted = fit_polynomial(data, {.branch = false});
  EXPECT_EQ(fitted.parameters.degree, 5U);
  EXPECT_LT(evaluate(Polynomial(fitted.parameters), data).max_abs, 1e-10);
  EXPECT_EQ(Polynomial(fitted.parameters).parameter_count(), 6U);
  ASSERT_EQ(fitted.table.size(), 8U) << "six coefficients and the scale of their variable";
  EXPECT_EQ(fitted.table[1].name, "a1");
  EXPECT_EQ(fitted.table[1].unit, "Nm");
  EXPECT_EQ(fitted.table[7].unit, "rad");
}

TEST(FitPolynomial, RecoversBothBranchesOfALoop) {
  // The curves are made by the same reversal rule, so all but the unknown start must fit exactly.
  DirectionTracker tracker(0.001);
  const auto data =
      training_data_of({{.expression = "spring_deflection_rad"}}, triangle(6000), [&](Row x) {
        return tracker.step(x[0]) == Direction::falling ? quintic(x[0]) - 3.0
                                                        : quintic(x[0]) + x[0];
      });
  const auto fitted = fit_polynomial(data, {.dead_band = 0.001});
  EXPECT_EQ(Polynomial(fitted.parameters).parameter_count(), 12U);
  AnyModel model = Polynomial(fitted.parameters);
  const auto estimate = run(model, data.sequences[0]);
  for (std::size_t n = 10; n < estimate.size(); ++n)
    ASSERT_NEAR(estimate[n].value, data.sequences[0].target[n], 1e-9) << "sample " << n;
  EXPECT_TRUE(fitted.notes.empty());
}

TEST(FitPolynomial, BeatsOneCurveOnANoisyLoop) {
  const TrainingData data = test::noisy_spring();
  const double one =
      evaluate(Polynomial(fit_polynomial(data, {.branch = false}).parameters), data).rmse;
  const double two = evaluate(Polynomial(fit_polynomial(data, {}).parameters), data).rmse;
  EXPECT_LT(two, 0.5 * one);
}

TEST(FitPolynomial, DerivesItsDeadBandFromResolutionAndRangeAndReportsIt) {
  const auto coarse = training_data_of(
      {{.expression = "x"}},
      [] {
        Matrix features = triangle(4000);
        for (double& x : features.values) x = 0.01 * std::round(x / 0.01);
        return features;
      }(),
      [](Row x) { return x[0]; });
  EXPECT_NEAR(default_dead_band(coarse), 0.02, 1e-12) << "two steps of the resolution";
  const auto fine =
      training_data_of({{.expression = "x"}}, triangle(4000), [](Row x) { return x[0]; });
  EXPECT_NEAR(default_dead_band(fine), 0.001, 1e-5) << "half a percent of the range";
  EXPECT_EQ(fit_polynomial(fine, {}).notes,
            std::vector<std::string>{"x turns once it moved back by more than 0.001"});
}

TEST(FitPolynomial, ChoosesTheDegreeOfTheDataByCrossValidation) {
  Random random(11);
  const auto data = training_data_of({{.expression = "x"}}, triangle(4000), [&](Row x) {
    const double z = x[0] / 0.1;
    return 5.0 * z - 4.0 * z * z * z + 0.2 * random.normal();
  });
  const auto fitted = fit_polynomial(data, {.degree = 0, .branch = false});
  EXPECT_EQ(fitted.parameters.degree, 3U);
  EXPECT_EQ(fitted.notes, std::vector<std::string>{"degree 3 chosen by cross-validation"});
}

TEST(FitPolynomial, ChoosesAmongTheDegreesThatTheSamplesSuffice) {
  Matrix features(35, 1);  // four fifths of them suffice for 5 terms
  for (std::size_t n = 0; n < features.rows; ++n)
    features(n, 0) = 0.1 * std::sin(static_cast<double>(n));
  const auto data = training_data_of({{.expression = "x"}}, features,
                                     [](Row x) { return 5.0 * x[0] - 400.0 * x[0] * x[0]; });
  const auto fitted = fit_polynomial(data, {.degree = 0, .branch = false});
  EXPECT_GE(fitted.parameters.degree, 2U);
  EXPECT_LT(fitted.parameters.degree, kHighestChosenDegree);
  EXPECT_LT(evaluate(Polynomial(fitted.parameters), data).max_abs, 1e-10);
}

TEST(FitPolynomial, SchedulesItsCurvesOverACondition) {
  Matrix features(8000, 2);
  const Matrix loop = triangle(8000);
  for (std::size_t n = 0; n < features.rows; ++n) {
    features(n, 0) = loop(n, 0);
    features(n, 1) = n < 4000 ? 0.1 : 0.3;
  }
  DirectionTracker tracker(0.001);
  const auto data =
      training_data_of({{.expression = "x"}, {.expression = "support_m"}}, features, [&](Row x) {
        const double friction = tracker.step(x[0]) == Direction::falling ? -1.0 : 1.0;
        return (100.0 + 50.0 * x[1]) * x[0] + 10.0 * x[1] * friction;
      });
  const auto fitted = fit_polynomial(data, {.dead_band = 0.001, .schedule = "support_m"});
  EXPECT_EQ(fitted.parameters.coefficients.knots, (std::vector{0.1, 0.3}));
  // Two knots: linear interpolation between them, here exact.
  Polynomial model(fitted.parameters);
  model.step(std::array{0.0, 0.2});
  EXPECT_NEAR(model.step(std::array{0.05, 0.2}).value, 110.0 * 0.05 + 2.0, 1e-9);
  EXPECT_NEAR(model.step(std::array{0.04, 0.2}).value, 110.0 * 0.04 - 2.0, 1e-9);
}

TEST(FitPolynomial, StoresTheRangeOfEachCurvesData) {
  // It falls all the way, but rises over the lower fifth only: above, degree 5 extrapolates without
  // bound.
  Matrix features(2000, 1);
  for (std::size_t n = 0; n < 1000; ++n) {
    features(n, 0) = 0.1 - 0.2 * static_cast<double>(n) / 999.0;
    features(1000 + n, 0) = -0.1 + 0.04 * static_cast<double>(n) / 999.0;
  }
  Random random(5);
  const auto data = training_data_of({{.expression = "x"}}, features,
                                     [&](Row x) { return quintic(x[0]) + random.normal(); });
  Polynomial model(fit_polynomial(data, {}).parameters);
  const auto measured = std::ranges::minmax(data.sequences[0].target);
  for (double x = -0.1; x <= 0.1; x += 0.001) {
    const Estimate estimate = model.step(std::array{x});
    EXPECT_GT(estimate.value, measured.min - 5.0) << x;
    EXPECT_LT(estimate.value, measured.max + 5.0) << x;
    EXPECT_EQ(estimate.fault, x < -0.058 ? Fault::none : Fault::outside_training_range) << x;
  }
}

TEST(FitPolynomial, StoresTheRangeOfEachKnotsData) {
  Matrix features(8000, 2);
  const Matrix loop = triangle(8000);
  for (std::size_t n = 0; n < features.rows; ++n) {
    features(n, 0) = (n < 4000 ? 1.0 : 0.2) * loop(n, 0);
    features(n, 1) = n < 4000 ? 0.1 : 0.3;
  }
  const auto data = training_data_of({{.expression = "x"}, {.expression = "support_m"}}, features,
                                     [](Row x) { return quintic(x[0]); });
  const auto fitted = fit_polynomial(data, {.branch = false, .schedule = "support_m"});
  Polynomial model(fitted.parameters);
  EXPECT_EQ(model.step(std::array{0.09, 0.1}).fault, Fault::none);
  EXPECT_EQ(model.step(std::array{0.09, 0.3}).fault, Fault::outside_training_range);
  EXPECT_EQ(model.step(std::array{0.019, 0.3}).fault, Fault::none);
}

TEST(FitPolynomial, RefusesDataThatDoNotDetermineItsCurves) {
  const auto message = [](const TrainingData& data) -> std::string {
    try {
      (void)fit_polynomial(data, {});
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  };
  const auto target = [](Row x) { return x[0]; };
  const auto one_way = training_data_of({{.expression = "x"}}, triangle(400), target);
  EXPECT_NE(message(one_way).find("--set branch=false"), std::string::npos);
  const auto still = training_data_of({{.expression = "x"}}, Matrix(400, 1, 2.0), target);
  EXPECT_FALSE(message(still).empty());
  EXPECT_THROW((void)fit_polynomial(still, {.branch = false}), Error);
}

TEST(FitPolynomial, GivesOtherInputsALinearTerm) {
  const auto data =
      training_data_of({{.expression = "x"}, {.expression = "rate(x)", .is_rate = true}},
                       oscillation(3000), [](Row x) { return quintic(x[0]) + 2.0 * x[1]; });
  EXPECT_GT(evaluate(Polynomial(fit_polynomial(data, {.branch = false}).parameters), data).rmse,
            0.1);
  EXPECT_LT(
      evaluate(Polynomial(fit_polynomial(data, {.branch = false, .rates = true}).parameters), data)
          .rmse,
      1e-9);
}

}  // namespace
}  // namespace torsio
