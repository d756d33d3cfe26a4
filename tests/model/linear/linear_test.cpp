#include "model/linear/linear.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "model/linear/linear_coulomb.hpp"
#include "support/examples/linear.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::example;

TEST(Linear, IsBiasPlusSlopesTimesInputs) {
  const auto model = example<Linear>();
  const std::array features{0.02, -4.0};
  const Estimate estimate = model.step(features);
  EXPECT_DOUBLE_EQ(estimate.value, 0.5 + 600.0 * 0.02 - 0.25 * 4.0);
  EXPECT_TRUE(std::isnan(estimate.std_dev));
  EXPECT_EQ(model.input_count(), 2U);
  EXPECT_EQ(model.parameter_count(), 3U);
}

TEST(LinearCoulomb, AddsATanhOfTheRate) {
  LinearCoulomb::Parameters parameters{.rate_feature = 1, .rate_scale = 0.3};
  parameters.coefficients.values = Matrix(1, 4);
  parameters.coefficients.values.values = {0.5, 10.0, 0.0, 2.0};
  const LinearCoulomb model(parameters);
  const std::array features{0.1, -0.6};
  EXPECT_DOUBLE_EQ(model.step(features).value, 0.5 + 1.0 - 2.0 * std::tanh(2.0));
  EXPECT_EQ(model.parameter_count(), 4U);
}

template <class Model>
void expect_round_trip(const Model& model) {
  const Matrix features = test::example_features(200, model.input_count());
  for (std::size_t n = 0; n < features.rows; ++n) {
    std::array<double, 2> guess{};
    std::ranges::copy(features.row(n), guess.begin());
    const double target = model.step(guess).value;
    guess[0] = 0.0;
    const Estimate found = model.invert(target, guess);
    EXPECT_NEAR(found.value, features(n, 0), 1e-12);
    EXPECT_EQ(found.fault, Fault::none);
  }
}

TEST(Linear, InvertsItself) { expect_round_trip(example<Linear>()); }
TEST(LinearCoulomb, InvertsItselfAtTheGivenRate) { expect_round_trip(example<LinearCoulomb>()); }

TEST(Linear, InvertDoesNotReadTheFirstInput) {
  const auto model = example<Linear>();
  const double expected = model.invert(30.0, std::array{0.0, 0.2}).value;
  for (const double ignored : {1e18, -1e300, kNotMeasured})
    EXPECT_EQ(model.invert(30.0, std::array{ignored, 0.2}).value, expected) << ignored;
}

TEST(Linear, WithoutSlopeHasNoInverse) {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 2);
  const Estimate found = Linear(parameters).invert(1.0, std::array{0.25});
  EXPECT_EQ(found.value, 0.25);
  EXPECT_EQ(found.fault, Fault::model_not_finite);
  EXPECT_EQ(Linear(parameters).invert(1.0, std::array{kNotMeasured}).value, 0.0);
}

TEST(Linear, ScheduledOverItsFirstInputHasNoClosedInverse) {
  Linear::Parameters parameters;
  parameters.coefficients = {.scheduled = true, .feature = 0, .knots = {0.0, 1.0}};
  parameters.coefficients.values = Matrix(2, 2, 1.0);
  EXPECT_EQ(Linear(parameters).invert(1.0, std::array{0.25}).fault, Fault::model_not_finite);
}

TEST(LinearCoulomb, OfTheRateAloneHasNoClosedInverse) {
  LinearCoulomb::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 3, 1.0);
  EXPECT_EQ(LinearCoulomb(parameters).invert(1.0, std::array{0.25}).fault, Fault::model_not_finite);
}

TEST(Linear, RefusesTooFewCoefficients) {
  Linear::Parameters parameters;
  EXPECT_THROW(Linear{parameters}, Error);
  parameters.coefficients.values = Matrix(1, 1);
  EXPECT_THROW(Linear{parameters}, Error);
}

TEST(LinearCoulomb, RefusesARateThatIsNoInputAndAScaleThatIsNotPositive) {
  const auto good = example<LinearCoulomb>().parameters();
  auto parameters = good;
  parameters.rate_feature = 2;
  EXPECT_THROW(LinearCoulomb{parameters}, Error);
  for (const double scale : {0.0, -1.0, kNotMeasured, HUGE_VAL}) {
    parameters = good;
    parameters.rate_scale = scale;
    EXPECT_THROW(LinearCoulomb{parameters}, Error) << scale;
  }
  parameters = good;
  parameters.coefficients.values = Matrix(3, 2);
  EXPECT_THROW(LinearCoulomb{parameters}, Error);
}

}  // namespace
}  // namespace torsio
