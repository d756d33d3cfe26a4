#include "numerics/residual_search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

ResidualProblem rosenbrock(bool has_jacobian) {
  return {.residuals = 2,
          .evaluate =
              [](std::span<const double> x, std::span<double> r, std::span<double> jacobian) {
                r[0] = 10.0 * (x[1] - x[0] * x[0]);
                r[1] = 1.0 - x[0];
                if (jacobian.empty()) return true;
                jacobian[0] = -20.0 * x[0];
                jacobian[1] = 10.0;
                jacobian[2] = -1.0;
                jacobian[3] = 0.0;
                return true;
              },
          .has_jacobian = has_jacobian};
}

/// y = (a + b) t + c t^2 on 0..1, only the sum of a and b is identifiable.
ResidualProblem line_and_square(double noise) {
  constexpr std::size_t kSamples = 200;
  return {.residuals = kSamples,
          .evaluate = [noise](std::span<const double> x, std::span<double> r,
                              std::span<double> /*jacobian*/) {
            for (std::size_t n = 0; n < kSamples; ++n) {
              const double t = static_cast<double>(n) / kSamples;
              const double measured = 3.0 * t + 2.0 * t * t + (n % 2 == 0 ? noise : -noise);
              r[n] = (x[0] + x[1]) * t + x[2] * t * t - measured;
            }
            return true;
          }};
}

TEST(ResidualSearch, FindsTheMinimumWithAndWithoutAGivenJacobian) {
  for (const bool has_jacobian : {true, false}) {
    const SearchResult found = minimise_squares(rosenbrock(has_jacobian), {-1.2, 1.0});
    EXPECT_TRUE(found.has_converged);
    EXPECT_THAT(found.theta, ElementsAre(DoubleNear(1.0, 1e-5), DoubleNear(1.0, 1e-5)));
  }
}

TEST(ResidualSearch, StaysInsideItsBounds) {
  const SearchResult found =
      minimise_squares(rosenbrock(true), {-1.2, 1.0}, {.lower = {-2.0, -2.0}, .upper = {0.5, 2.0}});
  EXPECT_THAT(found.theta, ElementsAre(DoubleNear(0.5, 1e-6), DoubleNear(0.25, 1e-4)));
}

TEST(ResidualSearch, LeavesABoundThatTheMinimumIsNotOn) {
  const SearchResult found =
      minimise_squares(rosenbrock(true), {-2.0, 2.0}, {.lower = {-2.0, -2.0}, .upper = {2.0, 2.0}});
  EXPECT_TRUE(found.has_converged);
  EXPECT_THAT(found.theta, ElementsAre(DoubleNear(1.0, 1e-5), DoubleNear(1.0, 1e-5)));
}

TEST(ResidualSearch, HoldsAParameterWhoseBoundsAreEqual) {
  const SearchResult found =
      minimise_squares(rosenbrock(true), {1.2, 1.0}, {.lower = {-2.0, 0.3}, .upper = {2.0, 0.3}});
  EXPECT_EQ(found.theta[1], 0.3);
  // The root above 0 of 400 x^3 - 118 x - 2, the slope of 100 (0.3 - x^2)^2 + (1 - x)^2.
  EXPECT_NEAR(found.theta[0], 0.55144, 1e-4);
}

TEST(ResidualSearch, TakesShorterStepsWhereTheResidualsCannotBeComputed) {
  for (const bool is_bounded : {false, true}) {
    const ResidualProblem problem{
        .residuals = 1,
        .evaluate = [](std::span<const double> x, std::span<double> r, std::span<double>) {
          r[0] = std::log(x[0]) - 1.0;  // the whole step from 20 leads below 0
          return x[0] > 0.0;
        }};
    SearchOptions options;
    if (is_bounded) options.lower = {-1e3};
    const SearchResult found = minimise_squares(problem, {20.0}, options);
    EXPECT_TRUE(found.has_converged);
    EXPECT_NEAR(found.theta[0], std::exp(1.0), 1e-5);
  }
}

TEST(ResidualSearch, BoundsThatContradictAreAUsageError) {
  EXPECT_THROW((void)minimise_squares(rosenbrock(true), {0.0, 0.0},
                                      {.lower = {1.0, 0.0}, .upper = {0.0, 1.0}}),
               UsageError);
}

TEST(ResidualSearch, OfSeveralStartsTheBestIsTaken) {
  // Minima at 1 and, worse, at -1.
  const ResidualProblem problem{
      .residuals = 2,
      .evaluate = [](std::span<const double> x, std::span<double> r, std::span<double>) {
        r[0] = x[0] * x[0] - 1.0;
        r[1] = 0.1 * (x[0] - 1.0);
        return true;
      }};
  EXPECT_NEAR(minimise_squares_from(problem, {{-2.0}, {2.0}}).theta[0], 1.0, 1e-6);
  EXPECT_LT(minimise_squares_from(problem, {{-2.0}}).theta[0], -0.9);
}

TEST(ResidualSearch, AStartThatRunsAwayIsAnErrorUnlessAnotherDoesNot) {
  const ResidualProblem problem{
      .residuals = 1,
      .evaluate = [](std::span<const double> x, std::span<double> r, std::span<double>) {
        r[0] = std::sqrt(x[0]) - 2.0;
        return true;
      }};
  EXPECT_THROW((void)minimise_squares(problem, {-1.0}), Error);
  EXPECT_NEAR(minimise_squares_from(problem, {{-1.0}, {1.0}}).theta[0], 4.0, 1e-6);
}

TEST(ResidualSearch, CancellingComesThrough) {
  const SearchOptions stopped{.progress = [](double, std::string_view) { return false; }};
  EXPECT_THROW((void)minimise_squares(rosenbrock(true), {-1.2, 1.0}, stopped), Cancelled);
}

TEST(ResidualSearch, EndsWithinAnIterationWhenAskedTo) {
  // One derivative of 50 parameters takes 100 evaluations.
  constexpr std::size_t kParameters = 50;
  std::size_t evaluations = 0;
  const ResidualProblem problem{
      .residuals = kParameters,
      .evaluate = [&](std::span<const double> x, std::span<double> r, std::span<double>) {
        ++evaluations;
        for (std::size_t n = 0; n < r.size(); ++n) r[n] = std::exp(x[n]) - 2.0;
        return true;
      }};
  const SearchOptions stopped{
      .progress = [&](double, std::string_view) { return evaluations < 20; }};
  EXPECT_THROW((void)minimise_squares(problem, std::vector<double>(kParameters), stopped),
               Cancelled);
  EXPECT_EQ(evaluations, 20U);
}

TEST(ParameterUncertaintyOf, StandardErrorsAreThoseOfLinearRegression) {
  // y = a on 100 samples with residuals of +-0.5: s / sqrt(n).
  const ResidualProblem problem{
      .residuals = 100,
      .evaluate = [](std::span<const double> x, std::span<double> r, std::span<double>) {
        for (std::size_t n = 0; n < r.size(); ++n) r[n] = x[0] - (n % 2 == 0 ? 2.5 : 1.5);
        return true;
      }};
  const std::vector<double> optimum{2.0};
  const ParameterUncertainty found = uncertainty_of(problem, optimum);
  EXPECT_TRUE(found.null_directions.empty());
  EXPECT_NEAR(found.std_error[0], 0.5 / std::sqrt(99.0), 1e-8);
}

TEST(ParameterUncertaintyOf, NamesWhatTheDataDoNotDetermine) {
  const std::vector<double> optimum{1.0, 2.0, 2.0};
  const std::vector<double> typical{1.0, 1.0, 1.0};
  const ParameterUncertainty found = uncertainty_of(line_and_square(0.1), optimum, typical);
  ASSERT_EQ(found.null_directions.size(), 1U);
  const std::vector<std::string> names{"a", "b", "c"};
  EXPECT_THAT(description_of(found.null_directions[0], names), testing::AnyOf("a - b", "-a + b"));
  EXPECT_TRUE(std::isnan(found.std_error[0]));
  EXPECT_TRUE(std::isnan(found.std_error[1]));
  EXPECT_GT(found.std_error[2], 0.0);
}

}  // namespace
}  // namespace torsio
