#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/dump.hpp"
#include "support/example_models.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/any_model.hpp"

/// What it means to be a model family. A new one specialises `example` (support/example_models.hpp)
/// and adds one line:
///
///     INSTANTIATE_TYPED_TEST_SUITE_P(Linear, ModelLaws, Linear);
///
/// and, if it is `Invertible`, the same with `InverseLaws`.
///
/// Laws of fitters stand in fit_laws_test.cpp. That NaN in gives a fault and a finite value out, and
/// that offline equals streaming, are laws of the estimator; that saving and loading changes no bit
/// is one of the model files.
namespace torsio::test {

template <class M>
std::vector<double> values(M& model, const Matrix& features) {
  std::vector<double> all;
  for (std::size_t n = 0; n < features.rows; ++n) all.push_back(model.step(features.row(n)).value);
  return all;
}

template <class M>
class ModelLaws : public testing::Test {
 protected:
  static constexpr std::size_t kSamples = 400;

  M model_ = example<M>();
  Matrix features_ = example_features(kSamples, model_.input_count());
};

TYPED_TEST_SUITE_P(ModelLaws);

TYPED_TEST_P(ModelLaws, IsAModelAndItsStepNeverThrows) {
  static_assert(Model<TypeParam>);
  EXPECT_GT(this->model_.input_count(), 0U);
  EXPECT_GT(this->model_.parameter_count(), 0U);
}

TYPED_TEST_P(ModelLaws, ResetMakesARunRepeatable) {
  this->model_.reset();
  const auto first = values(this->model_, this->features_);
  this->model_.reset();
  EXPECT_EQ(values(this->model_, this->features_), first);
}

TYPED_TEST_P(ModelLaws, StartsAsAfterAReset) {
  TypeParam other = example<TypeParam>();
  other.reset();
  EXPECT_EQ(values(this->model_, this->features_), values(other, this->features_));
}

TYPED_TEST_P(ModelLaws, TwoInstancesDoNotShareState) {
  TypeParam alone = example<TypeParam>();
  const auto expected = values(alone, this->features_);
  TypeParam disturber = example<TypeParam>();
  for (std::size_t n = 0; n < this->features_.rows; ++n) {
    disturber.step(this->features_.row(this->features_.rows - 1 - n));
    EXPECT_EQ(this->model_.step(this->features_.row(n)).value, expected[n]) << "sample " << n;
  }
}

TYPED_TEST_P(ModelLaws, ACopyGoesOnAsItsOriginal) {
  values(this->model_, this->features_);
  TypeParam copy = this->model_;
  TypeParam assigned = example<TypeParam>();
  assigned = this->model_;
  const auto expected = values(this->model_, this->features_);
  EXPECT_EQ(values(copy, this->features_), expected);
  EXPECT_EQ(values(assigned, this->features_), expected);
}

TYPED_TEST_P(ModelLaws, ParametersAreAllThatItNeeds) {
  const auto parameters = this->model_.parameters();
  TypeParam again(parameters);
  EXPECT_EQ(values(again, this->features_), values(this->model_, this->features_));
  EXPECT_EQ(dump(again.parameters()), dump(parameters)) << "stepping must not change parameters";
  EXPECT_EQ(dump(this->model_.parameters()), dump(parameters));
}

TYPED_TEST_P(ModelLaws, SaysAFiniteValueForInputsFarOutsideItsRange) {
  Random random(3);
  std::vector<double> features(this->model_.input_count());
  for (int n = 0; n < 2000; ++n) {
    const double scale = std::pow(10.0, 12.0 * random.uniform() - 6.0);
    for (double& feature : features) feature = n % 7 == 0 ? 0.0 : scale * random.normal();
    const Estimate estimate = this->model_.step(features);
    EXPECT_TRUE(std::isfinite(estimate.value)) << "seed 3, case " << n;
  }
}

TYPED_TEST_P(ModelLaws, NeverClaimsCertainty) {
  for (std::size_t n = 0; n < this->features_.rows; ++n) {
    const double std_dev = this->model_.step(this->features_.row(n)).std_dev;
    EXPECT_TRUE(std::isnan(std_dev) || std_dev > 0.0) << "sample " << n << ": " << std_dev;
  }
}

REGISTER_TYPED_TEST_SUITE_P(ModelLaws, IsAModelAndItsStepNeverThrows, ResetMakesARunRepeatable,
                            StartsAsAfterAReset, TwoInstancesDoNotShareState,
                            ACopyGoesOnAsItsOriginal, ParametersAreAllThatItNeeds,
                            SaysAFiniteValueForInputsFarOutsideItsRange, NeverClaimsCertainty);

/// What a family that is `Invertible` owes besides.
template <class M>
class InverseLaws : public ModelLaws<M> {};

TYPED_TEST_SUITE_P(InverseLaws);

TYPED_TEST_P(InverseLaws, InvertLeadsBackToTheFirstInput) {
  static_assert(Invertible<TypeParam>);
  for (std::size_t n = 0; n < this->features_.rows; ++n) {
    const auto row = this->features_.row(n);
    const double target = this->model_.step(row).value;
    std::vector<double> guess(row.begin(), row.end());
    guess[0] = -0.03;
    const Estimate found = this->model_.invert(target, guess);
    const double tolerance = std::isnan(found.std_dev) ? 1e-10 : 2.0 * found.std_dev;
    EXPECT_NEAR(found.value, row[0], tolerance) << "sample " << n;
    EXPECT_EQ(found.fault, Fault::none) << "sample " << n;
  }
}

TYPED_TEST_P(InverseLaws, InvertDoesNotDependOnTheFirstInput) {
  std::vector<double> features(this->model_.input_count(), 0.1);
  const double target = this->model_.step(features).value;
  const double expected = this->model_.invert(target, features).value;
  for (const double given : {0.0, 1e300, -1e300, HUGE_VAL, kNotMeasured}) {
    features[0] = given;
    const Estimate found = this->model_.invert(target, features);
    EXPECT_NEAR(found.value, expected, 1e-12) << given;
    EXPECT_EQ(found.fault, Fault::none) << given;
  }
}

TYPED_TEST_P(InverseLaws, InvertSaysAFiniteValueWhateverItIsGiven) {
  for (const double target : {0.0, 1e300, HUGE_VAL, kNotMeasured})
    for (const double given : {0.0, 1e300, HUGE_VAL, kNotMeasured})
      for (const double other : {0.0, 1e300, HUGE_VAL, kNotMeasured}) {
        std::vector<double> features(this->model_.input_count(), other);
        features[0] = given;
        const Estimate found = this->model_.invert(target, features);
        EXPECT_TRUE(std::isfinite(found.value)) << target << ", " << given << ", " << other;
        EXPECT_TRUE(found.fault != Fault::none || std::isfinite(target + other))
            << target << ", " << given << ", " << other;
      }
}

REGISTER_TYPED_TEST_SUITE_P(InverseLaws, InvertLeadsBackToTheFirstInput,
                            InvertDoesNotDependOnTheFirstInput,
                            InvertSaysAFiniteValueWhateverItIsGiven);

}  // namespace torsio::test
