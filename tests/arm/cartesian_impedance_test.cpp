#include "torsio/arm/cartesian_impedance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "arm/vector3.hpp"
#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr test::Arm6Joints kBent = {0.2, -0.6, 1.2, 0.3, 0.8, -0.2};

Matrix3 turn_about(const Vector3& axis, double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  const auto& [x, y, z] = axis;
  return {c + x * x * (1 - c),     x * y * (1 - c) - z * s, x * z * (1 - c) + y * s,
          x * y * (1 - c) + z * s, c + y * y * (1 - c),     y * z * (1 - c) - x * s,
          x * z * (1 - c) - y * s, y * z * (1 - c) + x * s, c + z * z * (1 - c)};
}

TEST(RotationBetween, IsTheRotationVector) {
  Random random(4);
  for (const double angle_rad : {0.0, 1e-9, 1e-3, 1.0, 3.0, std::numbers::pi - 1e-9}) {
    const Vector3 some = {random.uniform() - 0.5, random.uniform(), random.uniform() - 0.3};
    const Vector3 axis = (1.0 / std::sqrt(dot(some, some))) * some;
    const Matrix3 from = turn_about({0.6, 0.0, 0.8}, 0.7);
    const Vector3 found = rotation_between(from, product(turn_about(axis, angle_rad), from));
    // By half a revolution both signs are right.
    const double sign = angle_rad > 3.1 && dot(found, axis) < 0.0 ? -1.0 : 1.0;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(sign * found[i], angle_rad * axis[i], 1e-6) << angle_rad;
  }
}

TEST(CartesianImpedance, AtRestInItsPlaceItCarriesTheWeightAlone) {
  const ArmDynamics dynamics(test::arm6());
  const CartesianImpedance impedance({.stiffness = {500, 500, 500, 20, 20, 20}});
  const auto output =
      impedance.step(dynamics, kBent, test::Arm6Joints{}, {.flange = dynamics.flange(kBent)});
  test::Arm6Joints gravity_Nm;
  dynamics.gravity_torque(kBent, gravity_Nm);
  for (std::size_t j = 0; j < test::kArm6Joints; ++j)
    EXPECT_NEAR(output.torque_Nm[j], gravity_Nm[j], 1e-9);
  EXPECT_FALSE(output.is_singular);
}

TEST(CartesianImpedance, ItsSpringPullsAlongItsAxis) {
  ArmModel arm = test::arm6();
  arm.gravity_m_s2 = {};
  const ArmDynamics dynamics(arm);
  const CartesianImpedance impedance({.stiffness = {500, 400, 300, 20, 20, 20}});
  ArmFrame wanted = dynamics.flange(kBent);
  wanted.position_m[1] += 0.01;
  const auto output = impedance.step(dynamics, kBent, test::Arm6Joints{}, {.flange = wanted});
  EXPECT_NEAR(output.wrench[1], 4.0, 1e-9);
  EXPECT_NEAR(output.wrench[0], 0.0, 1e-9);
  EXPECT_NEAR(output.wrench[5], 0.0, 1e-9);
  std::array<double, 6 * test::kArm6Joints> jacobian;
  dynamics.jacobian(kBent, jacobian);
  for (std::size_t j = 0; j < test::kArm6Joints; ++j)
    EXPECT_NEAR(output.torque_Nm[j], 4.0 * jacobian[test::kArm6Joints + j], 1e-9);
}

TEST(CartesianImpedance, ThePostureDoesNotAccelerateTheFlange) {
  ArmModel arm = test::arm6();
  arm.gravity_m_s2 = {};
  const ArmDynamics dynamics(arm);
  const CartesianImpedance impedance(
      {.stiffness = {500, 500, 500, 0, 0, 0}, .null_stiffness_Nm_rad = 10.0});
  CartesianImpedance::Reference reference{.flange = dynamics.flange(kBent)};
  for (std::size_t j = 0; j < test::kArm6Joints; ++j) reference.posture_rad[j] = kBent[j] + 0.3;
  const auto output = impedance.step(dynamics, kBent, test::Arm6Joints{}, reference);
  test::Arm6Joints acceleration;
  dynamics.forward(kBent, test::Arm6Joints{}, output.torque_Nm, acceleration);
  std::array<double, 6 * test::kArm6Joints> jacobian;
  dynamics.jacobian(kBent, jacobian);
  double moved = 0.0;
  for (std::size_t j = 0; j < test::kArm6Joints; ++j)
    moved = std::max(moved, std::abs(acceleration[j]));
  EXPECT_GT(moved, 1.0);  // the posture does move
  for (std::size_t row = 0; row < 3; ++row) {
    double flange_m_s2 = 0.0;
    for (std::size_t j = 0; j < test::kArm6Joints; ++j)
      flange_m_s2 += jacobian[row * test::kArm6Joints + j] * acceleration[j];
    EXPECT_NEAR(flange_m_s2, 0.0, 0.02 * moved);  // what the damping of Λ leaves
  }
}

TEST(CartesianImpedance, ReportsASingularPoseAndStaysFinite) {
  const ArmDynamics dynamics(test::arm6());
  const CartesianImpedance impedance({.stiffness = {500, 500, 500, 20, 20, 20}});
  const test::Arm6Joints stretched = {};  // the elbow is straight, and two axes are in line
  ArmFrame wanted = dynamics.flange(stretched);
  wanted.position_m[0] += 0.1;
  const auto output = impedance.step(dynamics, stretched, test::Arm6Joints{}, {.flange = wanted});
  EXPECT_TRUE(output.is_singular);
  for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
    EXPECT_TRUE(std::isfinite(output.torque_Nm[j]));
    EXPECT_LT(std::abs(output.torque_Nm[j]), 300.0);
  }
}

TEST(CartesianImpedance, LimitsItsForce) {
  const ArmDynamics dynamics(test::arm6());
  const CartesianImpedance impedance(
      {.stiffness = {500, 500, 500, 20, 20, 20}, .largest_force_N = 30.0});
  ArmFrame wanted = dynamics.flange(kBent);
  wanted.position_m[2] += 1.0;
  EXPECT_NEAR(impedance.step(dynamics, kBent, test::Arm6Joints{}, {.flange = wanted}).wrench[2],
              30.0, 1e-9);
}

TEST(CartesianImpedance, RefusesSettingsThatCannotWork) {
  const auto message = [](const CartesianImpedance::Settings& settings) {
    return test::error_message([&] { const CartesianImpedance impedance(settings); });
  };
  EXPECT_THAT(message({}), testing::HasSubstr("at least one axis"));
  EXPECT_THAT(message({.stiffness = {-1.0}}), testing::HasSubstr("stiffness"));
  EXPECT_THAT(message({.stiffness = {1.0}, .damping_ratio = -1.0}), testing::HasSubstr("damping"));
}

}  // namespace
}  // namespace torsio
