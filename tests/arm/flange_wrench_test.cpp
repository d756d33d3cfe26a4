#include "torsio/arm/flange_wrench.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "support/arm6.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using Wrench = std::array<double, 6>;
constexpr test::Arm6Joints kWrenchPose = {0.3, -0.9, 1.4, 0.4, 0.8, -0.5};
constexpr test::Arm6Joints kWrenchSigma = {0.5, 0.8, 0.4, 0.1, 0.12, 0.05};

test::Arm6Joints torques_of(const ArmDynamics& dynamics, std::span<const double> angle_rad,
                            const Wrench& wrench) {
  ArmDynamics::Jacobian jacobian;
  dynamics.jacobian(angle_rad, jacobian);
  test::Arm6Joints torque_Nm = {};
  for (std::size_t j = 0; j < dynamics.size(); ++j)
    for (std::size_t row = 0; row < 6; ++row)
      torque_Nm[j] += jacobian[row * dynamics.size() + j] * wrench[row];
  return torque_Nm;
}

TEST(FlangeWrench, IsThatOfAKnownPush) {
  const ArmDynamics dynamics(test::arm6());
  const Wrench push = {12.0, -20.0, 7.0, 1.0, -2.0, 0.5};
  const FlangeWrench found =
      flange_wrench(dynamics, kWrenchPose, torques_of(dynamics, kWrenchPose, push), kWrenchSigma);
  EXPECT_EQ(found.determined, FlangeWrench::Determined::both);
  EXPECT_GT(found.manipulability, 0.02);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found.value[i], push[i], 1e-6);
}

TEST(FlangeWrench, HasTheStandardDeviationOfItsErrors) {
  const ArmDynamics dynamics(test::arm6());
  const Wrench push = {12.0, -20.0, 7.0, 1.0, -2.0, 0.5};
  const test::Arm6Joints exact_Nm = torques_of(dynamics, kWrenchPose, push);
  Random random(7);
  Wrench squares = {};
  Wrench std_dev = {};
  constexpr int kDraws = 4000;
  for (int n = 0; n < kDraws; ++n) {
    test::Arm6Joints noisy_Nm = exact_Nm;
    for (std::size_t j = 0; j < noisy_Nm.size(); ++j)
      noisy_Nm[j] += kWrenchSigma[j] * random.normal();
    const FlangeWrench found = flange_wrench(dynamics, kWrenchPose, noisy_Nm, kWrenchSigma);
    std_dev = found.std_dev;
    for (std::size_t i = 0; i < 6; ++i)
      squares[i] += (found.value[i] - push[i]) * (found.value[i] - push[i]) / kDraws;
  }
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(std::sqrt(squares[i]) / std_dev[i], 1.0, 0.05) << i;
}

TEST(FlangeWrench, IsNotDeterminedWhereTheArmIsSingular) {
  const ArmDynamics dynamics(test::arm6());
  const test::Arm6Joints stretched = {0.3, 0.0, 0.0, 0.0, 0.0, 0.0};
  const FlangeWrench found = flange_wrench(
      dynamics, stretched, torques_of(dynamics, stretched, {5.0, 5.0, 5.0}), kWrenchSigma);
  EXPECT_EQ(found.determined, FlangeWrench::Determined::nothing);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(std::isnan(found.value[i]));
    EXPECT_TRUE(std::isnan(found.std_dev[i]));
  }
}

TEST(FlangeWrench, IsTheForceAloneWhereOnlyTheWristIsSingular) {
  const ArmDynamics dynamics(test::arm6());
  const test::Arm6Joints straight_wrist = {0.3, -0.9, 1.4, 0.4, 0.0, -0.5};
  const Wrench push = {12.0, -20.0, 7.0};
  const FlangeWrench found = flange_wrench(
      dynamics, straight_wrist, torques_of(dynamics, straight_wrist, push), kWrenchSigma);
  EXPECT_EQ(found.determined, FlangeWrench::Determined::force);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found.value[i], push[i], 1e-6);
  for (std::size_t i = 3; i < 6; ++i) EXPECT_TRUE(std::isnan(found.value[i]));
}

TEST(FlangeWrench, OfAnArmOfFourJointsIsTheForce) {
  ArmModel four = test::arm6();
  four.joints.resize(4);
  four.flange = {{0.3, 0.1, 0.05}};
  const ArmDynamics dynamics(four);
  const std::array<double, 4> angle_rad = {0.3, -0.9, 1.4, 0.4};
  const test::Arm6Joints all_Nm = torques_of(dynamics, angle_rad, {12.0, -20.0, 7.0});
  const FlangeWrench found = flange_wrench(dynamics, angle_rad, std::span(all_Nm).first(4),
                                           std::span(kWrenchSigma).first(4));
  EXPECT_EQ(found.determined, FlangeWrench::Determined::force);
  EXPECT_NEAR(found.value[1], -20.0, 1e-6);
}

TEST(FlangeWrench, IsNotDeterminedByWhatIsNotFinite) {
  const ArmDynamics dynamics(test::arm6());
  test::Arm6Joints torque_Nm = {};
  torque_Nm[2] = std::nan("");
  EXPECT_EQ(flange_wrench(dynamics, kWrenchPose, torque_Nm, kWrenchSigma).determined,
            FlangeWrench::Determined::nothing);
  test::Arm6Joints sigma = kWrenchSigma;
  sigma[1] = 0.0;
  EXPECT_EQ(
      flange_wrench(dynamics, kWrenchPose, {{1.0, 1.0, 1.0, 1.0, 1.0, 1.0}}, sigma).determined,
      FlangeWrench::Determined::nothing);
}

}  // namespace
}  // namespace torsio
