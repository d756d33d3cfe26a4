#include "torsio/identify/calibrate_joints.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/error_message.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// A few seconds of the simulated arm with this payload on a tilted base.
CalibrationMotion moved(double com_z_m, double tilt_rad) {
  CalibrationMotion motion{.setup = arm6_setup(), .recording = Recording("empty", 1000.0)};
  motion.setup.arm.payload.com_m[2] = com_z_m;
  motion.setup.arm.gravity_m_s2 = tilted_gravity(tilt_rad);
  ArmRunSpec spec{.program = {.start_rad = {0.0, -1.0, 1.7, 0.0, 0.7, 0.0}},
                  .has_gear_stage = false,
                  .with_truth = true};
  spec.program.steps.push_back({.task = ArmTask::move, .to_rad = {1.4, -0.2, 0.4, 1.2, 1.2, -0.8}});
  spec.program.steps.push_back({.task = ArmTask::move, .to_rad = {0.4, 0.0, 0.0, -0.8, 0.0, 1.6}});
  motion.recording = run_arm(motion.setup, spec).record;
  return motion;
}

const std::vector<CalibrationMotion>& motions() {
  static const std::vector<CalibrationMotion> all{moved(0.1, 0.0), moved(0.1, 0.52)};
  return all;
}

TEST(CalibrateJoints, GivesTheTorqueOfALoadCell) {
  const std::vector<CalibratedJoint> joints = calibrate_joints(motions());
  ASSERT_EQ(joints.size(), 6U);
  for (std::size_t j = 0; j < 6; ++j) {
    ASSERT_EQ(joints[j].recordings.size(), 2U);
    const Recording& own = joints[j].recordings[1];
    const Recording& all = motions()[1].recording;
    const std::vector<double>& truth = all.channel("truth_" + joints[j].name + "_torque_Nm").values;
    const std::vector<double>& target = own.channel("torque_Nm").values;
    const std::size_t skipped = (truth.size() - target.size()) / 2;
    double squares = 0.0;
    for (std::size_t n = 0; n < target.size(); ++n) {
      const double error = target[n] - truth[n + skipped];
      squares += error * error;
    }
    const double rmse_Nm = std::sqrt(squares / static_cast<double>(target.size()));
    EXPECT_LT(rmse_Nm, 0.005 * joints[j].rating_Nm) << joints[j].name;
    EXPECT_TRUE(own.has("gear_angle_rad"));
    EXPECT_EQ(own.channel("gear_angle_rad").values[5],
              all.channel(joints[j].name + "_gear_angle_rad").values[5 + skipped]);
  }
}

TEST(CalibrateJoints, ReportsJointsThatTheWeightDoesNotLoad) {
  const std::vector<CalibratedJoint> level = calibrate_joints(std::span(motions()).first(1));
  EXPECT_FALSE(level[0].is_determined);
  EXPECT_THAT(level[0].reason, HasSubstr("% of the rating"));
  EXPECT_TRUE(level[1].is_determined);
  EXPECT_TRUE(level[5].is_determined) << level[5].largest_weight_Nm;
  const std::vector<CalibratedJoint> both = calibrate_joints(motions());
  EXPECT_GT(both[0].largest_weight_Nm, level[0].largest_weight_Nm + 5.0);
}

TEST(CalibrateJoints, HasTheUncertaintyOfWeightAndLinksInItsTarget) {
  const auto exact = calibrate_joints(
      motions(), {.weight_share = 0.0, .attachment_m = 0.0, .link_share = 0.0, .link_com_m = 0.0});
  EXPECT_EQ(exact[1].target_std_Nm, 0.0);
  const auto usual = calibrate_joints(motions());
  EXPECT_GT(usual[1].links_std_Nm, usual[1].weight_std_Nm);
  EXPECT_GT(usual[1].weight_std_Nm, 0.02);
  EXPECT_NEAR(usual[1].target_std_Nm, std::hypot(usual[1].links_std_Nm, usual[1].weight_std_Nm),
              1e-12);
}

TEST(CalibrateJoints, RefusesWhatCannotBeWithPlaceAndReason) {
  const auto refused = [](CalibrationMotion motion) {
    return test::error_message([&] { (void)calibrate_joints({&motion, 1}); });
  };
  CalibrationMotion motion = motions()[0];
  motion.setup.arm.payload = {};
  EXPECT_THAT(refused(motion), HasSubstr("no known weight"));
  motion = motions()[0];
  motion.setup.arm.payload.mass_kg = 20.0;
  EXPECT_THAT(refused(motion), HasSubstr("beyond the rating"));
  motion = motions()[0];
  motion.setup.arm.joints[3].name = "elbow";
  EXPECT_THAT(refused(motion), HasSubstr("elbow_joint_angle_rad"));
  motion.recording = Recording("short", 1000.0);
  motion.recording.add({.name = "joint1_joint_angle_rad", .values = {0.0, 0.1, 0.2}});
  EXPECT_THAT(refused(motion), HasSubstr("too short"));
  const std::vector<CalibrationMotion> different{motions()[0], [] {
                                                   CalibrationMotion other = motions()[1];
                                                   other.setup.joints[0] = other.setup.joints[2];
                                                   return other;
                                                 }()};
  EXPECT_THAT(test::error_message([&] { (void)calibrate_joints(different); }),
              HasSubstr("different arms"));
  EXPECT_THAT(test::error_message([] { (void)calibrate_joints(motions(), {.weight_share = 1.0}); }),
              HasSubstr("weight_share"));
}

}  // namespace
}  // namespace torsio
