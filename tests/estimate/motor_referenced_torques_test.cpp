#include "torsio/estimate/motor_referenced_torques.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using test::kNaN;
using testing::HasSubstr;

constexpr double kPerDeg = 180.0 / std::numbers::pi;

/// Joint 3 of Table 3, as the paper prints it: per degree.
MotorReferencedTorques::Parameters joint_3() {
  return {.torque_constant_Nm_A = 0.180,
          .gear_ratio = 120.0,
          .gear = {36.400, -526.7 * kPerDeg, 0.0, 3.0109},
          .spring = {-1.007, -16.12 * kPerDeg, 0.7507 * kPerDeg, 8.9038}};
}

/// Gear 2 deg before the joint, motor 0.1 deg (of the joint) before the gear.
JointSample pushing() {
  return {.motor_angle_rad = 120.0 * rad_from_deg(12.1),
          .gear_angle_rad = rad_from_deg(12.0),
          .joint_angle_rad = rad_from_deg(10.0),
          .motor_current_A = 2.5};
}

TEST(MotorReferencedTorques, AreEquations17To19InTheUnitsOfTable3) {
  MotorReferencedTorques torques(joint_3());
  const double speed_deg_s = 20.0;
  const auto output = torques.step(pushing(), rad_from_deg(speed_deg_s));
  EXPECT_NEAR(output.motor_Nm, 0.180 * 120.0 * 2.5, 1e-12);
  EXPECT_NEAR(output.gear_Nm, 36.4 + 526.7 * 0.1 + 3.0109 * std::atan(100.0 * speed_deg_s), 1e-9);
  EXPECT_NEAR(output.spring_Nm,
              -1.007 + 16.12 * 2.0 + 0.7507 * speed_deg_s + 8.9038 * std::atan(100.0 * speed_deg_s),
              1e-9);
  EXPECT_EQ(output.motor_fault, Fault::none);
  EXPECT_EQ(output.gear_fault, Fault::none);
  EXPECT_EQ(output.spring_fault, Fault::none);
}

TEST(MotorReferencedTorques, OnTheLoadAreWithoutFriction) {
  MotorReferencedTorques torques(joint_3());
  const auto forwards = torques.step(pushing(), rad_from_deg(20.0));
  const auto backwards = torques.step(pushing(), rad_from_deg(-20.0));
  EXPECT_NEAR(forwards.spring_load_Nm, -1.007 + 16.12 * 2.0, 1e-9);
  EXPECT_NEAR(forwards.gear_load_Nm, 36.4 + 526.7 * 0.1, 1e-9);
  EXPECT_EQ(forwards.spring_load_Nm, backwards.spring_load_Nm);
  // Twice the viscous and Coulomb friction of the spring's coefficients; 8.9038 pi/2 is 14 Nm.
  EXPECT_NEAR(forwards.spring_Nm - backwards.spring_Nm, 2.0 * (0.7507 * 20.0 + 13.986), 0.02);
}

TEST(MotorReferencedTorques, WithoutASensorLoseOnlyTheTorquesThatNeedIt) {
  MotorReferencedTorques torques(joint_3());
  const auto good = torques.step(pushing(), 0.1);
  JointSample sample = pushing();
  sample.motor_angle_rad = kNaN;
  sample.motor_current_A = 3.0;
  const auto without_motor_encoder = torques.step(sample, 0.1);
  EXPECT_EQ(without_motor_encoder.gear_fault, Fault::input_not_finite);
  EXPECT_EQ(without_motor_encoder.gear_Nm, good.gear_Nm) << "held";
  EXPECT_EQ(without_motor_encoder.gear_load_Nm, good.gear_load_Nm);
  EXPECT_EQ(without_motor_encoder.spring_fault, Fault::none);
  EXPECT_EQ(without_motor_encoder.motor_fault, Fault::none);
  EXPECT_NEAR(without_motor_encoder.motor_Nm, 64.8, 1e-12);
  const auto without_speed = torques.step(pushing(), kNaN);
  EXPECT_EQ(without_speed.motor_fault, Fault::none);
  EXPECT_EQ(without_speed.gear_fault, Fault::input_not_finite);
  EXPECT_EQ(without_speed.spring_fault, Fault::input_not_finite);
  EXPECT_EQ(without_speed.spring_Nm, good.spring_Nm);
}

TEST(MotorReferencedTorques, AreFiniteForAnyInput) {
  MotorReferencedTorques torques(joint_3());
  EXPECT_EQ(torques.step({}, kNaN).motor_fault, Fault::input_not_finite);
  EXPECT_EQ(torques.step({}, kNaN).motor_Nm, 0.0);
  JointSample sample = pushing();
  sample.joint_angle_rad = 1e306;
  sample.motor_current_A = std::numeric_limits<double>::infinity();
  const auto output = torques.step(sample, 0.1);
  EXPECT_EQ(output.motor_fault, Fault::input_not_finite);
  EXPECT_EQ(output.spring_fault, Fault::model_not_finite);
  EXPECT_TRUE(std::isfinite(output.spring_Nm) && std::isfinite(output.spring_load_Nm));
  (void)torques.step(pushing(), 0.1);
  torques.reset();
  EXPECT_EQ(torques.step({}, kNaN).spring_Nm, 0.0);
}

TEST(MotorReferencedTorques, RefuseParametersThatNoJointHas) {
  auto parameters = joint_3();
  parameters.gear_ratio = 0.0;
  EXPECT_THAT(test::error_message([&] { MotorReferencedTorques{parameters}; }),
              HasSubstr("gear_ratio"));
  parameters = joint_3();
  parameters.torque_constant_Nm_A = kNaN;
  EXPECT_THAT(test::error_message([&] { MotorReferencedTorques{parameters}; }),
              HasSubstr("torque_constant_Nm_A"));
  parameters = joint_3();
  parameters.spring.viscous_Nms_rad = kNaN;
  EXPECT_THAT(test::error_message([&] { MotorReferencedTorques{parameters}; }),
              HasSubstr("spring viscous_Nms_rad"));
}

}  // namespace
}  // namespace torsio
