#include "torsio/estimate/torque_estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/examples/linear.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::kNaN;
using testing::HasSubstr;

Estimator estimator(const FeatureSpec& features, const std::string& target = "torque_Nm",
                    const std::vector<std::string>& zeroed_channels = {}) {
  return {{.features = features,
           .sample_rate_Hz = 1000.0,
           .target = target,
           .zeroed_channels = zeroed_channels,
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

/// Steps at a period of `period_s`, every tenth of which may be later by `late_s`. @returns the faults
std::vector<Fault> faults_at(TorqueEstimator torque, double period_s, double late_s = 0.0) {
  std::vector<Fault> faults;
  double t_s = 0.0;
  for (int n = 0; n < 200; ++n) {
    t_s += period_s + (n % 10 == 9 ? late_s : 0.0);
    faults.push_back(
        torque.step({.t_s = t_s, .gear_angle_rad = 0.1, .joint_angle_rad = 0.05}).fault);
  }
  return faults;
}

const FeatureSpec kFiltered{.inputs = {"gear_angle_rad", "lowpass(joint_angle_rad, 100Hz)"},
                            .definitions = {}};

TEST(TorqueEstimator, ReportsALoopThatDoesNotRunAtItsSampleRate) {
  for (const double period_s : {1e-2, 1.3e-3, 0.7e-3, 1e-4, 0.0}) {
    const std::vector<Fault> faults = faults_at(TorqueEstimator(estimator(kFiltered)), period_s);
    EXPECT_EQ(faults.back(), Fault::wrong_rate) << period_s;
    EXPECT_EQ(std::ranges::count(std::span(faults).first(17), Fault::wrong_rate), 0)
        << "no verdict before more than 16 periods";
  }
}

// At a wrong rate the filters start again in each tick: they never settle, and must not hide the cause.
TEST(TorqueEstimator, ReportsTheCausesThatAPersonHasToRemoveAndNotTheWarmUp) {
  for (const double period_s : {1e-2, 1e-4}) {
    const std::vector<Fault> faults = faults_at(
        TorqueEstimator(estimator(kFiltered, "torque_Nm", {"joint_angle_rad"})), period_s);
    EXPECT_EQ(faults.front(), Fault::zero_not_set) << period_s;
    EXPECT_EQ(faults.back(), Fault::wrong_rate) << period_s;
    EXPECT_EQ(std::ranges::count(faults, Fault::warming_up), 0) << period_s;
  }
}

TEST(TorqueEstimator, SingleLateTicksAndSmallDifferencesAreNoFault) {
  for (const double period_s : {1.0e-3, 1.15e-3, 0.85e-3})
    EXPECT_EQ(faults_at(TorqueEstimator(estimator(kFiltered)), period_s).back(), Fault::none);
  EXPECT_EQ(faults_at(TorqueEstimator(estimator(kFiltered)), 1.0e-3, 5.0e-3).back(), Fault::none);
}

TEST(TorqueEstimator, DoesNotCheckTheRateWithoutTimeStampsOrWhereNothingDependsOnIt) {
  EXPECT_EQ(faults_at(TorqueEstimator(estimator(kFiltered)), kNaN).back(), Fault::none);
  const FeatureSpec present{.inputs = {"gear_angle_rad", "joint_angle_rad"}, .definitions = {}};
  EXPECT_EQ(faults_at(TorqueEstimator(estimator(present)), 1e-2).back(), Fault::none);
}

}  // namespace
}  // namespace torsio
