#include "torsio/model/any_model.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/example_models.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/parameters.hpp"

namespace torsio {
namespace {

using test::example;

template <class Family>
void expect_same_behaviour(Family model) {
  AnyModel any = model;
  EXPECT_EQ(any.family(), Family::kFamily);
  EXPECT_EQ(any.input_count(), model.input_count());
  EXPECT_EQ(any.parameter_count(), model.parameter_count());
  ASSERT_NE(any.get_if<Family>(), nullptr);
  AnyModel again(any.parameters());
  const Matrix features = test::example_features(300, model.input_count());
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double expected = model.step(features.row(n)).value;
    EXPECT_EQ(any.step(features.row(n)).value, expected);
    EXPECT_EQ(again.step(features.row(n)).value, expected);
    if constexpr (Invertible<Family>) {
      EXPECT_EQ(any.invert(expected, features.row(n)).value,
                model.invert(expected, features.row(n)).value);
    }
  }
  EXPECT_EQ(any.can_invert(), Invertible<Family>);
}

TEST(AnyModel, BehavesAsTheFamilyInIt) {
  expect_same_behaviour(example<Linear>());
  expect_same_behaviour(example<LinearCoulomb>());
  expect_same_behaviour(example<Polynomial>());
  expect_same_behaviour(example<Dgmm>());
  expect_same_behaviour(example<Mlp>());
  expect_same_behaviour(example<GaussianProcess>());
  expect_same_behaviour(example<ParametricGp>());
  expect_same_behaviour(example<Lstm>());
  expect_same_behaviour(example<Gru>());
}

TEST(AnyModel, GivesEmptyParametersByFamilyName) {
  const AnyModel::Parameters parameters = parameters_of_family("polynomial");
  EXPECT_TRUE(std::holds_alternative<Polynomial::Parameters>(parameters));
  EXPECT_EQ(family_of(parameters), "polynomial");
}

TEST(AnyModel, SaysThatAFamilyCannotInvert) {
  AnyModel any = example<Mlp>();
  const Estimate told = any.invert(1.0, std::vector{0.3, 0.1});
  EXPECT_EQ(told.fault, Fault::model_not_finite);
  EXPECT_EQ(told.value, 0.3);
}

TEST(AnyModel, NamesTheKnownFamiliesWhenOneIsUnknown) {
  try {
    (void)parameters_of_family("lineal");
    FAIL() << "accepted an unknown family";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("lineal"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("linear, linear_coulomb, polynomial"),
              std::string::npos);
  }
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
