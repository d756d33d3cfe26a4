#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

#include "support/temporary_folder.hpp"
#include "torsio/arm/arm_model.hpp"

namespace torsio::test {

/// A model of MuJoCo with its state. @throws std::runtime_error if MuJoCo refuses the text.
struct MujocoModel {
  explicit MujocoModel(const std::string& xml) {
    const TemporaryFolder folder;
    std::array<char, 1000> message{};
    model.reset(
        mj_loadXML(folder.file("arm.xml", xml).c_str(), nullptr, message.data(), message.size()));
    if (!model) throw std::runtime_error(message.data());
    data.reset(mj_makeData(model.get()));
  }
  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, mj_deleteData};
};

inline std::string mujoco_inertial(const BodyInertia& body) {
  return fmt::format("<inertial pos='{}' mass='{}' fullinertia='{}'/>", fmt::join(body.com_m, " "),
                     body.mass_kg, fmt::join(body.inertia_kg_m2, " "));
}

/// The beginning of a model without contacts and constraints, up to its world.
inline std::string mujoco_begin(const ArmModel& arm) {
  return fmt::format(
      "<mujoco><compiler angle='radian' inertiafromgeom='false' balanceinertia='false'/>"
      "<option timestep='1e-4' integrator='Euler' gravity='{}'>"
      "<flag contact='disable' constraint='disable'/></option><worldbody>",
      fmt::join(arm.gravity_m_s2, " "));
}

/// The mass of the link of a joint, with the payload if it is the last.
inline BodyInertia loaded_link(const ArmModel& arm, std::size_t joint) {
  const BodyInertia& body = arm.joints[joint].body;
  return joint + 1 < arm.joints.size() ? body : together(body, moved(arm.payload, arm.flange));
}

}  // namespace torsio::test
