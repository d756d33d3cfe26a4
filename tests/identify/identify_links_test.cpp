#include "torsio/identify/identify_links.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "support/moving_arm.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::MovingArm;
using testing::HasSubstr;

const IdentificationOptions kAssumed{
    .torque_scale_share = 0.0, .link_share = 0.1, .link_com_m = 0.01};

/// The arm of a URDF file whose links differ from the real ones.
ArmModel real_arm(std::uint64_t seed) {
  ArmModel arm = test::arm6();
  Random random(seed);
  for (ArmJoint& joint : arm.joints) {
    const double share = 1.0 + 0.05 * random.normal();
    joint.body.mass_kg *= share;
    for (double& moment : joint.body.inertia_kg_m2) moment *= share;
    for (double& com : joint.body.com_m) com += 0.004 * random.normal();
  }
  arm.payload = test::payload_of_8_kg();
  return arm;
}

ArmModel modelled_arm() {
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  return arm;
}

TEST(IdentifyLinks, BringsTheTorquesOfOtherMotionsTogether) {
  const ArmModel arm = real_arm(5);
  const ArmMotion motion = MovingArm::of(arm, {.duration_s = 40.0, .noise_Nm = 0.05});
  const ArmMotion other = MovingArm::of(arm, {.noise_Nm = 0.05, .seed = 9});
  const IdentifiedLinks found = identify_links(modelled_arm(), {&motion, 1}, kAssumed);
  const auto before =
      torque_residuals(modelled_arm(), found.modelled_joints, {&other, 1}, kAssumed);
  const auto after = torque_residuals(found.arm, found.joints, {&other, 1}, kAssumed);
  EXPECT_GT(before[1], 0.12);
  // The noise, as a mean over a window.
  for (std::size_t j = 0; j < after.size(); ++j) EXPECT_LT(after[j], 0.055) << j;
}

TEST(IdentifyLinks, HasStandardErrorsThatCoverTheTruth) {
  int within_2 = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const ArmModel arm = real_arm(seed);
    const ArmMotion motion =
        MovingArm::of(arm, {.duration_s = 25.0, .noise_Nm = 0.1, .seed = seed});
    const IdentifiedLinks found = identify_links(modelled_arm(), {&motion, 1}, kAssumed);
    for (std::size_t k = 0; k < found.links.size(); ++k) {
      const auto count = [&](const IdentifiedQuantity& of, double truth) {
        within_2 += std::abs(of.value - truth) < 2.0 * of.standard_error ? 1 : 0;
        ++all;
      };
      const BodyInertia& truth = arm.joints[k].body;
      count(found.links[k].mass_kg, truth.mass_kg);
      for (std::size_t i = 0; i < 3; ++i) count(found.links[k].com_m[i], truth.com_m[i]);
    }
  }
  EXPECT_GE(within_2, static_cast<int>(0.92 * all)) << all;
}

TEST(IdentifyLinks, MarksWhatTheMotionDoesNotDetermine) {
  const ArmModel arm = real_arm(2);
  const ArmMotion motion = MovingArm::of(arm, {.noise_Nm = 0.05});
  const IdentifiedLinks found = identify_links(modelled_arm(), {&motion, 1}, kAssumed);
  // The mass of the first link is on a vertical axis, and never lifted.
  EXPECT_FALSE(found.links[0].mass_kg.is_determined);
  EXPECT_THAT(found.links[0].mass_kg.reason, HasSubstr("adds little"));
  EXPECT_NEAR(found.links[0].mass_kg.value, 5.6, 1e-6);
  EXPECT_TRUE(found.links[1].com_m[0].is_determined) << found.links[1].com_m[0].standard_error;
  EXPECT_THAT(test::error_message([&] {
                (void)identify_links(modelled_arm(), {&motion, 1}, {.link_share = 0.1});
              }),
              HasSubstr("link_com_m"));
}

}  // namespace
}  // namespace torsio
