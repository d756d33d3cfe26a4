// The dynamics against MuJoCo 2.2.2, where it is installed.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "support/arm6.hpp"
#include "support/mujoco_model.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

/// The arm with rigid joints.
std::string model_text(const ArmModel& arm) {
  std::string text = test::mujoco_begin(arm);
  for (std::size_t j = 0; j < arm.joints.size(); ++j)
    text += fmt::format("<body pos='{}'>{}<joint type='hinge' axis='{}'/>",
                        fmt::join(arm.joints[j].origin.position_m, " "),
                        test::mujoco_inertial(test::loaded_link(arm, j)),
                        fmt::join(arm.joints[j].axis, " "));
  for (std::size_t j = 0; j < arm.joints.size(); ++j) text += "</body>";
  return text + "</worldbody></mujoco>";
}

TEST(MujocoOracle, InverseDynamicsAgreeInTenThousandStates) {
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  const ArmDynamics dynamics(arm);
  const test::MujocoModel oracle(model_text(arm));
  Random random(1);
  double worst_Nm = 0.0;
  double worst_kg_m2 = 0.0;
  for (int state = 0; state < 10000; ++state) {
    test::Arm6Joints angle_rad;
    test::Arm6Joints speed_rad_s;
    test::Arm6Joints acceleration_rad_s2;
    for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
      oracle.data->qpos[j] = angle_rad[j] = random.uniform(-2.8, 2.8);
      oracle.data->qvel[j] = speed_rad_s[j] = random.uniform(-3.0, 3.0);
      oracle.data->qacc[j] = acceleration_rad_s2[j] = random.uniform(-20.0, 20.0);
    }
    mj_inverse(oracle.model.get(), oracle.data.get());
    test::Arm6Joints torque_Nm;
    dynamics.inverse(angle_rad, speed_rad_s, acceleration_rad_s2, torque_Nm);
    std::array<double, test::kArm6Joints * test::kArm6Joints> mass;
    std::array<double, test::kArm6Joints * test::kArm6Joints> expected;
    dynamics.mass_matrix(angle_rad, mass);
    mj_fullM(oracle.model.get(), expected.data(), oracle.data->qM);
    for (std::size_t j = 0; j < test::kArm6Joints; ++j)
      worst_Nm = std::max(worst_Nm, std::abs(torque_Nm[j] - oracle.data->qfrc_inverse[j]));
    for (std::size_t k = 0; k < mass.size(); ++k)
      worst_kg_m2 = std::max(worst_kg_m2, std::abs(mass[k] - expected[k]));
  }
  RecordProperty("worst_Nm", std::to_string(worst_Nm));
  EXPECT_LT(worst_Nm, 1e-9);
  EXPECT_LT(worst_kg_m2, 1e-12);
}

}  // namespace
}  // namespace torsio
