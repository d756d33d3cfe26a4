// The dynamics against MuJoCo 2.2.2, where it is installed.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>

#include "arm/vector3.hpp"
#include "support/arm6.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

std::string text(const Vector3& of) { return fmt::format("{} {} {}", of[0], of[1], of[2]); }

std::string inertial(const BodyInertia& body) {
  return fmt::format("<inertial pos='{}' mass='{}' fullinertia='{}'/>", text(body.com_m),
                     body.mass_kg, fmt::join(body.inertia_kg_m2, " "));
}

/// The arm with rigid joints.
std::string model_text(const ArmModel& arm) {
  std::string text_of =
      "<mujoco><compiler angle='radian' inertiafromgeom='false' balanceinertia='false'/>"
      "<option timestep='1e-4' integrator='Euler' gravity='" +
      text(arm.gravity_m_s2) +
      "'><flag contact='disable' constraint='disable'/></option><worldbody>";
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const ArmJoint& joint = arm.joints[j];
    const BodyInertia body = j + 1 < arm.joints.size()
                                 ? joint.body
                                 : together(joint.body, moved(arm.payload, arm.flange));
    text_of += "<body pos='" + text(joint.origin.position_m) + "'>" + inertial(body) +
               "<joint type='hinge' axis='" + text(joint.axis) + "'/>";
  }
  for (std::size_t j = 0; j < arm.joints.size(); ++j) text_of += "</body>";
  return text_of + "</worldbody></mujoco>";
}

struct Model {
  explicit Model(const std::string& xml) {
    const TemporaryFolder folder;
    const std::string file = folder.file("arm.xml", xml);
    std::array<char, 1000> message{};
    model.reset(mj_loadXML(file.c_str(), nullptr, message.data(), message.size()));
    if (!model) throw std::runtime_error(message.data());
    data.reset(mj_makeData(model.get()));
  }
  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, mj_deleteData};
};

TEST(MujocoOracle, InverseDynamicsAgreeInTenThousandStates) {
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  const ArmDynamics dynamics(arm);
  const Model oracle(model_text(arm));
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
