#include "torsio/arm/arm_dynamics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "arm/vector3.hpp"
#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

using Square = std::array<double, test::kArm6Joints * test::kArm6Joints>;

test::Arm6Joints random_joints(Random& random, double width) {
  test::Arm6Joints values;
  for (double& value : values) value = width * (2.0 * random.uniform() - 1.0);
  return values;
}

ArmModel skewed_arm() {
  ArmModel arm = test::arm6();
  // Frames and axes that are not parallel to each other, products of inertia, a base that is not level.
  Random random(3);
  for (ArmJoint& joint : arm.joints) {
    const double angle = random.uniform();
    joint.origin.rotation = {
        std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1};
    const Vector3 axis = {random.uniform(), random.uniform() - 0.5, random.uniform()};
    joint.axis = (1.0 / std::sqrt(dot(axis, axis))) * axis;
    joint.body.com_m[1] = 0.05 * random.uniform();
    joint.body.inertia_kg_m2[3] = 0.1 * joint.body.inertia_kg_m2[2];
  }
  arm.flange.rotation = {0, 0, 1, 1, 0, 0, 0, 1, 0};
  arm.payload = {2.0, {0.02, 0.05, 0.1}, {0.002, 0.003, 0.004, 0.0001, 0.0002, 0.0003}};
  arm.gravity_m_s2 = tilted_gravity(0.4);
  return arm;
}

/// The change of orientation per joint angle: the skew-symmetric part of dR/dq Rᵀ, by a central difference.
Vector3 spin_between(const ArmFrame& before, const ArmFrame& after, const ArmFrame& here,
                     double width_rad) {
  Matrix3 rate;
  for (std::size_t i = 0; i < 9; ++i)
    rate[i] = (after.rotation[i] - before.rotation[i]) / width_rad;
  const Matrix3 turn = product(rate, transposed(here.rotation));
  return {turn[7], turn[2], turn[3]};
}

/// The mass matrix of the definition, sum over the bodies of m Jᵀ J + Jᵀ I J, by finite differences of
/// the frames.
Square mass_by_definition(const ArmModel& arm, const test::Arm6Joints& angle_rad) {
  const ArmDynamics dynamics(arm);
  Square mass{};
  constexpr double kStep = 1e-6;
  for (std::size_t body = 0; body < test::kArm6Joints; ++body) {
    BodyInertia inertia = arm.joints[body].body;
    if (body + 1 == test::kArm6Joints) inertia = together(inertia, moved(arm.payload, arm.flange));
    std::array<Vector3, test::kArm6Joints> velocity{};
    std::array<Vector3, test::kArm6Joints> spin{};
    const ArmFrame here = dynamics.link(body, angle_rad);
    for (std::size_t j = 0; j <= body; ++j) {
      test::Arm6Joints more = angle_rad;
      test::Arm6Joints less = angle_rad;
      more[j] += kStep;
      less[j] -= kStep;
      const ArmFrame after = dynamics.link(body, more);
      const ArmFrame before = dynamics.link(body, less);
      const auto com = [&](const ArmFrame& frame) {
        return frame.position_m + rotated(frame.rotation, inertia.com_m);
      };
      velocity[j] = (0.5 / kStep) * (com(after) - com(before));
      spin[j] = spin_between(before, after, here, 2.0 * kStep);
    }
    const auto in_base = rotated(here.rotation, inertia.inertia_kg_m2);
    for (std::size_t i = 0; i < test::kArm6Joints; ++i)
      for (std::size_t j = 0; j < test::kArm6Joints; ++j)
        mass[i * test::kArm6Joints + j] +=
            inertia.mass_kg * dot(velocity[i], velocity[j]) + dot(spin[i], times(in_base, spin[j]));
  }
  return mass;
}

TEST(ArmDynamics, HasTheMassMatrixOfTheDefinition) {
  for (const ArmModel& arm : {test::arm6(), skewed_arm()}) {
    const ArmDynamics dynamics(arm);
    Random random(11);
    for (int i = 0; i < 20; ++i) {
      const test::Arm6Joints angle_rad = random_joints(random, 3.0);
      Square mass;
      dynamics.mass_matrix(angle_rad, mass);
      const Square expected = mass_by_definition(arm, angle_rad);
      for (std::size_t k = 0; k < mass.size(); ++k) EXPECT_NEAR(mass[k], expected[k], 1e-7);
    }
  }
}

TEST(ArmDynamics, ItsInverseIsLinearInTheAccelerationsWithTheMassMatrix) {
  const ArmDynamics dynamics(skewed_arm());
  Random random(12);
  const test::Arm6Joints angle_rad = random_joints(random, 3.0);
  const test::Arm6Joints speed_rad_s = random_joints(random, 2.0);
  Square mass;
  test::Arm6Joints bias_Nm;
  dynamics.equation(angle_rad, speed_rad_s, mass, bias_Nm);
  for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
    test::Arm6Joints acceleration{};
    acceleration[j] = 1.0;
    test::Arm6Joints torque_Nm;
    dynamics.inverse(angle_rad, speed_rad_s, acceleration, torque_Nm);
    for (std::size_t i = 0; i < test::kArm6Joints; ++i)
      EXPECT_NEAR(torque_Nm[i] - bias_Nm[i], mass[i * test::kArm6Joints + j], 1e-12);
  }
}

// Lagrange: d/dt (∂T/∂q̇) − ∂T/∂q + ∂V/∂q = τ, with M and V by differences.
TEST(ArmDynamics, ItsBiasFollowsFromTheEnergies) {
  const ArmDynamics dynamics(skewed_arm());
  Random random(13);
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 10; ++trial) {
    const test::Arm6Joints angle_rad = random_joints(random, 3.0);
    const test::Arm6Joints speed_rad_s = random_joints(random, 2.0);
    Square mass;
    test::Arm6Joints bias_Nm;
    dynamics.equation(angle_rad, speed_rad_s, mass, bias_Nm);
    const auto momentum = [&](const test::Arm6Joints& q) {
      Square at;
      dynamics.mass_matrix(q, at);
      test::Arm6Joints of{};
      for (std::size_t i = 0; i < test::kArm6Joints; ++i)
        for (std::size_t j = 0; j < test::kArm6Joints; ++j)
          of[i] += at[i * test::kArm6Joints + j] * speed_rad_s[j];
      return of;
    };
    test::Arm6Joints after_q = angle_rad;
    test::Arm6Joints before_q = angle_rad;
    for (std::size_t i = 0; i < test::kArm6Joints; ++i) {
      after_q[i] += kStep * speed_rad_s[i];
      before_q[i] -= kStep * speed_rad_s[i];
    }
    const test::Arm6Joints later = momentum(after_q);
    const test::Arm6Joints earlier = momentum(before_q);
    for (std::size_t i = 0; i < test::kArm6Joints; ++i) {
      test::Arm6Joints more = angle_rad;
      test::Arm6Joints less = angle_rad;
      more[i] += kStep;
      less[i] -= kStep;
      const auto lagrangian = [&](const test::Arm6Joints& q) {
        return dynamics.kinetic_energy(q, speed_rad_s) - dynamics.potential_energy(q);
      };
      const double expected =
          (later[i] - earlier[i] - lagrangian(more) + lagrangian(less)) / (2.0 * kStep);
      EXPECT_NEAR(bias_Nm[i], expected, 1e-6);
    }
  }
}

TEST(ArmDynamics, ForwardIsTheInverseOfInverse) {
  const ArmDynamics dynamics(skewed_arm());
  Random random(14);
  for (int i = 0; i < 100; ++i) {
    const test::Arm6Joints angle_rad = random_joints(random, 3.0);
    const test::Arm6Joints speed_rad_s = random_joints(random, 3.0);
    const test::Arm6Joints wanted = random_joints(random, 20.0);
    test::Arm6Joints torque_Nm;
    test::Arm6Joints acceleration;
    dynamics.inverse(angle_rad, speed_rad_s, wanted, torque_Nm);
    dynamics.forward(angle_rad, speed_rad_s, torque_Nm, acceleration);
    for (std::size_t j = 0; j < test::kArm6Joints; ++j)
      EXPECT_NEAR(acceleration[j], wanted[j], 1e-8);
  }
}

TEST(ArmDynamics, ItsGravityTorqueIsThatOfTheTable) {
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  const ArmDynamics dynamics(arm);
  test::Arm6Joints torque_Nm;
  dynamics.gravity_torque(test::Arm6Joints{}, torque_Nm);
  // Stretched horizontally: g times the first moment of all that is beyond each joint.
  EXPECT_NEAR(torque_Nm[0], 0.0, 1e-12);
  EXPECT_NEAR(-torque_Nm[1], 149.6, 0.3);
  EXPECT_NEAR(-torque_Nm[2], 65.7, 0.2);
  EXPECT_NEAR(-torque_Nm[4], 16.4, 0.1);
  Square mass;
  dynamics.mass_matrix(test::Arm6Joints{}, mass);
  EXPECT_NEAR(mass[1], 0.0, 1e-12);  // vertical and horizontal axis
  EXPECT_NEAR(mass[0], 14.95, 0.03);
  EXPECT_NEAR(mass[7], 14.94, 0.03);
  EXPECT_NEAR(mass[14], 4.02, 0.02);
  EXPECT_NEAR(mass[35], 0.0137, 0.0001);
}

TEST(ArmDynamics, ATiltedBaseLoadsTheFirstJoint) {
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  ArmDynamics dynamics(arm);
  EXPECT_TRUE(dynamics.set_gravity(tilted_gravity(std::numbers::pi / 6.0)));
  test::Arm6Joints angle_rad{};
  angle_rad[0] = std::numbers::pi / 2.0;
  test::Arm6Joints torque_Nm;
  dynamics.gravity_torque(angle_rad, torque_Nm);
  EXPECT_NEAR(std::abs(torque_Nm[0]), 75.0, 1.0);
}

TEST(ArmDynamics, ItsMomentumAndGradientAreThoseOfTheKineticEnergy) {
  const ArmDynamics dynamics(skewed_arm());
  Random random(17);
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 10; ++trial) {
    const test::Arm6Joints angle_rad = random_joints(random, 3.0);
    const test::Arm6Joints speed_rad_s = random_joints(random, 2.0);
    test::Arm6Joints momentum_Nms;
    test::Arm6Joints gradient_Nm;
    test::Arm6Joints gravity_Nm;
    test::Arm6Joints expected_Nm;
    dynamics.momentum(angle_rad, speed_rad_s, momentum_Nms, gradient_Nm, gravity_Nm);
    dynamics.gravity_torque(angle_rad, expected_Nm);
    EXPECT_EQ(gravity_Nm, expected_Nm);
    Square mass;
    dynamics.mass_matrix(angle_rad, mass);
    for (std::size_t i = 0; i < test::kArm6Joints; ++i) {
      double expected = 0.0;
      for (std::size_t j = 0; j < test::kArm6Joints; ++j)
        expected += mass[i * test::kArm6Joints + j] * speed_rad_s[j];
      EXPECT_NEAR(momentum_Nms[i], expected, 1e-12);
      test::Arm6Joints more = angle_rad;
      test::Arm6Joints less = angle_rad;
      more[i] += kStep;
      less[i] -= kStep;
      EXPECT_NEAR(gradient_Nm[i],
                  (dynamics.kinetic_energy(more, speed_rad_s) -
                   dynamics.kinetic_energy(less, speed_rad_s)) /
                      (2.0 * kStep),
                  1e-8);
    }
  }
}

TEST(ArmDynamics, ItsJacobianIsTheDerivativeOfTheFlange) {
  const ArmDynamics dynamics(skewed_arm());
  Random random(15);
  constexpr double kStep = 1e-6;
  const test::Arm6Joints angle_rad = random_joints(random, 3.0);
  std::array<double, 6 * test::kArm6Joints> jacobian;
  const ArmFrame here = dynamics.jacobian(angle_rad, jacobian);
  EXPECT_EQ(here.position_m, dynamics.flange(angle_rad).position_m);
  for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
    test::Arm6Joints more = angle_rad;
    test::Arm6Joints less = angle_rad;
    more[j] += kStep;
    less[j] -= kStep;
    const ArmFrame after = dynamics.flange(more);
    const ArmFrame before = dynamics.flange(less);
    const Vector3 spin = spin_between(before, after, here, 2.0 * kStep);
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_NEAR(jacobian[row * test::kArm6Joints + j],
                  (after.position_m[row] - before.position_m[row]) / (2.0 * kStep), 1e-8);
      EXPECT_NEAR(jacobian[(3 + row) * test::kArm6Joints + j], spin[row], 1e-8);
    }
  }
}

TEST(ArmDynamics, APayloadIsThatOfTheModel) {
  ArmModel loaded = test::arm6();
  loaded.payload = test::payload_of_8_kg();
  const ArmDynamics expected(loaded);
  ArmDynamics dynamics(test::arm6());
  EXPECT_TRUE(dynamics.set_payload(loaded.payload));
  Random random(16);
  const test::Arm6Joints angle_rad = random_joints(random, 3.0);
  const test::Arm6Joints speed_rad_s = random_joints(random, 3.0);
  test::Arm6Joints a;
  test::Arm6Joints b;
  expected.inverse(angle_rad, speed_rad_s, speed_rad_s, a);
  dynamics.inverse(angle_rad, speed_rad_s, speed_rad_s, b);
  EXPECT_EQ(a, b);

  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(dynamics.set_payload({.mass_kg = -1.0}));
  EXPECT_FALSE(dynamics.set_payload({.mass_kg = kNaN}));
  EXPECT_FALSE(dynamics.set_payload({.mass_kg = 1.0, .com_m = {kNaN, 0.0, 0.0}}));
  EXPECT_FALSE(dynamics.set_payload({.mass_kg = 1.0, .inertia_kg_m2 = {-1.0, 1.0, 1.0}}));
  EXPECT_FALSE(dynamics.set_gravity({0.0, kNaN, 0.0}));
  dynamics.inverse(angle_rad, speed_rad_s, speed_rad_s, b);
  EXPECT_EQ(a, b);
}

TEST(ArmDynamics, WhatIsNotFiniteGivesNoFiniteAcceleration) {
  const ArmDynamics dynamics(test::arm6());
  test::Arm6Joints angle_rad{};
  angle_rad[2] = std::numeric_limits<double>::quiet_NaN();
  test::Arm6Joints acceleration;
  dynamics.forward(angle_rad, test::Arm6Joints{}, test::Arm6Joints{}, acceleration);
  for (const double value : acceleration) EXPECT_FALSE(std::isfinite(value));
}

TEST(SolvePositive, RefusesWhatIsNotPositiveDefinite) {
  std::array<double, 4> matrix = {1.0, 2.0, 2.0, 1.0};
  std::array<double, 2> x = {1.0, 1.0};
  EXPECT_FALSE(solve_positive(matrix, x));
  EXPECT_TRUE(std::isnan(x[0]));
}

struct ImpossibleArm {
  std::string name;
  std::function<void(ArmModel&)> spoil;
  std::string message;
};
class ImpossibleArmTest : public testing::TestWithParam<ImpossibleArm> {};

TEST_P(ImpossibleArmTest, IsRefusedByName) {
  ArmModel arm = test::arm6();
  GetParam().spoil(arm);
  EXPECT_THAT(test::error_message([&] { const ArmDynamics dynamics(arm); }),
              HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Arm, ImpossibleArmTest,
    testing::Values(
        ImpossibleArm{"joints", [](ArmModel& arm) { arm.joints.clear(); }, "at least one joint"},
        ImpossibleArm{"many",
                      [](ArmModel& arm) {
                        while (arm.joints.size() <= kMaxArmJoints) {
                          arm.joints.push_back(arm.joints[0]);
                          arm.joints.back().name = std::to_string(arm.joints.size());
                        }
                      },
                      "at most 8 joints"},
        ImpossibleArm{"unnamed", [](ArmModel& arm) { arm.joints[1].name.clear(); }, "a name"},
        ImpossibleArm{"twice", [](ArmModel& arm) { arm.joints[1].name = "joint1"; },
                      "'joint1' twice"},
        ImpossibleArm{"mass", [](ArmModel& arm) { arm.joints[2].body.mass_kg = 0.0; },
                      "'joint3': mass"},
        ImpossibleArm{"inertia", [](ArmModel& arm) { arm.joints[2].body.inertia_kg_m2[0] = -0.1; },
                      "positive principal moments"},
        ImpossibleArm{"triangle", [](ArmModel& arm) { arm.joints[2].body.inertia_kg_m2[2] = 0.1; },
                      "above the sum of the others"},
        ImpossibleArm{"axis",
                      [](ArmModel& arm) {
                        arm.joints[0].axis = {0.0, 0.0, 2.0};
                      },
                      "length 1"},
        ImpossibleArm{"rotation", [](ArmModel& arm) { arm.joints[0].origin.rotation[0] = -1.0; },
                      "a rotation"},
        ImpossibleArm{"limits", [](ArmModel& arm) { arm.joints[0].lowest_rad = 3.0; }, "limits"},
        ImpossibleArm{"effort", [](ArmModel& arm) { arm.joints[0].effort_Nm = 0.0; }, "effort"},
        ImpossibleArm{"payload", [](ArmModel& arm) { arm.payload.mass_kg = -1.0; }, "payload"}),
    [](const auto& parameter) { return parameter.param.name; });

}  // namespace
}  // namespace torsio
