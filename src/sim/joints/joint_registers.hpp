#pragma once

#include <optional>
#include <vector>

#include "sim/joints/linked_joint.hpp"
#include "torsio/link/joint_endpoint.hpp"
#include "torsio/link/register_table.hpp"

namespace torsio {

/// A joint with its registers and its endpoint.
struct ServedJoint {
  LinkedJoint* joint = nullptr;
  std::uint8_t id = 0;
  double watchdog_s = 0.0;
  std::vector<LinkRegister> registers = {};
  std::optional<RegisterTable> table = {};
  std::optional<JointEndpoint> endpoint = {};
};

/// @param of stays where it is
[[nodiscard]] std::vector<LinkRegister> joint_registers(ServedJoint& of);

}  // namespace torsio
