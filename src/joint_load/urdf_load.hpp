#pragma once

#include <string>

#include "torsio/arm/arm_model.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// Where the joint of a URDF is, and what moves with it.
struct UrdfLoad {
  ArmModel arm;
  std::size_t joint = 0;
  std::vector<double> pose_rad = {};  ///< angle of each joint
  std::size_t payload_body = 0;       ///< joint whose link carries the payload
  Vector3 payload_at_m = {};          ///< in the frame of that joint
};

/// Reads the URDF. @param sheet_file the load file, to whose folder the path of the URDF is relative
/// @throws Error if the file cannot be read, or has no such joint or link.
[[nodiscard]] UrdfLoad urdf_load(const UrdfFacts& facts, const std::string& sheet_file);

/// The load of the joint with a point mass as payload. For one moving joint the torque of gravity is a sin q + b cos q,
/// and its inertia does not depend on its own angle.
[[nodiscard]] JointLoad load_of(const UrdfLoad& urdf, double payload_mass_kg);

}  // namespace torsio
