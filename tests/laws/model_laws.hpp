#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <concepts>
#include <cstdio>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "support/example_data.hpp"
#include "support/example_models.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/model/parameters.hpp"
#include "torsio/train/families.hpp"
#include "torsio/train/model_run.hpp"

/// What it means to be a model family. A new one specialises `example` (support/example_models.hpp)
/// and adds one line:
///
///     INSTANTIATE_TYPED_TEST_SUITE_P(Linear, ModelLaws, Linear);
///
/// That NaN in gives a fault and a finite value out is a law of the estimator, that saving and
/// loading changes no bit one of the model files.
namespace torsio::test {

template <class M>
std::vector<double> values(M& model, const Matrix& features) {
  std::vector<double> all;
  for (std::size_t n = 0; n < features.rows; ++n) all.push_back(model.step(features.row(n)).value);
  return all;
}

/// Every leaf of a set of parameters, written out exactly.
template <class Parameters>
std::string dump(const Parameters& parameters) {
  std::string text;
  const auto number = [&text](double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, " %a", value);
    text += buffer;
  };
  for_each_leaf(parameters, [&](const std::string& path, const auto& leaf) {
    using Leaf = std::remove_cvref_t<decltype(leaf)>;
    text += '\n' + path;
    if constexpr (std::same_as<Leaf, Matrix>) {
      text += ' ' + std::to_string(leaf.rows) + 'x' + std::to_string(leaf.columns);
      for (const double value : leaf.values) number(value);
    } else if constexpr (std::same_as<Leaf, std::vector<double>>) {
      for (const double value : leaf) number(value);
    } else {
      number(static_cast<double>(leaf));
    }
  });
  return text;
}

inline std::string dump(const AnyModel::Parameters& parameters) {
  return std::visit([](const auto& own) { return dump(own); }, parameters);
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

TYPED_TEST_P(ModelLaws, InvertLeadsBackToTheFirstInput) {
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

TYPED_TEST_P(ModelLaws, InvertDoesNotDependOnTheFirstInput) {
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

TYPED_TEST_P(ModelLaws, InvertSaysAFiniteValueWhateverItIsGiven) {
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

TYPED_TEST_P(ModelLaws, OfflineEqualsStreaming) {
  const Sequence sequence{.recording = "example", .features = this->features_};
  AnyModel any = this->model_;
  (void)run(any, sequence);  // what came before a run must not matter
  const std::vector<Estimate> offline = run(any, sequence);
  for (std::size_t n = 0; n < offline.size(); ++n) {
    const Estimate streamed = this->model_.step(this->features_.row(n));
    EXPECT_EQ(offline[n].value, streamed.value) << "sample " << n;
    EXPECT_TRUE(offline[n].std_dev == streamed.std_dev ||
                (std::isnan(offline[n].std_dev) && std::isnan(streamed.std_dev)));
  }
}

TYPED_TEST_P(ModelLaws, AFitIsDeterministic) {
  const FamilyInfo& family = find_family(AnyModel(this->model_).family());
  const Options options(family.options, {});
  const TrainingData data = noisy_spring();
  const FittedModel first = family.fit(data, options, 5, {});
  const FittedModel second = family.fit(data, options, 5, {});
  EXPECT_EQ(dump(first.model.parameters()), dump(second.model.parameters()));
  EXPECT_EQ(first.notes, second.notes);
  EXPECT_EQ(first.model.input_count(), data.input_count());
  EXPECT_EQ(first.model.family(), family.name);
}

TYPED_TEST_P(ModelLaws, AFitBeatsTheMeanOfTheTarget) {
  const FamilyInfo& family = find_family(AnyModel(this->model_).family());
  const TrainingData data = noisy_spring();
  const FittedModel fitted = family.fit(data, Options(family.options, {}), 5, {});
  EXPECT_GT(evaluate(fitted.model, data).fit_percent, 80.0);
}

TYPED_TEST_P(ModelLaws, AFitStopsWhenAsked) {
  const FamilyInfo& family = find_family(AnyModel(this->model_).family());
  const Progress stop = [](double, std::string_view) { return false; };
  EXPECT_THROW(family.fit(noisy_spring(), Options(family.options, {}), 5, stop), Cancelled);
}

REGISTER_TYPED_TEST_SUITE_P(ModelLaws, IsAModelAndItsStepNeverThrows, ResetMakesARunRepeatable,
                            StartsAsAfterAReset, TwoInstancesDoNotShareState,
                            ACopyGoesOnAsItsOriginal, ParametersAreAllThatItNeeds,
                            SaysAFiniteValueForInputsFarOutsideItsRange, NeverClaimsCertainty,
                            InvertLeadsBackToTheFirstInput, InvertDoesNotDependOnTheFirstInput,
                            InvertSaysAFiniteValueWhateverItIsGiven, OfflineEqualsStreaming,
                            AFitIsDeterministic, AFitBeatsTheMeanOfTheTarget, AFitStopsWhenAsked);

}  // namespace torsio::test
