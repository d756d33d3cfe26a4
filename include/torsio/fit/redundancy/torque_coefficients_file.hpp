#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/estimate/motor_referenced_torques.hpp"

namespace torsio {

/// The coefficients of one joint of a robot.
struct JointTorqueCoefficients {
  std::string name;
  MotorReferencedTorques::Parameters parameters;

  bool operator==(const JointTorqueCoefficients&) const = default;
};

/// The coefficients as YAML, in SI; `parse_torque_coefficients` of it gives the same numbers, bit
/// for bit.
[[nodiscard]] std::string torque_coefficients_yaml(std::span<const JointTorqueCoefficients> joints);

/// Reads the coefficients of one or more joints. The keys state the units; p1 and p2 may be per
/// degree, as the paper prints them, or per radian. Signs: `MotorReferencedTorques`.
///
///     joints:
///       - name: "Joint 2, 300 Nm"
///         torque_constant_Nm_A: 0.210
///         gear_ratio: 160
///         spring: {p0_Nm: 10.876, p1_Nm_deg: -30.29, p2_Nms_deg: 2.3337, p3_Nm: 15.521}
///         gear: {p0_Nm: -149.0, p1_Nm_rad: -50094, p2_Nms_rad: 17.62, p3_Nm: 15.969}
///
/// @throws Error naming file, line, what was expected and found, if a value is missing, is not a
/// number, has a unit, is given per degree and per radian, if torque constant or ratio is not
/// positive, a key is not known or two joints have the same name; Cancelled.
[[nodiscard]] std::vector<JointTorqueCoefficients> read_torque_coefficients(
    const std::string& path, const Progress& progress = {});
/// The same from a text. @param file for messages
[[nodiscard]] std::vector<JointTorqueCoefficients> parse_torque_coefficients(
    std::string_view text, const std::string& file);

}  // namespace torsio
