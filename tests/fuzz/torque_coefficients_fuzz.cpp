#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

/// Any text is an Error, or coefficients that their own YAML gives back and that give finite
/// torques.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  std::vector<torsio::JointTorqueCoefficients> joints;
  try {
    joints = torsio::parse_torque_coefficients(text, "fuzz.yaml");
  } catch (const torsio::Error&) {
    return 0;
  }
  if (torsio::parse_torque_coefficients(torsio::torque_coefficients_yaml(joints), "again.yaml") !=
      joints)
    std::abort();
  for (const torsio::JointTorqueCoefficients& joint : joints) {
    torsio::MotorReferencedTorques torques(joint.parameters);
    const auto output = torques.step({.motor_angle_rad = 10.0,
                                      .gear_angle_rad = 0.1,
                                      .joint_angle_rad = 0.12,
                                      .motor_current_A = 1.0},
                                     0.3);
    if (!std::isfinite(output.motor_Nm + output.gear_Nm + output.spring_Nm)) std::abort();
  }
  return 0;
}
