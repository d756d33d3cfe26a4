#include "identify/momentum_windows.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "support/arm6.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

Eigen::VectorXd parameters_of(const ArmModel& arm) {
  Eigen::VectorXd all(kBodyParameters * static_cast<Eigen::Index>(arm.joints.size() + 1));
  Eigen::Index at = 0;
  for (const ArmJoint& joint : arm.joints) {
    all.segment<kBodyParameters>(at) = body_parameters(joint.body);
    at += kBodyParameters;
  }
  all.segment<kBodyParameters>(at) = body_parameters(arm.payload);
  return all;
}

TEST(MomentumColumns, TimesTheParametersAreTheMomentumOfTheDynamics) {
  ArmModel arm = test::arm6();
  arm.payload = {3.0, {0.05, -0.02, 0.1}, {0.02, 0.03, 0.025, 0.001, -0.002, 0.003}};
  arm.gravity_m_s2 = tilted_gravity(0.5);
  const ArmDynamics dynamics(arm);
  MomentumColumns columns(arm.joints.size());
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    test::Arm6Joints angle;
    test::Arm6Joints speed;
    for (std::size_t j = 0; j < angle.size(); ++j) {
      angle[j] = random.uniform(-2.5, 2.5);
      speed[j] = random.uniform(-2.0, 2.0);
    }
    test::Arm6Joints momentum;
    test::Arm6Joints gradient;
    test::Arm6Joints gravity;
    dynamics.momentum(angle, speed, momentum, gradient, gravity);
    columns.set(arm, dynamics, angle, speed);
    const Eigen::VectorXd parameters = parameters_of(arm);
    const Eigen::VectorXd p = columns.momentum * parameters;
    const Eigen::VectorXd f = columns.force * parameters;
    for (std::size_t j = 0; j < angle.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      EXPECT_NEAR(p(row), momentum[j], 1e-11) << trial << " " << j;
      EXPECT_NEAR(f(row), gradient[j] - gravity[j], 1e-10) << trial << " " << j;
    }
  }
}

TEST(BodyParameters, OfABodyGiveTheBodyAgain) {
  const BodyInertia body{3.0, {0.05, -0.02, 0.1}, {0.02, 0.03, 0.025, 0.001, -0.002, 0.003}};
  const BodyInertia again = body_of(body_parameters(body));
  EXPECT_DOUBLE_EQ(again.mass_kg, body.mass_kg);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(again.com_m[i], body.com_m[i], 1e-15);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(again.inertia_kg_m2[i], body.inertia_kg_m2[i], 1e-15);
}

TEST(BodyParameters, ChangeWithTheBodyAsTheirDerivative) {
  const BodyInertia body{3.0, {0.05, -0.02, 0.1}, {0.02, 0.03, 0.025, 0.001, -0.002, 0.003}};
  const BodyJacobian by = parameters_by_body(body);
  const double h = 1e-6;
  for (std::size_t i = 0; i < 10; ++i) {
    BodyInertia changed = body;
    (i == 0 ? changed.mass_kg : i < 4 ? changed.com_m[i - 1] : changed.inertia_kg_m2[i - 4]) += h;
    const BodyParameters slope = (body_parameters(changed) - body_parameters(body)) / h;
    EXPECT_LT((slope - by.col(static_cast<Eigen::Index>(i))).cwiseAbs().maxCoeff(), 1e-5) << i;
  }
}

TEST(CentredSlope, IsThatOfAParabola) {
  std::vector<double> values;
  for (int n = 0; n < 50; ++n) values.push_back(0.01 * n * n - 3.0 * n);
  const std::vector<double> slope = centred_slope(values, 5, 10.0);
  EXPECT_TRUE(std::isnan(slope[4]));
  EXPECT_TRUE(std::isnan(slope[45]));
  for (std::size_t n = 5; n < 45; ++n)
    EXPECT_NEAR(slope[n], 10.0 * (0.02 * static_cast<double>(n) - 3.0), 1e-9);
}

}  // namespace
}  // namespace torsio
