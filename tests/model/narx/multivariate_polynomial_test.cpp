#include "model/narx/multivariate_polynomial.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// 3 - 2 (x_0 / 2)^2 (x_2 / 4) + x_2 / 4
MultivariatePolynomial::Parameters example_parameters() {
  MultivariatePolynomial::Parameters parameters{
      .scales = {2.0, 1.0, 4.0}, .powers = Matrix(3, 3), .coefficients = {3.0, -2.0, 1.0}};
  parameters.powers.values = {0, 0, 0, 2, 0, 1, 0, 0, 1};
  return parameters;
}

TEST(MultivariatePolynomial, IsASumOfMonomialsOfScaledInputs) {
  MultivariatePolynomial model(example_parameters());
  EXPECT_EQ(model.input_count(), 3U);
  EXPECT_EQ(model.parameter_count(), 3U);
  EXPECT_EQ(model.parameters(), example_parameters());
  const std::array x{6.0, 100.0, 2.0};
  EXPECT_DOUBLE_EQ(model.step(x).value, 3.0 - 2.0 * 9.0 * 0.5 + 0.5);
}

TEST(MultivariatePolynomial, RefusesParametersThatAreNone) {
  const auto expect_refused = [](auto change) {
    auto parameters = example_parameters();
    change(parameters);
    EXPECT_THROW(MultivariatePolynomial{parameters}, Error);
  };
  expect_refused([](auto& p) { p.scales[1] = 0.0; });
  expect_refused([](auto& p) { p.scales.pop_back(); });
  expect_refused([](auto& p) { p.coefficients.pop_back(); });
  expect_refused([](auto& p) { p.coefficients[0] = std::numeric_limits<double>::quiet_NaN(); });
  expect_refused([](auto& p) { p.powers(1, 1) = 0.5; });
  expect_refused([](auto& p) { p.powers(1, 1) = -1.0; });
  expect_refused([](auto& p) { p.powers(1, 1) = 18.0; });
  expect_refused([](auto& p) { p.powers(1, 1) = std::numeric_limits<double>::infinity(); });
  expect_refused([](auto& p) { p = {}; });
}

}  // namespace
}  // namespace torsio
