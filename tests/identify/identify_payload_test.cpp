#include "torsio/identify/identify_payload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "support/moving_arm.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::MovingArm;
using testing::HasSubstr;

const BodyInertia kHandled{4.0, {0.05, -0.03, 0.09}, {0.02, 0.03, 0.025, 0.001, -0.002, 0.003}};

ArmModel loaded(const BodyInertia& payload) {
  ArmModel arm = test::arm6();
  arm.payload = payload;
  return arm;
}

IdentifiedPayload identified(const ArmModel& arm, const MovingArm::Options& options,
                             const IdentificationOptions& with = {}) {
  const ArmMotion motion = MovingArm::of(arm, options);
  return identify_payload(test::arm6(), {&motion, 1}, with);
}

TEST(IdentifyPayload, FindsThePayloadOfAMotionWithoutNoise) {
  const IdentifiedPayload found = identified(loaded(kHandled), {}, {.speed_window_s = 0.004});
  EXPECT_NEAR(found.mass_kg.value, kHandled.mass_kg, 2e-4);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(found.com_m[i].value, kHandled.com_m[i], 1e-5) << i;
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(found.inertia_kg_m2[i].value, kHandled.inertia_kg_m2[i], 2e-4) << i;
  for (const IdentifiedJoint& joint : found.joints) EXPECT_NEAR(joint.dry_Nm.value, 0.0, 1e-3);
  EXPECT_TRUE(found.mass_kg.is_determined);
  EXPECT_NEAR(found.body().inertia_kg_m2[1], 0.03, 2e-4);
}

TEST(IdentifyPayload, FindsTheFrictionOfTheBearings) {
  const IdentifiedPayload found =
      identified(loaded(kHandled), {.noise_Nm = 0.02, .dry_Nm = 0.3, .viscous_Nms_rad = 0.1});
  EXPECT_NEAR(found.mass_kg.value, kHandled.mass_kg, 0.1);
  for (const IdentifiedJoint& joint : found.joints) {
    EXPECT_NEAR(joint.dry_Nm.value, 0.3, 5.0 * joint.dry_Nm.standard_error + 0.01) << joint.name;
    EXPECT_NEAR(joint.viscous_Nms_rad.value, 0.1, 0.06) << joint.name;
  }
}

TEST(IdentifyPayload, HasStandardErrorsThatCoverTheTruth) {
  int within = 0;
  int within_2 = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    const IdentifiedPayload found =
        identified(loaded(kHandled), {.duration_s = 25.0, .noise_Nm = 0.3, .seed = seed},
                   {.torque_scale_share = 0.0});
    const auto count = [&](const IdentifiedQuantity& of, double truth) {
      const double errors = std::abs(of.value - truth) / of.standard_error;
      within += errors < 1.0 ? 1 : 0;
      within_2 += errors < 2.0 ? 1 : 0;
      ++all;
    };
    count(found.mass_kg, kHandled.mass_kg);
    for (std::size_t i = 0; i < 3; ++i) count(found.com_m[i], kHandled.com_m[i]);
    for (std::size_t i = 0; i < 6; ++i) count(found.inertia_kg_m2[i], kHandled.inertia_kg_m2[i]);
  }
  // 68 and 95 % if the errors were exact; they are the larger ones of two.
  EXPECT_GE(within, static_cast<int>(0.63 * all)) << all;
  EXPECT_LE(within, static_cast<int>(0.88 * all)) << all;
  EXPECT_GE(within_2, static_cast<int>(0.93 * all)) << all;
}

TEST(IdentifyPayload, ReportsACoordinateAlongGravityOfOneOrientation) {
  // Only joint 1 moves: the flange turns about gravity.
  ArmModel arm = loaded(kHandled);
  ArmMotion motion = MovingArm::of(arm, {.noise_Nm = 0.01});
  const ArmDynamics dynamics(arm);
  for (std::size_t n = 0; n < motion.angle_rad[0].size(); ++n) {
    const ArmDynamics::PerJoint q = {motion.angle_rad[0][n], 0.4, 0.6, 0.0, -0.2, 0.1};
    ArmDynamics::PerJoint torque_Nm = {};
    dynamics.gravity_torque(q, torque_Nm);
    for (std::size_t j = 1; j < 6; ++j) motion.angle_rad[j][n] = q[j];
    for (std::size_t j = 1; j < 6; ++j)
      motion.torque_Nm[j][n] = torque_Nm[j] + 0.05 * std::sin(0.01 * static_cast<double>(n * j));
    motion.torque_Nm[0][n] = 0.0;
  }
  const IdentifiedPayload found = identify_payload(test::arm6(), {&motion, 1});
  EXPECT_TRUE(found.mass_kg.is_determined) << found.mass_kg.standard_error;
  int undetermined = 0;
  for (const IdentifiedQuantity& com : found.com_m)
    if (!com.is_determined) {
      ++undetermined;
      EXPECT_THAT(com.reason, HasSubstr("one orientation to gravity"));
    }
  EXPECT_GE(undetermined, 1);
}

TEST(IdentifyPayload, ReportsAMassWithoutTorque) {
  ArmModel arm = test::arm6();
  arm.joints.resize(1);  // a vertical axis
  arm.payload = kHandled;
  const ArmMotion motion = MovingArm::of(arm, {.noise_Nm = 0.01});
  arm.payload = {};
  const IdentifiedPayload found = identify_payload(arm, {&motion, 1});
  EXPECT_FALSE(found.mass_kg.is_determined);
  EXPECT_THAT(found.mass_kg.reason, HasSubstr("parallel"));
  EXPECT_EQ(found.body().mass_kg, 0.0);
}

TEST(IdentifyPayload, FindsThatThereIsNone) {
  const IdentifiedPayload found =
      identified(test::arm6(), {.noise_Nm = 0.05}, {.torque_scale_share = 0.0});
  EXPECT_NEAR(found.mass_kg.value, 0.0, 4.0 * found.mass_kg.standard_error);
  EXPECT_FALSE(found.com_m[0].is_determined);
  EXPECT_THAT(found.com_m[0].reason, HasSubstr("does not differ from 0"));
}

TEST(IdentifyPayload, TakesTheUncertaintyOfTheLinksIntoItsErrors) {
  const ArmModel arm = loaded(kHandled);
  const MovingArm::Options options{.noise_Nm = 0.02};
  const IdentifiedPayload exact = identified(arm, options, {.torque_scale_share = 0.0});
  const IdentifiedPayload within = identified(
      arm, options, {.torque_scale_share = 0.0, .link_share = 0.02, .link_com_m = 0.005});
  EXPECT_GT(identified(arm, options).mass_kg.standard_error, exact.mass_kg.standard_error);
  EXPECT_GT(within.mass_kg.standard_error, exact.mass_kg.standard_error);
  EXPECT_GT(within.com_m[0].standard_error, exact.com_m[0].standard_error);
}

TEST(IdentifyPayload, RefusesAStillArmAndAShortMotion) {
  ArmMotion motion = MovingArm::of(loaded(kHandled), {.duration_s = 2.0});
  const auto refused = [&] {
    return test::error_message([&] { (void)identify_payload(test::arm6(), {&motion, 1}); });
  };
  EXPECT_THAT(refused(), HasSubstr("too short"));
  for (auto& angle_rad : motion.angle_rad) angle_rad.assign(angle_rad.size(), 0.1);
  EXPECT_THAT(refused(), HasSubstr("does not move"));
  motion.angle_rad.pop_back();
  EXPECT_THAT(refused(), HasSubstr("6 joints"));
  motion = MovingArm::of(loaded(kHandled), {});
  EXPECT_THAT(test::error_message([&] {
                (void)identify_payload(test::arm6(), {&motion, 1}, {.window_s = 0.0});
              }),
              HasSubstr("window_s"));
  EXPECT_THAT(test::error_message([&] {
                (void)identify_payload(test::arm6(), {&motion, 1}, {.dry_Nm = {1.0}});
              }),
              HasSubstr("friction"));
}

/// A recording of an arm with these joints.
Recording recording_of(const ArmModel& arm) {
  Recording recording("moves", 1000.0);
  for (const ArmJoint& joint : arm.joints) {
    recording.add({.name = joint.name + "_joint_angle_rad", .values = {0.1, 0.2, 0.3}});
    recording.add({.name = joint.name + "_estimated_torque_Nm", .values = {1.0, 2.0, 3.0}});
  }
  return recording;
}

TEST(ArmMotion, IsReadFromTheChannelsOfTheJoints) {
  const ArmMotion motion = arm_motion(recording_of(test::arm6()), test::arm6());
  ASSERT_EQ(motion.angle_rad.size(), 6U);
  EXPECT_EQ(motion.torque_Nm[5][2], 3.0);
}

TEST(ArmMotion, IsRefusedIfItIsOfAnotherArmOrHasGaps) {
  ArmModel other = test::arm6();
  other.joints[2].name = "elbow";
  const Recording recording = recording_of(test::arm6());
  EXPECT_THAT(test::error_message([&] { (void)arm_motion(recording, other); }),
              HasSubstr("elbow_joint_angle_rad"));
  other = test::arm6();
  other.joints[1].highest_rad = 0.05;
  other.joints[1].lowest_rad = -0.05;
  EXPECT_THAT(test::error_message([&] { (void)arm_motion(recording, other); }),
              HasSubstr("another arm"));
  Recording gap("gap", 1000.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  gap.add({.name = "joint1_joint_angle_rad", .values = {0.1, nan, 0.3}});
  EXPECT_THAT(test::error_message([&] { (void)arm_motion(gap, test::arm6()); }),
              HasSubstr("joint1_joint_angle_rad at 0.001 s"));
}

}  // namespace
}  // namespace torsio
