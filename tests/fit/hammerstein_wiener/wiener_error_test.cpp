#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fit/hammerstein_wiener/wiener_problem.hpp"
#include "hammerstein_wiener_example.hpp"

namespace torsio {
namespace {

/// Two sections, two records with any start, some samples not scored.
class WienerErrorTest : public testing::TestWithParam<bool> {
 protected:
  WienerErrorTest() {
    TrainingData data = test::recorded(test::known_hammerstein_wiener(), 700, 0.1, 3, 2);
    for (std::size_t n = 300; n < 420; ++n) data.sequences[1].use[n] = 0;
    data_ = wiener_data(data);
    numbers_.sections = sections_of({{1.0, -0.9, 0.3, 0.1}, {1.0, -1.7, 1.1, -0.3}});
    numbers_.input = {.values = {0.0, 1.0, 0.3, -0.1}, .centre = 0.05, .half_range = 1.3};
    numbers_.output = {.values = {0.1, 2.0, 0.2, -0.1}, .centre = 0.2, .half_range = 2.0};
    if (GetParam()) {
      numbers_.input = {.knots = {-1.0, 0.0, 0.4, 1.5}, .values = {-1.0, 0.0, 0.3, 0.9}};
      numbers_.output = {.knots = {-3.0, -0.5, 1.0, 3.0}, .values = {-2.0, 0.1, 1.0, 4.0}};
    }
    numbers_.start = Matrix(2, 4);
    numbers_.start.values = {0.1, -0.2, 0.3, 0.1, -0.1, 0.2, 0.05, -0.3};
  }
  WienerData data_;
  WienerNumbers numbers_;
};

TEST_P(WienerErrorTest, SensitivitiesAreFiniteDifferences) {
  const WienerError error(data_, numbers_);
  const std::vector<double> packed = error.pack(numbers_);
  const Matrix rows = error.rows(numbers_);
  ASSERT_EQ(rows.rows, data_.scored_samples());
  ASSERT_EQ(rows.columns, packed.size() + 1);
  constexpr double kStep = 1e-6;
  for (std::size_t k = 0; k < packed.size(); ++k) {
    std::vector<double> moved = packed;
    moved[k] += kStep;
    const Matrix above = error.rows(error.unpack(moved));
    moved[k] -= 2.0 * kStep;
    const Matrix below = error.rows(error.unpack(moved));
    double miss = 0.0;
    double size = 0.0;
    for (std::size_t n = 0; n < rows.rows; ++n) {
      const double slope = (above(n, packed.size()) - below(n, packed.size())) / (2.0 * kStep);
      miss += std::pow(slope - rows(n, k), 2);
      size += slope * slope;
    }
    // A piecewise linear curve has no slope at its knots: few samples pass one within the step.
    EXPECT_LT(std::sqrt(miss), (GetParam() ? 1e-4 : 1e-6) * std::sqrt(size)) << error.names()[k];
    EXPECT_GT(size, 0.0) << error.names()[k];
  }
}

TEST_P(WienerErrorTest, ProductsAreThoseOfTheRows) {
  const WienerError error(data_, numbers_);
  const Matrix rows = error.rows(numbers_);
  Matrix gram;
  ASSERT_TRUE(error.products(numbers_, gram));
  for (std::size_t i = 0; i < gram.rows; ++i) {
    for (std::size_t j = 0; j < gram.rows; ++j) {
      double sum = 0.0;
      double size = 0.0;
      for (std::size_t n = 0; n < rows.rows; ++n) {
        sum += rows(n, i) * rows(n, j);
        size += std::abs(rows(n, i) * rows(n, j));
      }
      EXPECT_NEAR(gram(i, j), sum, 1e-12 * size) << i << ", " << j;
    }
  }
  EXPECT_NEAR(error.sum_of_squares(numbers_), gram(gram.rows - 1, gram.rows - 1), 1e-9);
}

TEST_P(WienerErrorTest, IsTheModelsOwn) {
  HammersteinWiener model({.inputs = 1,
                           .sample_period_s = 0.01,
                           .rest_input = data_.rest_input,
                           .input = numbers_.input,
                           .sections = numbers_.sections,
                           .output = {.values = {0.0, 1.0}},
                           .lowest = -1e6,
                           .highest = 1e6});
  WienerNumbers straight = numbers_;
  straight.output = {};
  double sum = 0.0;
  const double at_rest = straight.input(data_.rest_input);
  auto shifted = model.parameters();
  if (shifted.input.knots.empty())
    shifted.input.values[0] -= at_rest;
  else
    for (double& value : shifted.input.values) value -= at_rest;
  model = HammersteinWiener(shifted);
  for (std::size_t r = 0; r < 2; ++r) {
    model.set_state(straight.start.row(r));
    for (std::size_t n = 0; n < data_.records[r].input.size(); ++n) {
      const double y = model.step({&data_.records[r].input[n], 1}).value;
      if (data_.records[r].scored[n] != 0) sum += std::pow(y - data_.records[r].target[n], 2);
    }
  }
  EXPECT_NEAR(WienerError(data_, straight).sum_of_squares(straight), sum, 1e-9 * sum);
}

TEST_P(WienerErrorTest, TheTriangleHasTheErrorsSlopeAlongTheSearch) {
  const WienerError error(data_, numbers_);
  const std::vector<double> theta = stable_start(error, error.pack(numbers_));
  const ResidualProblem problem = wiener_problem(error, theta.size(), stable_chart(error));
  const std::size_t p = theta.size();
  std::vector<double> residuals(p + 1);
  std::vector<double> jacobian((p + 1) * p);
  ASSERT_TRUE(problem.evaluate(theta, residuals, jacobian));
  const auto cost = [&](const std::vector<double>& at) {
    std::vector<double> r(p + 1);
    EXPECT_TRUE(problem.evaluate(at, r, {}));
    double sum = 0.0;
    for (const double each : r) sum += each * each;
    return sum;
  };
  for (std::size_t k = 0; k < p; ++k) {
    double gradient = 0.0;
    for (std::size_t i = 0; i <= p; ++i) gradient += 2.0 * residuals[i] * jacobian[i * p + k];
    constexpr double kStep = 1e-5;
    std::vector<double> above = theta;
    std::vector<double> below = theta;
    above[k] += kStep;
    below[k] -= kStep;
    const double expected = (cost(above) - cost(below)) / (2.0 * kStep);
    EXPECT_NEAR(gradient, expected, 1e-3 * std::abs(expected) + 1e-3) << error.names()[k];
  }
}

INSTANTIATE_TEST_SUITE_P(Curves, WienerErrorTest, testing::Bool(),
                         [](const auto& of) { return of.param ? "piecewise" : "polynomials"; });

}  // namespace
}  // namespace torsio
