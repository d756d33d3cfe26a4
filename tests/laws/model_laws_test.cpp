#include "laws/model_laws.hpp"

#include "support/dump_any.hpp"

namespace torsio::test {

TYPED_TEST_SUITE(ModelLaws, EveryModel, ModelName);

TYPED_TEST(ModelLaws, IsAModelAndItsStepNeverThrows) {
  static_assert(Model<TypeParam>);
  EXPECT_GT(this->model_.input_count(), 0U);
  EXPECT_GT(this->model_.parameter_count(), 0U);
}

TYPED_TEST(ModelLaws, ResetMakesARunRepeatable) {
  this->model_.reset();
  const auto first = values(this->model_, this->features_);
  this->model_.reset();
  EXPECT_EQ(values(this->model_, this->features_), first);
}

TYPED_TEST(ModelLaws, StartsAsAfterAReset) {
  TypeParam other = example<TypeParam>();
  other.reset();
  EXPECT_EQ(values(this->model_, this->features_), values(other, this->features_));
}

TYPED_TEST(ModelLaws, TwoInstancesDoNotShareState) {
  TypeParam alone = example<TypeParam>();
  const auto expected = values(alone, this->features_);
  TypeParam disturber = example<TypeParam>();
  for (std::size_t n = 0; n < this->features_.rows; ++n) {
    disturber.step(this->features_.row(this->features_.rows - 1 - n));
    EXPECT_EQ(this->model_.step(this->features_.row(n)).value, expected[n]) << "sample " << n;
  }
}

TYPED_TEST(ModelLaws, ACopyGoesOnAsItsOriginal) {
  values(this->model_, this->features_);
  TypeParam copy = this->model_;
  TypeParam assigned = example<TypeParam>();
  assigned = this->model_;
  const auto expected = values(this->model_, this->features_);
  EXPECT_EQ(values(copy, this->features_), expected);
  EXPECT_EQ(values(assigned, this->features_), expected);
}

TYPED_TEST(ModelLaws, ParametersAreAllThatItNeeds) {
  const auto parameters = this->model_.parameters();
  TypeParam again(parameters);
  EXPECT_EQ(values(again, this->features_), values(this->model_, this->features_));
  EXPECT_EQ(dump(again.parameters()), dump(parameters)) << "stepping must not change parameters";
  EXPECT_EQ(dump(this->model_.parameters()), dump(parameters));
}

TYPED_TEST(ModelLaws, ReturnsAFiniteValueForInputsFarOutsideItsRange) {
  Random random(3);
  std::vector<double> features(this->model_.input_count());
  for (int n = 0; n < 2000; ++n) {
    const double scale = std::pow(10.0, 12.0 * random.uniform() - 6.0);
    for (double& feature : features) feature = n % 7 == 0 ? 0.0 : scale * random.normal();
    const Estimate estimate = this->model_.step(features);
    EXPECT_TRUE(std::isfinite(estimate.value)) << "seed 3, case " << n;
  }
}

TYPED_TEST(ModelLaws, NeverClaimsCertainty) {
  for (std::size_t n = 0; n < this->features_.rows; ++n) {
    const double std_dev = this->model_.step(this->features_.row(n)).std_dev;
    EXPECT_TRUE(std::isnan(std_dev) || std_dev > 0.0) << "sample " << n << ": " << std_dev;
  }
}

TYPED_TEST(ModelLaws, AdvancesItsMemoryAsAStepDoes) {
  if constexpr (Advances<TypeParam>) {
    TypeParam stepped = this->model_;
    for (std::size_t n = 0; n < this->features_.rows; ++n) {
      EXPECT_TRUE(this->model_.advance(this->features_.row(n)));
      (void)stepped.step(this->features_.row(n));
    }
    EXPECT_EQ(values(this->model_, this->features_), values(stepped, this->features_));
  }
}

}  // namespace torsio::test
