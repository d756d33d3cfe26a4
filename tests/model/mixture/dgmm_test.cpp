#include "model/mixture/dgmm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "model/common/parameters.hpp"
#include "model/mixture/random_mixture.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

static_assert(Model<Dgmm>);

// A mixture along target = 3 * input 0, and a line with another slope, so that the two differ.
Dgmm::Parameters example() {
  Dgmm::Parameters parameters;
  GaussianMixture& mixture = parameters.mixture;
  constexpr std::size_t kComponents = 21;
  mixture = {.centre = {10.0, 0.0, 0.0},
             .scale = {3.0, 1.0, 1.0},
             .weights = std::vector<double>(kComponents, 1.0 / kComponents),
             .means = Matrix(kComponents, 3),
             .covariances = Matrix(kComponents, 9)};
  for (std::size_t i = 0; i < kComponents; ++i) {
    const double at = -1.0 + 0.1 * static_cast<double>(i);
    const std::vector<double> mean = {at, at, 0.0};
    std::copy(mean.begin(), mean.end(), mixture.means.row(i).begin());
    const std::vector<double> covariance = {0.0101, 0.01, 0.0, 0.01, 0.0101, 0.0, 0.0, 0.0, 0.01};
    std::copy(covariance.begin(), covariance.end(), mixture.covariances.row(i).begin());
  }
  parameters.clamp = {.intercept = 10.0,
                      .slope = {2.0, 0.0},
                      .width = 0.5,
                      .thin_log_density = -4.0,
                      .thin_log_density_inverse = -4.0};
  return parameters;
}

TEST(Dgmm, FollowsTheMixtureWhereDataAreDense) {
  Dgmm model(example());
  const Estimate estimate = model.step(std::vector{0.8, 0.0});
  EXPECT_NEAR(estimate.value, 10.0 + 3.0 * 0.8, 0.01);  // 0.8 from the line, more than its width
  EXPECT_LT(estimate.std_dev, 0.1);
  EXPECT_EQ(estimate.fault, Fault::none);
}

TEST(Dgmm, StaysNearTheLineFarFromAllData) {
  Dgmm model(example());
  for (const double input : {-1e6, -50.0, 3.0, 50.0, 1e6}) {
    const Estimate estimate = model.step(std::vector{input, 0.0});
    EXPECT_NEAR(estimate.value, 10.0 + 2.0 * input, 0.5 * (1.0 + 1e-9) + 1e-9 * std::abs(input));
    const double torque = 10.0 + 2.0 * input;
    EXPECT_NEAR(model.invert(torque, std::vector{0.0, 0.0}).value, input,
                0.25 * (1.0 + 1e-9) + 1e-9 * std::abs(input));
  }
}

TEST(Dgmm, NoveltyAndErrorBarGrowAwayFromTheData) {
  Dgmm model(example());
  const Estimate inside = model.step(std::vector{0.5, 0.0});
  const Estimate outside = model.step(std::vector{4.0, 0.0});
  EXPECT_GT(outside.novelty, inside.novelty + 100.0);
  EXPECT_GT(outside.std_dev, inside.std_dev);
}

TEST(Dgmm, TheErrorBarCoversWhatTheClampMoved) {
  Dgmm::Parameters parameters = example();
  const double free_value = [&] {
    Dgmm::Parameters unclamped = parameters;
    unclamped.clamp.width = 0.0;
    return Dgmm(unclamped).step(std::vector{4.0, 0.0}).value;
  }();
  const Estimate estimate = Dgmm(parameters).step(std::vector{4.0, 0.0});
  EXPECT_GT(std::abs(free_value - estimate.value), 1.0);
  EXPECT_GE(estimate.std_dev, std::abs(free_value - estimate.value));
}

TEST(Dgmm, TheClampHasNoStepWhereItSetsIn) {
  Dgmm model(example());
  constexpr double kStep = 1e-5;
  double last = model.step(std::vector{1.0, 0.0}).value;
  for (int k = 1; k <= 100000; ++k) {
    const double input = 1.0 + kStep * k;
    const double value = model.step(std::vector{input, 0.0}).value;
    ASSERT_NEAR(value, last, 1e-3) << "at " << input;
    last = value;
  }
}

TEST(Dgmm, InvertsByConditioningTheSameMixtureTheOtherWay) {
  Dgmm::Parameters parameters;
  parameters.mixture = test::random_mixture({.components = 30, .background = true}, 9);
  parameters.clamp.slope = {1.0, 0.0, 0.0};
  Dgmm model(parameters);
  const MixtureRegression other_way(parameters.mixture, 1);
  for (int k = 0; k < 20; ++k) {
    const double x = 0.1 * k - 1.0;
    const Estimate found = model.invert(x, std::vector{99.0, 0.3, -x});
    const Conditional expected = other_way.query_exact(std::vector{x, 0.3, -x});
    EXPECT_NEAR(found.value, expected.mean, 1e-4);
    EXPECT_NEAR(found.std_dev, std::sqrt(expected.variance), 1e-4);
    EXPECT_NEAR(found.novelty, -expected.log_density, 1e-4);
    EXPECT_EQ(found.fault, Fault::none);
  }
}

TEST(Dgmm, InvertLeadsBackToItsTarget) {
  Dgmm model(example());
  for (const double deflection : {-0.7, -0.2, 0.0, 0.4, 0.9}) {
    const double torque = model.step(std::vector{deflection, 0.0}).value;
    EXPECT_NEAR(model.invert(torque, std::vector{0.0, 0.0}).value, deflection, 0.02);
  }
}

TEST(Dgmm, AnInputWithoutDensityIsAFaultWithAFiniteValue) {
  Dgmm model(example());
  for (const double bad : {1e200, -1e300, std::numeric_limits<double>::quiet_NaN()}) {
    const Estimate estimate = model.step(std::vector{bad, 0.0});
    EXPECT_EQ(estimate.fault, Fault::model_not_finite);
    EXPECT_TRUE(std::isfinite(estimate.value));
    EXPECT_TRUE(std::isnan(estimate.std_dev));
    const Estimate inverse = model.invert(bad, std::vector{0.0, 0.0});
    EXPECT_EQ(inverse.fault, Fault::model_not_finite);
    EXPECT_TRUE(std::isfinite(inverse.value));
    EXPECT_TRUE(std::isnan(inverse.std_dev));
  }
}

TEST(Dgmm, CopiesDoNotShareState) {
  Dgmm model(example());
  Dgmm copy = model;
  const double expected = copy.step(std::vector{0.3, 0.1}).value;
  static_cast<void>(model.step(std::vector{-0.9, 0.4}));
  EXPECT_EQ(copy.step(std::vector{0.3, 0.1}).value, expected);
}

TEST(Dgmm, ListsEveryFieldOfItsParameters) {
  const Dgmm::Parameters parameters = example();
  std::vector<std::string> names;
  for_each_leaf(parameters, [&](const std::string& name, const auto&) { names.push_back(name); });
  EXPECT_EQ(names, (std::vector<std::string>{
                       "mixture.centre", "mixture.scale", "mixture.weights", "mixture.means",
                       "mixture.covariances", "clamp.intercept", "clamp.slope", "clamp.width",
                       "clamp.thin_log_density", "clamp.thin_log_density_inverse"}));
}

TEST(Dgmm, RefusesAClampThatDoesNotFitTheMixture) {
  Dgmm::Parameters wrong_slope = example();
  wrong_slope.clamp.slope.pop_back();
  EXPECT_THROW(Dgmm{wrong_slope}, Error);
  Dgmm::Parameters wrong_width = example();
  wrong_width.clamp.width = -1.0;
  EXPECT_THROW(Dgmm{wrong_width}, Error);
  Dgmm::Parameters not_finite = example();
  not_finite.clamp.thin_log_density = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Dgmm{not_finite}, Error);
}

}  // namespace
}  // namespace torsio
