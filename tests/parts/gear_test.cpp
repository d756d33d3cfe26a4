#include "parts/gear.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr Gear::Parameters kGear = {.ratio = 120.0,
                                    .error_rad = {1.5e-4, 0.5e-4},
                                    .error_phase_rad = {0.4, 1.1},
                                    .stiffness_Nm_rad = 1.6e4,
                                    .damping_Nms_rad = 6.4,
                                    .hysteresis_Nm = 1.92,
                                    .break_away_rad = 6e-5};

TEST(Gear, KinematicErrorIsTheSumOfItsSines) {
  const Gear gear(kGear);
  for (const double rotor : {-356.0, -1.3, 0.0, 0.7, 42.0, 356.0}) {
    const double error =
        1.5e-4 * std::sin(2.0 * rotor + 0.4) + 0.5e-4 * std::sin(4.0 * rotor + 1.1);
    const double slope = 3e-4 * std::cos(2.0 * rotor + 0.4) + 2e-4 * std::cos(4.0 * rotor + 1.1);
    const Gear::Kinematics motion = gear.kinematics(rotor);
    EXPECT_NEAR(motion.angle_rad, rotor / 120.0 + error, 1e-15 * (1.0 + std::abs(rotor)));
    EXPECT_NEAR(motion.slope, 1.0 / 120.0 + slope, 1e-16);
  }
}

TEST(Gear, RotorFeelsTheTorqueThroughTheSlopeOfTheMotion) {
  Gear gear(kGear);
  gear.reset(3.0, 3.0 / 120.0);
  const Gear::Output output = gear.step(3.1, 0.0, 3.0 / 120.0, 0.0);
  EXPECT_NEAR(output.rotor_torque_Nm, output.torque_Nm * gear.kinematics(3.1).slope, 1e-15);
}

TEST(Gear, TurnsBackThroughAHysteresisLoop) {
  Gear gear(kGear);
  const double start = gear.kinematics(0.0).angle_rad;
  gear.reset(0.0, start);
  for (int i = 1; i <= 1000; ++i) gear.step(0.0, 0.0, start - 1e-6 * i, 0.0);
  for (int i = 999; i >= 500; --i) gear.step(0.0, 0.0, start - 1e-6 * i, 0.0);
  EXPECT_NEAR(gear.hysteresis_torque(), -1.92, 1e-9);
  EXPECT_NEAR(gear.twist(), 5e-4, 1e-12);
}

TEST(Gear, RefusesImpossibleParameters) {
  auto parameters = kGear;
  parameters.ratio = 0.0;
  EXPECT_THROW(Gear{parameters}, Error);
  parameters = kGear;
  parameters.damping_Nms_rad = -1.0;
  EXPECT_THROW(Gear{parameters}, Error);
  parameters = kGear;
  parameters.break_away_rad = 0.0;
  EXPECT_THROW(Gear{parameters}, Error);
}

}  // namespace
}  // namespace torsio
