#include "torsio/estimate/adaptive_estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "model/network/ensemble.hpp"
#include "support/dump.hpp"
#include "support/error_message.hpp"
#include "support/example_settings.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/network.hpp"
#include "support/numbers.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::example;
using test::kNaN;
using testing::HasSubstr;

EstimatorSettings settings_without_zeros() {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels.clear();
  return settings;
}

template <class Network>
class Adapted : public testing::Test {};
using Networks = testing::Types<Mlp, Lstm, Gru>;
TYPED_TEST_SUITE(Adapted, Networks);

template <class Network>
std::string weights(const AnyModel::Parameters& network) {
  return test::dump(network.get<typename Network::Parameters>());
}

std::array<double, 2> raw_at(int n) { return {0.1 * std::sin(0.01 * n), 0.0}; }

/// Steps an estimator and its frozen twin; the reference is the frozen value, wrong by as much.
/// @returns mean |error| of the adapted one in the second half.
double run(AdaptiveEstimator& adaptive, Estimator frozen, double wrong_by, int samples = 4000) {
  double sum = 0.0;
  for (int n = 0; n < samples; ++n) {
    const double reference = frozen.step(raw_at(n)).value + wrong_by;
    const double output = adaptive.step(raw_at(n)).value;
    if (n >= samples / 2) sum += std::abs(output - reference);
    (void)adaptive.learn({.value = reference + 1e-6 * (n % 2)});
  }
  return 2.0 * sum / samples;
}

TYPED_TEST(Adapted, LearnsAnOffsetWhateverTheFamily) {
  const auto network = example<TypeParam>().parameters();
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    AdaptiveEstimator adaptive(settings_without_zeros(), network,
                               {.rule = rule, .confirmation_s = 0.0});
    const Estimator frozen(settings_without_zeros(), AnyModel(example<TypeParam>()));
    EXPECT_LT(run(adaptive, frozen, 3.0), 1.0);
    EXPECT_GT(adaptive.adapter().counts().updates(), 3000U);
    EXPECT_GT(adaptive.adapter().counts().of(UpdateOutcome::warming_up), 0U);
    EXPECT_EQ(adaptive.adapter().counts().roll_backs, 0U);
  }
}

TYPED_TEST(Adapted, TheAdaptedNetworkHasTheOutputsOfTheAdaptiveOne) {
  const auto network = example<TypeParam>().parameters();
  AdaptiveEstimator adaptive(settings_without_zeros(), network, {.confirmation_s = 0.0});
  (void)run(adaptive, Estimator(settings_without_zeros(), AnyModel(example<TypeParam>())), 3.0);
  adaptive.pause();
  adaptive.reset();
  Estimator kept(settings_without_zeros(), AnyModel(adaptive.adapted()));
  for (int n = 0; n < 1000; ++n) {
    const Estimate output = adaptive.step(raw_at(n));
    const Estimate again = kept.step(raw_at(n));
    EXPECT_NEAR(output.value, again.value, 1e-4);
    EXPECT_EQ(output.fault, again.fault);
  }
}

TYPED_TEST(Adapted, ResetKeepsTheWeightsAndForgetDoesNot) {
  const AnyModel::Parameters network = example<TypeParam>().parameters();
  AdaptiveEstimator adaptive(settings_without_zeros(), network, {.confirmation_s = 0.0});
  (void)run(adaptive, Estimator(settings_without_zeros(), AnyModel(example<TypeParam>())), 3.0);
  const std::string learned = weights<TypeParam>(adaptive.adapted());
  adaptive.reset();
  EXPECT_EQ(adaptive.step(raw_at(0)).fault, Fault::warming_up);
  EXPECT_EQ(weights<TypeParam>(adaptive.adapted()), learned);
  EXPECT_NE(learned, weights<TypeParam>(network));
  adaptive.forget();
  EXPECT_EQ(weights<TypeParam>(adaptive.adapted()), weights<TypeParam>(network));
}

TYPED_TEST(Adapted, TicksWithoutAnEstimateOfTheNetworkChangeNoWeights) {
  const AnyModel::Parameters network = example<TypeParam>().parameters();
  AdaptiveEstimator adaptive(settings_without_zeros(), network, {});
  EXPECT_EQ(adaptive.learn({.value = 1.0}), UpdateOutcome::warming_up);
  for (int n = 0; n < 1000; ++n) (void)adaptive.step(raw_at(n));
  (void)adaptive.step(std::array{kNaN, 0.0});
  EXPECT_EQ(adaptive.learn({.value = 1.0}), UpdateOutcome::no_estimate);
  EXPECT_EQ(adaptive.step(std::array{50.0, 0.0}).fault, Fault::outside_training_range);
  EXPECT_EQ(adaptive.learn({.value = 1.0}), UpdateOutcome::no_estimate);
  EXPECT_EQ(weights<TypeParam>(adaptive.adapted()), weights<TypeParam>(network));
}

TEST(AdaptiveEstimator, AHeldValueHasNoErrorBar) {
  const auto network = example<Mlp>().parameters();
  AdaptiveEstimator adaptive(settings_without_zeros(), network, {.confirmation_s = 0.0});
  static_cast<void>(
      run(adaptive, Estimator(settings_without_zeros(), AnyModel(example<Mlp>())), 3.0));
  ASSERT_GT(adaptive.adapter().recent_rmse(), 0.0);
  Estimate held;
  for (int n = 0; n < 100; ++n) held = adaptive.step(std::array{kNaN, 0.0});
  EXPECT_EQ(held.fault, Fault::input_not_finite);
  EXPECT_TRUE(std::isnan(held.std_dev));
}

TEST(AdaptiveEstimator, WaitsForItsZeros) {
  AdaptiveEstimator adaptive(test::example_settings(), example<Mlp>().parameters(),
                             {.confirmation_s = 0.0});
  for (int n = 0; n < 1000; ++n) (void)adaptive.step(raw_at(n));
  EXPECT_EQ(adaptive.learn({.value = 1.0}), UpdateOutcome::no_estimate);
  adaptive.set_zero("joint_angle_rad", 0.0);
  (void)adaptive.step(raw_at(1000));
  EXPECT_EQ(adaptive.learn({.value = 1.0}), UpdateOutcome::updated);
}

TEST(AdaptiveEstimator, RefusesFamiliesThatItCannotAdapt) {
  EXPECT_THAT(error_message([] {
                AdaptiveEstimator(test::example_settings(), example<Polynomial>().parameters(), {});
              }),
              HasSubstr("a dgmm or a grey_box, found polynomial"));
  EXPECT_THAT(error_message([] {
                AdaptiveEstimator(test::example_settings(), example<GruEnsemble>().parameters(),
                                  {});
              }),
              HasSubstr("found gru_ensemble"));
}

}  // namespace
}  // namespace torsio
