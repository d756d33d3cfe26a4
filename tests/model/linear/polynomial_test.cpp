#include "model/linear/polynomial.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "support/error_message.hpp"
#include "support/examples/linear.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::example;

double output(Polynomial& model, double x0, double x1 = 0.0) {
  return model.step(std::array{x0, x1}).value;
}

TEST(Polynomial, TakesTheBranchOfItsDirectionAndTheMeanBeforeItHasOne) {
  auto model = example<Polynomial>();
  const auto rising = [](double z) { return 1.2 + 50.0 * z - z * z + 12.0 * z * z * z; };
  const auto falling = [](double z) { return -1.1 + 52.0 * z + 0.5 * z * z + 10.0 * z * z * z; };
  EXPECT_NEAR(output(model, 0.01), 0.5 * (rising(0.1) + falling(0.1)), 1e-13);
  EXPECT_NEAR(output(model, 0.05), rising(0.5), 1e-13);
  EXPECT_NEAR(output(model, 0.049), rising(0.49), 1e-13) << "inside the dead band of 0.002";
  EXPECT_NEAR(output(model, 0.047), falling(0.47), 1e-13);
  EXPECT_NEAR(output(model, 0.047, 2.0), falling(0.47) + 0.8, 1e-13) << "linear second input";
  model.reset();
  EXPECT_NEAR(output(model, 0.01), 0.5 * (rising(0.1) + falling(0.1)), 1e-13);
}

TEST(Polynomial, WithoutDirectionIsOneCurve) {
  Polynomial::Parameters parameters{.degree = 2, .centre = 1.0, .half_range = 2.0};
  parameters.coefficients.values = Matrix(1, 4);
  parameters.coefficients.values.values = {1.0, -2.0, 4.0, 0.0};
  Polynomial model(parameters);
  EXPECT_EQ(model.input_count(), 1U);
  EXPECT_EQ(model.parameter_count(), 3U);
  EXPECT_DOUBLE_EQ(model.step(std::array{2.0}).value, 1.0 - 1.0 + 1.0);
  EXPECT_DOUBLE_EQ(model.step(std::array{0.0}).value, 1.0 + 1.0 + 1.0);
}

TEST(Polynomial, InvertsBothBranches) {
  auto model = example<Polynomial>();
  const Matrix features = test::example_features(400, 2);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double target = model.step(features.row(n)).value;
    const Estimate found = model.invert(target, std::array{0.0, features(n, 1)});
    EXPECT_NEAR(found.value, features(n, 0), 1e-10) << "sample " << n;
    EXPECT_EQ(found.fault, Fault::none);
  }
}

TEST(Polynomial, InvertsAFlatCurveWhereNewtonAloneWouldLeave) {
  Polynomial::Parameters parameters{.degree = 9};
  parameters.coefficients.values = Matrix(1, 11);
  parameters.coefficients.values(0, 9) = 1.0;
  const Polynomial model(parameters);
  for (const double start : {-1.0, -1e-6, 0.0, 1e-9, 1.0, 30.0}) {
    const Estimate found = model.invert(std::pow(0.3, 9), std::array{start});
    EXPECT_NEAR(found.value, 0.3, 1e-9) << "from " << start;
    EXPECT_EQ(found.fault, Fault::none);
    EXPECT_NEAR(model.invert(0.0, std::array{start}).value, 0.0, 1e-12) << "from " << start;
  }
}

TEST(Polynomial, InvertsWithAnInputBeyondItsRange) {
  const auto model = example<Polynomial>();
  const Estimate found = model.invert(1e6, std::array{0.0, 0.0});
  EXPECT_DOUBLE_EQ(found.value, 0.1);
  EXPECT_EQ(found.fault, Fault::outside_training_range);
  EXPECT_DOUBLE_EQ(model.invert(-1e6, std::array{0.0, 0.0}).value, -0.1);
}

TEST(Polynomial, StaysAtTheEndOfTheRangeOfItsDirectionAndReportsIt) {
  Polynomial::Parameters parameters = example<Polynomial>().parameters();
  parameters.ranges = Matrix(1, 4);
  parameters.ranges.values = {-0.1, 0.0, -0.1, 0.1};  // P+ was fitted to the lower half only
  Polynomial model(parameters);
  const auto rising = [](double z) { return 1.2 + 50.0 * z - z * z + 12.0 * z * z * z; };
  output(model, -0.1);
  EXPECT_EQ(model.step(std::array{0.004, 0.0}).fault, Fault::none) << "a twentieth beyond";
  const Estimate estimate = model.step(std::array{0.08, 0.0});
  EXPECT_EQ(estimate.fault, Fault::outside_training_range);
  EXPECT_NEAR(estimate.value, rising(0.05), 1e-12);
  const Estimate back = model.step(std::array{0.07, 0.0});
  EXPECT_EQ(back.fault, Fault::none) << "falling, P- was fitted there";
  // Inverse: the value of P+ at the end of its range is its maximum.
  model.step(std::array{-0.05, 0.0});
  model.step(std::array{-0.02, 0.0});
  const Estimate found = model.invert(rising(0.5), std::array{0.0, 0.0});
  EXPECT_EQ(found.fault, Fault::outside_training_range);
  EXPECT_NEAR(found.value, 0.0, 1e-12);
}

TEST(Polynomial, RefusesParametersThatDisagree) {
  const auto good = example<Polynomial>().parameters();
  const auto refused = [&](auto change) {
    auto parameters = good;
    change(parameters);
    EXPECT_THROW(Polynomial{parameters}, Error);
  };
  refused([](auto& p) { p.degree = 5; });
  refused([](auto& p) { p.degree = Polynomial::kHighestDegree + 1; });
  refused([](auto& p) { p.degree = static_cast<std::size_t>(-1); });
  refused([](auto& p) { p.half_range = 0.0; });
  refused([](auto& p) { p.centre = kNotMeasured; });
  refused([](auto& p) { p.dead_band = -1.0; });
  refused([](auto& p) { p.coefficients.values(0, 8) = 1.0; });
  refused([](auto& p) { p.ranges = Matrix(1, 2); });
  refused([](auto& p) { p.ranges.values[0] = 0.5; });
  refused([](auto& p) { p.ranges.values[3] = kNotMeasured; });
}

TEST(Polynomial, NamesASmallNumberThatItRefuses) {
  auto parameters = test::example<Polynomial>().parameters();
  parameters.half_range = -1e-9;
  EXPECT_EQ(test::error_message([&] { Polynomial{parameters}; }),
            "polynomial: half_range: expected a positive number, found -1e-09");
}

}  // namespace
}  // namespace torsio
