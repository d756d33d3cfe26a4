#include "signal/joint_move.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "support/error_message.hpp"
#include "support/numbers.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

TEST(JointMove, IsTheMoveOfLeastJerk) {
  JointMove move({.waypoints_rad = {0.5, 1.5}, .speed_rad_s = 1.0, .acceleration_rad_s2 = 100.0},
                 kRate_Hz);
  EXPECT_NEAR(move.duration_s(), 15.0 / 8.0, 1e-12);
  for (int n = 0; n < 1875; ++n) {
    const double s = n / 1875.0;
    const JointMove::Output output = move.step();
    ASSERT_NEAR(output.position_rad, 0.5 + s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), 1e-12);
    ASSERT_FALSE(output.is_done);
  }
  EXPECT_EQ(move.step().position_rad, 1.5);
  EXPECT_TRUE(move.step().is_done);
}

TEST(JointMove, TakesAsLongAsItsAccelerationNeeds) {
  JointMove move({.waypoints_rad = {0.0, 0.1}, .speed_rad_s = 10.0, .acceleration_rad_s2 = 2.0},
                 kRate_Hz);
  double strongest = 0.0;
  while (true) {
    const auto output = move.step();
    if (output.is_done) break;
    strongest = std::max(strongest, std::abs(output.acceleration_rad_s2));
  }
  EXPECT_NEAR(strongest, 2.0, 1e-4);
}

TEST(JointMove, RepeatsItselfAndRefusesWhatIsNoMove) {
  JointMove move({.waypoints_rad = {0.0, 0.1, 0.1, -0.2}}, kRate_Hz);
  std::vector<double> first;
  for (int n = 0; n < 500; ++n) first.push_back(move.step().position_rad);
  move.reset();
  for (const double expected : first) ASSERT_EQ(move.step().position_rad, expected);
  const auto refusal = [](const JointMove::Parameters& parameters, double rate_Hz = kRate_Hz) {
    return test::error_message([&] { JointMove(parameters, rate_Hz); });
  };
  EXPECT_EQ(refusal({.waypoints_rad = {1.0}}), "");
  EXPECT_NE(refusal({.waypoints_rad = {}}), "");
  EXPECT_NE(refusal({.waypoints_rad = {0.0, std::nan("")}}), "");
  EXPECT_NE(refusal({.waypoints_rad = {0.0}, .speed_rad_s = 0.0}), "");
  EXPECT_NE(refusal({.waypoints_rad = {0.0}, .acceleration_rad_s2 = -1.0}), "");
  EXPECT_NE(refusal({.waypoints_rad = {0.0}}, 0.0), "");
}

// Its derivatives are those of its position, it is within its limits, uses one of them up, and
// passes every waypoint.
RC_GTEST_PROP(JointMove, KeepsToItsLimitsThroughAnyWaypoints, ()) {
  JointMove::Parameters parameters = {
      .speed_rad_s = 0.01 * *rc::gen::inRange(10, 300),
      .acceleration_rad_s2 = 0.01 * *rc::gen::inRange(50, 2000),
      .through = *rc::gen::element(JointMove::Through::stop, JointMove::Through::pass)};
  for (int n = *rc::gen::inRange(2, 7); n > 0; --n)
    parameters.waypoints_rad.push_back(0.01 * *rc::gen::inRange(-200, 200));
  JointMove move(parameters, kRate_Hz);
  double last_rad = parameters.waypoints_rad.front();
  double last_rad_s = 0.0;
  double used = 0.0;
  std::vector<double> nearest(parameters.waypoints_rad.size(),
                              std::numeric_limits<double>::infinity());
  for (bool is_done = false; !is_done;) {
    const auto now = move.step();
    is_done = now.is_done;
    RC_ASSERT(std::abs(now.velocity_rad_s) <= parameters.speed_rad_s * (1.0 + 1e-9));
    RC_ASSERT(std::abs(now.acceleration_rad_s2) <= parameters.acceleration_rad_s2 * (1.0 + 1e-9));
    const double mean_rad_s = 0.5 * (now.velocity_rad_s + last_rad_s);
    if (!is_done)
      RC_ASSERT(std::abs((now.position_rad - last_rad) * kRate_Hz - mean_rad_s) <
                (last_rad == parameters.waypoints_rad.front() ? 0.05 : 0.01));
    used = std::max({used, std::abs(now.velocity_rad_s) / parameters.speed_rad_s,
                     std::abs(now.acceleration_rad_s2) / parameters.acceleration_rad_s2});
    for (std::size_t i = 0; i < nearest.size(); ++i)
      nearest[i] = std::min(nearest[i], std::abs(now.position_rad - parameters.waypoints_rad[i]));
    last_rad = now.position_rad;
    last_rad_s = now.velocity_rad_s;
  }
  if (move.duration_s() > 0.1) RC_ASSERT(used > 0.95);
  for (const double distance_rad : nearest)
    RC_ASSERT(distance_rad <= parameters.speed_rad_s / kRate_Hz);
}

}  // namespace
}  // namespace torsio
