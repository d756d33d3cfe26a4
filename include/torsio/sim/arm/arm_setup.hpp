#pragma once

#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/arm/arm_model.hpp"
#include "torsio/arm/arm_move.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// The actuator of one joint of an arm, and what estimates its torque.
struct ArmJointSetup {
  DataSheet sheet;
  std::string model = {};  ///< file of the torque model; empty: the linear spring of the data sheet
  std::string monitor = {};  ///< file of the monitor of redundant torques; empty: none
};

/// An arm and its actuators: plain data.
struct ArmSetup {
  ArmModel arm;                             ///< with its payload, gravity in the frame of its base
  std::vector<ArmJointSetup> joints = {};   ///< one per joint of the arm
  std::vector<JointMoveLimits> moves = {};  ///< limits of the joints in moves
  std::vector<std::string> files = {};      ///< its URDF file, data sheets, models and monitors
};

/// Reads an arm; docs/robot/arm.md has the format.
///
///     urdf: arm6.urdf                    # relative to this file
///     base_tilt: 30deg                   # about the y axis of the base; left out: 0
///     payload: {mass: 8kg, center_of_mass: [80mm, 0, 0], inertia_kg_m2: [0.0136, 0.0136, 0.0136]}
///     speed_up: 0.5s                     # to full speed in a move
///     joints:
///       joint1: {actuator: dfki-300}
///       joint2: {actuator: "dfki-300:bouc-wen#03", model: joint2.safetensors, monitor: joint2.monitor.json}
///
/// A joint is as fast and as strong as both the limits of the URDF file and the rating of its actuator permit.
///
/// @throws Error naming file, line, what was expected and found: as `read_urdf`, a joint of the arm without an actuator, an
/// actuator for a joint that the arm does not have, an actuator that is not series-elastic, a payload under which the
/// weight alone needs more than `kLargestStaticShare` of a joint's rating.
[[nodiscard]] ArmSetup read_arm(const std::string& path, const Progress& progress = {});

/// @returns the arm of a URDF file
/// @throws Error as `read_urdf`, or if the file cannot be read
[[nodiscard]] ArmModel read_urdf_file(const std::string& path);

/// The arm of paper 000, section 6.4, with a payload of 8 kg: two joints of 300 Nm, one of 120 Nm, three of 28 Nm. Its
/// geometry and masses are assumed (docs/robot/arm.md). The files share/torsio/arm6.yaml and arm6.urdf are the same arm.
[[nodiscard]] ArmSetup arm6_setup();

/// The weight of the arm may need this share of a joint's rated torque; the rest is for accelerations.
inline constexpr double kLargestStaticShare = 0.8;

/// The largest torque of gravity on each joint [Nm], over random poses within the limits.
[[nodiscard]] std::vector<double> largest_gravity_torques(const ArmModel& arm);

/// @throws Error that names the joint if the weight alone needs more than `kLargestStaticShare` of its rating.
/// @param place for messages
void require_carriable(const ArmSetup& setup, const std::string& place);

/// The settings of `ArmController` for these actuators: the joint controllers of `torsio track`, the brakes of the data
/// sheets, models and monitors from their files.
/// @throws Error as `load_model`, `load_monitor` and `ArmController`.
[[nodiscard]] ArmController::Settings arm_controller_settings(
    const ArmSetup& setup, const std::optional<CartesianImpedance::Settings>& cartesian = {});

}  // namespace torsio
