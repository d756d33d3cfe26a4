#include "torsio/estimate/torque_estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/error_message.hpp"
#include "support/examples/linear.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/any_estimator.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

Estimator estimator(const FeatureSpec& features, const std::string& target = "torque_Nm") {
  return {{.features = features,
           .sample_rate_Hz = 1000.0,
           .target = target,
           .zeroed_channels = {},
           .ranges = {.lowest = {-1.0, -1.0}, .highest = {1.0, 1.0}},
           .fallback = {.intercept = 0.0, .slope = {0.0, 0.0}},
           .residuals = {}},
          test::example<Linear>()};
}

TEST(TorqueEstimator, TakesItsInputsFromAJointSampleByName) {
  const FeatureSpec spec{
      .inputs = {"spring_deflection_rad", "motor_current_A"},
      .definitions = {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}}};
  TorqueEstimator torque(estimator(spec));
  Estimator by_channel = estimator(spec);
  ASSERT_THAT(by_channel.raw_inputs(),
              testing::ElementsAre("gear_angle_rad", "joint_angle_rad", "motor_current_A"));
  const Estimate estimate =
      torque.step({.gear_angle_rad = 0.3, .joint_angle_rad = 0.2, .motor_current_A = 0.5});
  EXPECT_EQ(estimate.fault, Fault::none);
  EXPECT_EQ(estimate.value, by_channel.step({{0.3, 0.2, 0.5}}).value);
}

TEST(TorqueEstimator, ComputesTheDeflectionOfAModelThatWasTrainedOnIt) {
  TorqueEstimator torque(
      estimator({.inputs = {"spring_deflection_rad", "motor_angle_rad"}, .definitions = {}}));
  Estimator by_channel =
      estimator({.inputs = {"spring_deflection_rad", "motor_angle_rad"}, .definitions = {}});
  const Estimate estimate =
      torque.step({.motor_angle_rad = 0.1, .gear_angle_rad = 0.75, .joint_angle_rad = 0.5});
  EXPECT_EQ(estimate.fault, Fault::none);
  EXPECT_EQ(estimate.value, by_channel.step({{0.25, 0.1}}).value);
}

TEST(TorqueEstimator, AMissingSensorIsAFaultNotATorque) {
  TorqueEstimator torque(
      estimator({.inputs = {"gear_angle_rad", "motor_current_A"}, .definitions = {}}));
  const Estimate estimate = torque.step({.gear_angle_rad = 0.1});
  EXPECT_EQ(estimate.fault, Fault::input_not_finite);
  EXPECT_TRUE(std::isfinite(estimate.value));
}

TEST(TorqueEstimator, RefusesAModelThatRequiresOtherChannels) {
  EXPECT_THAT(
      test::error_message([] {
        TorqueEstimator(estimator({.inputs = {"gear_angle_rad", "oil_K"}, .definitions = {}}));
      }),
      HasSubstr("raw input oil_K: expected one of t_s, motor_angle_rad, gear_angle_rad"));
}

TEST(TorqueEstimator, RefusesAModelOfSomethingElse) {
  EXPECT_THAT(
      test::error_message([] {
        TorqueEstimator(estimator(
            {.inputs = {"gear_angle_rad", "joint_angle_rad"}, .definitions = {}}, "force_N"));
      }),
      HasSubstr("expected a model whose target is a torque in Nm, found the target "
                "'force_N'"));
}

}  // namespace
}  // namespace torsio
