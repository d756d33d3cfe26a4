#include "torsio/arm/arm_move.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using Waypoints = std::vector<std::vector<double>>;

constexpr double kMoveRate_Hz = 1000.0;

TEST(ArmMove, KeepsTheLimitsOfEveryJointAndReachesOne) {
  const std::vector<JointMoveLimits> limits = {{-3.0, 3.0, 1.0, 2.0, 20.0},
                                               {-3.0, 3.0, 0.5, 5.0, 30.0}};
  Random random(5);
  for (int trial = 0; trial < 30; ++trial) {
    const double length = std::pow(10.0, random.uniform(-3.0, 0.4));
    const Waypoints waypoints = {{0.0, 0.0},
                                 {length * random.uniform(), -length * random.uniform()}};
    constexpr double kFine_Hz = 1e4;
    ArmMove move(waypoints, limits, kFine_Hz);
    double largest_share = 0.0;
    ArmMove::Output last = move.step();
    EXPECT_EQ(last.position_rad[0], 0.0);
    while (!last.is_done) {
      const ArmMove::Output now = move.step();
      for (std::size_t j = 0; j < 2; ++j) {
        const double jerk = (now.acceleration_rad_s2[j] - last.acceleration_rad_s2[j]) * kFine_Hz;
        const double share =
            std::max({std::abs(now.velocity_rad_s[j]) / limits[j].speed_rad_s,
                      std::abs(now.acceleration_rad_s2[j]) / limits[j].acceleration_rad_s2,
                      now.is_done ? 0.0 : std::abs(jerk) / limits[j].jerk_rad_s3});
        largest_share = std::max(largest_share, share);
        EXPECT_LE(share, 1.0 + 1e-9);
      }
      last = now;
    }
    EXPECT_GT(largest_share, 0.97);
    EXPECT_EQ(last.position_rad[0], waypoints[1][0]);
    EXPECT_EQ(last.velocity_rad_s[1], 0.0);
  }
}

TEST(ArmMove, ItsSpeedIsTheDerivativeOfItsPosition) {
  ArmMove move(Waypoints{{0.0}, {1.0}, {1.0}, {-0.5}},
               std::vector<JointMoveLimits>{{-2, 2, 1, 4, 40}}, kMoveRate_Hz);
  ArmMove::Output before = move.step();
  ArmMove::Output now = move.step();
  for (ArmMove::Output after = move.step(); !after.is_done; after = move.step()) {
    EXPECT_NEAR(now.velocity_rad_s[0],
                0.5 * kMoveRate_Hz * (after.position_rad[0] - before.position_rad[0]), 1e-5);
    EXPECT_NEAR(now.acceleration_rad_s2[0],
                0.5 * kMoveRate_Hz * (after.velocity_rad_s[0] - before.velocity_rad_s[0]), 0.02);
    before = now;
    now = after;
  }
}

TEST(ArmMove, OneWaypointIsHeld) {
  ArmMove move(Waypoints{{0.3}}, std::vector<JointMoveLimits>{{-2, 2, 1, 4, 40}}, kMoveRate_Hz);
  const ArmMove::Output output = move.step();
  EXPECT_TRUE(output.is_done);
  EXPECT_EQ(output.position_rad[0], 0.3);
  EXPECT_EQ(move.duration_s(), 0.0);
}

TEST(ArmMove, IsTheSameAfterAReset) {
  ArmMove move(Waypoints{{0.0}, {1.0}}, std::vector<JointMoveLimits>{{-2, 2, 1, 4, 40}},
               kMoveRate_Hz);
  while (!move.step().is_done) {
  }
  move.reset();
  EXPECT_EQ(move.step().position_rad[0], 0.0);
}

TEST(ArmMove, RefusesWhatCrossesALimitByWaypointAndJoint) {
  const std::vector<JointMoveLimits> limits = move_limits(test::arm6());
  const auto message = [&](const Waypoints& waypoints) {
    return test::error_message([&] { const ArmMove move(waypoints, limits, kMoveRate_Hz); });
  };
  EXPECT_THAT(message({}), HasSubstr("at least one waypoint"));
  EXPECT_THAT(
      message({{0, 0, 0, 0, 0, 0}, {0, 0, 3.0, 0, 0, 0}}),
      HasSubstr("waypoint 2: joint 3: expected an angle within its limits, -2.8 to 2.8 rad, "
                "found 3 rad"));
  EXPECT_THAT(message({{0, 0, 0, NAN, 0, 0}}), HasSubstr("waypoint 1: joint 4"));
  EXPECT_THAT(message({{0, 0, 0}}), HasSubstr("6 angles"));
}

TEST(MoveLimits, AreThoseOfTheArm) {
  const auto limits = move_limits(test::arm6());
  EXPECT_EQ(limits.size(), 6U);
  EXPECT_NEAR(limits[2].speed_rad_s, 0.8 * 1.66, 1e-12);
  EXPECT_NEAR(limits[2].acceleration_rad_s2, 1.6 * 1.66, 1e-12);
}

}  // namespace
}  // namespace torsio
