#include "parts/slip_clutch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "parts/second_stage.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr SlipClutch::Parameters kClutch = {.ratio = 51.0,
                                            .stiffness_Nm_rad = 50.0,
                                            .static_torque_Nm = 0.5,
                                            .sliding_ratio = 0.9,
                                            .damping_Nms_rad = 0.005};

/// Turns the rotor so that the twist moves slowly from one value to another.
/// @returns the torque at the end [Nm]
double turn(SlipClutch& clutch, double from_rad, double to_rad) {
  constexpr int kSteps = 1000;
  SlipClutch::Output output;
  for (int i = 1; i <= kSteps; ++i)
    output = clutch.step(51.0 * (from_rad + (to_rad - from_rad) * i / kSteps), 0.0, 0.0, 0.0);
  return output.torque_Nm;
}

TEST(SlipClutch, SticksSlipsDropsAndSticksAgainWhenTheMotionTurns) {
  SlipClutch clutch(kClutch);
  clutch.reset(0.0, 0.0);
  EXPECT_NEAR(turn(clutch, 0.0, 0.00999), 0.4995, 1e-12);
  EXPECT_FALSE(clutch.is_slipping());
  EXPECT_NEAR(clutch.slip(), 0.0, 1e-15);

  EXPECT_NEAR(turn(clutch, 0.00999, 0.01001), 0.45, 1e-12) << "drops to sliding friction";
  EXPECT_TRUE(clutch.is_slipping());
  EXPECT_NEAR(clutch.slip(), 0.01001 - 0.009, 1e-12) << "the cable springs back";
  EXPECT_NEAR(turn(clutch, 0.01001, 0.05), 0.45, 1e-12);
  EXPECT_NEAR(clutch.slip(), 0.05 - 0.009, 1e-12);

  EXPECT_NEAR(turn(clutch, 0.05, 0.05 - 0.018), -0.45, 1e-12) << "sticks on the way back";
  EXPECT_FALSE(clutch.is_slipping());
  EXPECT_NEAR(clutch.slip(), 0.05 - 0.009, 1e-12);
  EXPECT_NEAR(turn(clutch, 0.032, 0.05), 0.45, 1e-12);
  EXPECT_NEAR(turn(clutch, 0.05, 0.0509), 0.495, 1e-12) << "static friction anew after sticking";
  EXPECT_FALSE(clutch.is_slipping());

  EXPECT_NEAR(turn(clutch, 0.0509, 0.0), -0.45, 1e-12);
  EXPECT_TRUE(clutch.is_slipping());
  EXPECT_NEAR(clutch.slip(), 0.009, 1e-12);
}

TEST(SlipClutch, DampsTheCableOnlyWhileItSticksAndNeverBeyondStaticFriction) {
  SlipClutch clutch(kClutch);
  clutch.reset(0.0, 0.0);
  EXPECT_NEAR(clutch.step(0.051, 51.0 * 2.0, 0.0, 0.0).torque_Nm, 0.05 + 0.005 * 2.0, 1e-15);
  EXPECT_NEAR(clutch.step(0.051, 0.0, 0.0, 2.0).torque_Nm, 0.05 - 0.005 * 2.0, 1e-15);
  EXPECT_NEAR(clutch.step(0.051, 51.0 * 1e3, 0.0, 0.0).torque_Nm, 0.5, 1e-15);
  EXPECT_FALSE(clutch.is_slipping());
  EXPECT_NEAR(clutch.step(51.0, 51.0 * 1e3, 0.0, 0.0).torque_Nm, 0.45, 1e-15);
  EXPECT_TRUE(clutch.is_slipping());
}

TEST(SlipClutch, RotorFeelsTheTorqueThroughTheRatio) {
  SlipClutch clutch(kClutch);
  clutch.reset(0.3, 0.3 / 51.0);
  const auto output = clutch.step(0.4, 0.0, 0.3 / 51.0, 0.0);
  EXPECT_NEAR(output.torque_Nm, 50.0 * 0.1 / 51.0, 1e-15);
  EXPECT_NEAR(output.rotor_torque_Nm, output.torque_Nm / 51.0, 1e-17);
  EXPECT_NEAR(clutch.kinematics(0.4).angle_rad, 0.4 / 51.0, 1e-17);
  EXPECT_EQ(clutch.kinematics(0.4).slope, 1.0 / 51.0);
}

TEST(SlipClutch, ResetStretchesTheCableUpToStaticFriction) {
  SlipClutch clutch(kClutch);
  clutch.reset(51.0 * 0.008, 0.0);
  EXPECT_EQ(clutch.slip(), 0.0);
  EXPECT_NEAR(clutch.step(51.0 * 0.008, 0.0, 0.0, 0.0).torque_Nm, 0.4, 1e-14);
  clutch.reset(-51.0 * 0.5, 0.0);
  EXPECT_NEAR(clutch.slip(), -0.49, 1e-14);
  EXPECT_NEAR(clutch.hysteresis_torque(), -0.5, 1e-14);
  EXPECT_NEAR(clutch.hysteresis_energy(), 0.5 * 0.5 * 0.5 / 50.0, 1e-14);
}

TEST(SlipClutch, TakesWorkOnEveryClosedPathAndNeverGivesLossBack) {
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    SlipClutch clutch(kClutch);
    const auto path = random_closed_path(0.002 + 0.1 * random.uniform(), 4000, random);
    const double dt_s = std::pow(10.0, -5.0 + 2.0 * random.uniform());
    clutch.reset(51.0 * path.back(), 0.0);
    double last_rad = path.back();
    double last_Nm = clutch.hysteresis_torque();
    double loss_J = -clutch.hysteresis_energy();
    double work_J = 0.0;
    double largest_J = 0.0;
    const double begun_J = loss_J;
    for (int turns = 0; turns < 3; ++turns) {
      for (const double twist_rad : path) {
        const double increment_rad = twist_rad - last_rad;
        const double torque_Nm =
            clutch.step(51.0 * twist_rad, 51.0 * increment_rad / dt_s, 0.0, 0.0).torque_Nm;
        work_J += 0.5 * (torque_Nm + last_Nm) * increment_rad;
        loss_J = work_J - clutch.hysteresis_energy() - begun_J;
        EXPECT_GE(loss_J, largest_J - 1e-6) << "path " << i;
        largest_J = std::max(largest_J, loss_J);
        last_rad = twist_rad;
        last_Nm = torque_Nm;
      }
    }
    EXPECT_GT(loss_J, 0.0) << "path " << i;
  }
}

TEST(SlipClutch, RefusesImpossibleParameters) {
  const auto refuses = [](auto&& spoil) {
    auto parameters = kClutch;
    spoil(parameters);
    EXPECT_THROW(SlipClutch{parameters}, Error);
  };
  refuses([](auto& of) { of.ratio = 0.0; });
  refuses([](auto& of) { of.stiffness_Nm_rad = -50.0; });
  refuses([](auto& of) { of.static_torque_Nm = 0.0; });
  refuses([](auto& of) { of.sliding_ratio = 0.0; });
  refuses([](auto& of) { of.sliding_ratio = 1.1; });
  refuses([](auto& of) { of.damping_Nms_rad = std::nan(""); });
}

}  // namespace
}  // namespace torsio
