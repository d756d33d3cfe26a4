#include "torsio/model/any_model.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "model/common/parameters.hpp"
#include "support/every_family.hpp"
#include "support/example_models.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::example;

template <class Family>
class AnyModelOfEvery : public testing::Test {};
TYPED_TEST_SUITE(AnyModelOfEvery, test::EveryFamily);

TYPED_TEST(AnyModelOfEvery, BehavesAsTheFamilyInIt) {
  TypeParam model = example<TypeParam>();
  AnyModel any = model;
  EXPECT_EQ(any.family(), TypeParam::kFamily);
  EXPECT_EQ(any.input_count(), model.input_count());
  EXPECT_EQ(any.parameter_count(), model.parameter_count());
  EXPECT_EQ(any.feeds_back(), FeedsBack<TypeParam>);
  EXPECT_EQ(any.can_invert(), Invertible<TypeParam>);
  EXPECT_EQ(any.state().empty(), !HasState<TypeParam>);
  ASSERT_NE(any.get_if<TypeParam>(), nullptr);
  AnyModel again(any.parameters());
  const Matrix features = test::example_features(300, model.input_count());
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double expected = model.step(features.row(n)).value;
    EXPECT_EQ(any.step(features.row(n)).value, expected);
    EXPECT_EQ(again.step(features.row(n)).value, expected);
    if constexpr (Invertible<TypeParam>) {
      EXPECT_EQ(any.invert(expected, features.row(n)).value,
                model.invert(expected, features.row(n)).value);
    }
  }
}

TYPED_TEST(AnyModelOfEvery, AdvancesItsMemoryAsAStepDoes) {
  AnyModel advanced = example<TypeParam>();
  AnyModel stepped = advanced;
  const Matrix features = test::example_features(300, advanced.input_count());
  for (std::size_t n = 0; n < features.rows; ++n) {
    EXPECT_TRUE(advanced.advance(features.row(n)));
    (void)stepped.step(features.row(n));
  }
  EXPECT_EQ(advanced.step(features.row(0)).value, stepped.step(features.row(0)).value);
}

TEST(AnyModel, IsAValue) {
  AnyModel model = example<MaxwellSlipModel>();
  const Matrix features = test::example_features(100, model.input_count());
  for (std::size_t n = 0; n < 50; ++n) (void)model.step(features.row(n));
  AnyModel copy = model;  // with its memory
  AnyModel assigned = example<Linear>();
  assigned = copy;
  for (std::size_t n = 50; n < features.rows; ++n) {
    const double expected = model.step(features.row(n)).value;
    EXPECT_EQ(copy.step(features.row(n)).value, expected);
    EXPECT_EQ(assigned.step(features.row(n)).value, expected);
  }
}

TEST(AnyParameters, AreAValueOfOneFamily) {
  const AnyParameters given = example<Linear>().parameters();
  AnyParameters copy = given;
  copy.get<Linear::Parameters>().coefficients.values(0, 1) = 7.0;
  EXPECT_NE(given.get<Linear::Parameters>().coefficients.values(0, 1), 7.0);
  EXPECT_EQ(copy.get_if<Mlp::Parameters>(), nullptr);
  EXPECT_THROW((void)copy.get<Mlp::Parameters>(), Error);
}

/// A model of the user's own: one that names its family can be held as well.
class Constant {
 public:
  static constexpr std::string_view kFamily = "constant";
  struct Parameters {
    using Family = Constant;
    double value = 0.0;
  };
  explicit Constant(const Parameters& parameters) : parameters_(parameters) {}
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] static std::size_t input_count() noexcept { return 1; }
  [[nodiscard]] static std::size_t parameter_count() noexcept { return 1; }
  void reset() noexcept {}
  Estimate step(Features /*features*/) const noexcept { return {.value = parameters_.value}; }

 private:
  Parameters parameters_;
};

TEST(AnyModel, HoldsAModelOfTheUsersOwn) {
  AnyModel model{AnyParameters(Constant::Parameters{.value = 3.0})};
  EXPECT_EQ(model.family(), "constant");
  EXPECT_EQ(model.step(std::vector{1.0}).value, 3.0);
  EXPECT_FALSE(model.can_invert());
}

TEST(AnyModel, ReportsThatAFamilyCannotInvert) {
  AnyModel any = example<Mlp>();
  const Estimate estimate = any.invert(1.0, std::vector{0.3, 0.1});
  EXPECT_EQ(estimate.fault, Fault::model_not_finite);
  EXPECT_EQ(estimate.value, 0.3);
}

TEST(AnyModel, ParametersNameTheirLeaves) {
  auto parameters = example<Polynomial>().parameters();
  std::string names;
  for_each_leaf(parameters, [&](const std::string& path, const auto&) { names += path + ' '; });
  EXPECT_EQ(names,
            "coefficients.scheduled coefficients.feature coefficients.knots coefficients.values "
            "degree by_direction dead_band centre half_range ranges ");
}

}  // namespace
}  // namespace torsio
