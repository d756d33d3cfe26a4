#include "numerics/nnls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "numerics/least_squares.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

Matrix random_design(Random& random, std::size_t rows, std::size_t columns) {
  Matrix design(rows, columns);
  // Columns alike to a good part and of unlike size, as those of neighbouring thresholds.
  for (std::size_t n = 0; n < rows; ++n) {
    const double common = random.normal();
    for (std::size_t j = 0; j < columns; ++j)
      design(n, j) = std::pow(10.0, static_cast<double>(j % 4) - 2.0) * (common + random.normal());
  }
  return design;
}

double squared_error(const Matrix& design, const std::vector<double>& target,
                     const std::vector<double>& coefficients) {
  double sum = 0.0;
  for (std::size_t n = 0; n < design.rows; ++n) {
    double error = -target[n];
    for (std::size_t j = 0; j < design.columns; ++j) error += design(n, j) * coefficients[j];
    sum += error * error;
  }
  return sum;
}

/// The best over every subset of the columns that must not be negative, by plain least squares.
double best_of_all_sets(const Matrix& design, const std::vector<double>& target,
                        const std::vector<std::uint8_t>& is_free) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t set = 0; set < (std::size_t{1} << design.columns); ++set) {
    Matrix chosen = design;
    bool holds_free = true;
    for (std::size_t j = 0; j < design.columns; ++j) {
      const bool is_in = (set >> j & 1U) != 0;
      holds_free = holds_free && (is_in || is_free[j] == 0);
      for (std::size_t n = 0; !is_in && n < design.rows; ++n) chosen(n, j) = 0.0;
    }
    if (!holds_free) continue;
    const std::vector<double> coefficients = least_squares(chosen, target).coefficients;
    bool is_allowed = true;
    for (std::size_t j = 0; j < design.columns; ++j)
      is_allowed = is_allowed && (is_free[j] != 0 || coefficients[j] >= 0.0);
    if (is_allowed) best = std::min(best, squared_error(design, target, coefficients));
  }
  return best;
}

TEST(NonNegativeLeastSquares, IsTheBestOfAllActiveSets) {
  Random random(11);
  for (int run = 0; run < 60; ++run) {
    const Matrix design = random_design(random, 25, 7);
    std::vector<double> target(design.rows);
    for (double& each : target) each = random.normal();
    std::vector<std::uint8_t> is_free(design.columns, 0);
    is_free[0] = run % 2 == 0;
    is_free[3] = run % 3 == 0;
    const NonNegativeFit fit =
        non_negative_least_squares(normal_equations(design, target), is_free);
    EXPECT_TRUE(fit.has_converged);
    const double best = best_of_all_sets(design, target, is_free);
    EXPECT_NEAR(squared_error(design, target, fit.coefficients), best, 1e-9 * best)
        << "seed 11, run " << run;
  }
}

TEST(NonNegativeLeastSquares, MeetsTheConditionsOfAnOptimum) {
  Random random(5);
  for (int run = 0; run < 40; ++run) {
    const Matrix design = random_design(random, 200, 24);
    std::vector<double> target(design.rows);
    for (std::size_t n = 0; n < target.size(); ++n)
      target[n] = design(n, 1) - design(n, 2) + 30.0 * design(n, 4) + random.normal();
    std::vector<std::uint8_t> is_free(design.columns, 0);
    is_free[0] = 1;
    const NonNegativeFit fit =
        non_negative_least_squares(normal_equations(design, target), is_free);
    ASSERT_TRUE(fit.has_converged);
    double target_length = 0.0;
    for (const double each : target) target_length += each * each;
    for (std::size_t j = 0; j < design.columns; ++j) {
      double fall = 0.0;
      double length = 0.0;
      for (std::size_t n = 0; n < design.rows; ++n) {
        double left = target[n];
        for (std::size_t i = 0; i < design.columns; ++i) left -= design(n, i) * fit.coefficients[i];
        fall += design(n, j) * left;
        length += design(n, j) * design(n, j);
      }
      fall /= std::sqrt(length * target_length);
      EXPECT_TRUE(is_free[j] != 0 || fit.coefficients[j] >= 0.0);
      EXPECT_LT(fall, 1e-9);
      EXPECT_TRUE(fall > -1e-9 || (is_free[j] == 0 && fit.coefficients[j] == 0.0)) << fall;
    }
  }
}

TEST(NonNegativeLeastSquares, IsPlainLeastSquaresWhereAllIsFree) {
  Random random(2);
  const Matrix design = random_design(random, 80, 5);
  std::vector<double> target(design.rows);
  for (double& each : target) each = random.normal();
  const auto expected = least_squares(design, target).coefficients;
  const auto found =
      non_negative_least_squares(normal_equations(design, target), std::vector<std::uint8_t>(5, 1));
  for (std::size_t j = 0; j < expected.size(); ++j)
    EXPECT_NEAR(found.coefficients[j], expected[j], 1e-9 * std::abs(expected[j]));
}

TEST(NonNegativeLeastSquares, LeavesOutWhatOtherColumnsExplain) {
  Matrix design(50, 5);
  std::vector<double> target(50);
  for (std::size_t n = 0; n < 50; ++n) {
    const auto t = static_cast<double>(n);
    const std::vector<double> row{1.0, t, 2.0 * t, 0.0, 3.0 * t};
    std::ranges::copy(row, design.row(n).begin());
    target[n] = 1.0 + 6.0 * t;
  }
  const auto fit = non_negative_least_squares(normal_equations(design, target),
                                              std::vector<std::uint8_t>{1, 1, 1, 1, 0});
  EXPECT_TRUE(fit.has_converged);
  EXPECT_THAT(fit.coefficients,
              ElementsAre(DoubleNear(1.0, 1e-9), DoubleNear(6.0, 1e-9), 0.0, 0.0, 0.0));
  EXPECT_THAT(fit.dropped, ElementsAre(2, 3));
}

TEST(NormalEquations, ComputeTheErrorOfAnyCoefficients) {
  Random random(8);
  const Matrix design = random_design(random, 40, 4);
  std::vector<double> target(design.rows);
  for (double& each : target) each = random.normal();
  const std::vector<double> coefficients{1.0, -0.5, 0.25, 2.0};
  const double expected = squared_error(design, target, coefficients);
  const NormalEquations equations = normal_equations(design, target);
  EXPECT_NEAR(equations.error(coefficients), expected, 1e-12 * expected);
  EXPECT_EQ(equations.rows, 40U);
}

}  // namespace
}  // namespace torsio
