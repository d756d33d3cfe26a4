#include <gtest/gtest.h>

#include "studies/arm_collision_run.hpp"

namespace torsio {
namespace {

ContactDetector::Settings collision_contacts() {
  ContactDetector::Settings settings;
  for (const double sigma_Nm : {1.0, 3.5, 1.5, 0.5, 0.7, 0.1})
    settings.joints.push_back(
        {.error = {.coefficients = {sigma_Nm * sigma_Nm, 0.0, 0.0, 0.0}}, .factor = 4.0});
  return settings;
}

TEST(ArmCollision, ARetreatEndsTheForceWithinEightyMilliseconds) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ArmCollision collision{.axis = axis, .payload_kg = 0.0, .contacts = collision_contacts()};
    const ArmRun none = collide(collision);
    collision.reaction = ContactReaction::retract;
    const ArmRun retreat = collide(collision);
    ASSERT_FALSE(retreat.contacts.empty());
    EXPECT_LT(retreat.contacts.front().latency_s.value(), 0.02) << axis;
    EXPECT_LT(retreat.impact->first_peak_N, 400.0) << axis;
    EXPECT_LT(retreat.impact->largest_late_N.value(), 0.5) << axis;
    EXPECT_GT(none.impact->largest_late_N.value(), 200.0) << axis;
  }
}

TEST(ArmCollision, SpringsLowerTheFirstPeakOfALightArm) {
  const ArmCollision collision{.axis = 0, .payload_kg = 0.0};
  EXPECT_LT(first_peak(collision, 1.0), 0.6 * first_peak(collision, 300.0));
}

}  // namespace
}  // namespace torsio
