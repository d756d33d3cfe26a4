#include "torsio/actuator/friction.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr LuGreFriction::Parameters kRotor = {.coulomb_Nm = 0.05,
                                              .load_factor = 1e-3,
                                              .static_ratio = 1.15,
                                              .stribeck_rad_s = 3.0,
                                              .bristle_rad = 0.02,
                                              .viscous_Nms_rad = 7e-4};

TEST(LuGreFriction, SettlesAtTheStribeckCurve) {
  for (const double speed : {0.5, 3.0, 10.0, 25.0, -6.0}) {
    LuGreFriction friction(kRotor);
    double torque_Nm = 0.0;
    for (int i = 0; i < 20000; ++i) torque_Nm = friction.step(speed, 20.0, 1e-4);
    const double level_Nm = 0.07 * (1.0 + 0.15 * std::exp(-(speed / 3.0) * (speed / 3.0)));
    EXPECT_NEAR(torque_Nm, std::copysign(level_Nm, speed) + 7e-4 * speed, 1e-12) << speed;
  }
}

TEST(LuGreFriction, StepSizeDoesNotMatterAtConstantSpeed) {
  LuGreFriction coarse(kRotor);
  LuGreFriction fine(kRotor);
  const double coarse_Nm = coarse.step(5.0, 0.0, 1e-3);
  double fine_Nm = 0.0;
  for (int i = 0; i < 1000; ++i) fine_Nm = fine.step(5.0, 0.0, 1e-6);
  EXPECT_NEAR(coarse_Nm, fine_Nm, 1e-12);
}

TEST(LuGreFriction, HoldsItsTorqueAtRest) {
  LuGreFriction friction(kRotor);
  friction.step(1.0, 0.0, 5e-3);
  const double held_Nm = friction.step(0.0, 0.0, 1e-4);
  EXPECT_GT(held_Nm, 0.0);
  EXPECT_EQ(friction.step(0.0, 0.0, 1.0), held_Nm);
}

TEST(LuGreFriction, NeverGivesWorkOnAClosedPath) {
  Random random(3);
  for (int path = 0; path < 120; ++path) {
    LuGreFriction friction(kRotor);
    const double reach = 0.002 + 0.2 * random.uniform();
    const double frequency = 1.0 + 40.0 * random.uniform();
    const double phase = 6.0 * random.uniform();
    double work_J = 0.0;
    for (int turn = 0; turn < 3; ++turn) {
      work_J = 0.0;
      for (int i = 0; i < 4000; ++i) {
        const double angle = 2.0 * 3.141592653589793 * i / 4000.0;
        const double speed =
            reach * frequency * (std::cos(angle) + 1.5 * std::cos(3.0 * angle + phase));
        const double dt = 2.0 * 3.141592653589793 / frequency / 4000.0;
        work_J += friction.step(speed, 0.0, dt) * speed * dt;
      }
    }
    EXPECT_GE(work_J, 0.0) << "path " << path;
  }
}

TEST(LuGreFriction, RefusesImpossibleParameters) {
  auto parameters = kRotor;
  parameters.bristle_rad = 0.0;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
  parameters = kRotor;
  parameters.static_ratio = 0.9;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
  parameters = kRotor;
  parameters.coulomb_Nm = -1.0;
  EXPECT_THROW(LuGreFriction{parameters}, Error);
}

}  // namespace
}  // namespace torsio
