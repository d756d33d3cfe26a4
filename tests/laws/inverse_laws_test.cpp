#include "laws/model_laws.hpp"

namespace torsio::test {

/// The additional laws of a family that is `Invertible`.
template <class M>
class InverseLaws : public ModelLaws<M> {};

TYPED_TEST_SUITE(InverseLaws, EveryInvertibleModel, ModelName);

TYPED_TEST(InverseLaws, InvertLeadsBackToTheFirstInput) {
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

TYPED_TEST(InverseLaws, InvertDoesNotDependOnTheFirstInput) {
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

TYPED_TEST(InverseLaws, InvertReturnsAFiniteValueForAnyInput) {
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

}  // namespace torsio::test
