#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/arm/arm_model.hpp"

namespace torsio {

/// A link of a URDF file as it is written, with the line of each part; 0: there is none.
struct UrdfLink {
  std::string name = {};
  std::size_t line = 0;
  std::size_t inertial_line = 0;
  ArmFrame inertial = {};  ///< the centre of mass and its axes, in the frame of the link
  double mass_kg = 0.0;
  std::array<double, 6> inertia_kg_m2 = {};  ///< in the axes of the inertial
};

struct UrdfJoint {
  std::string name = {};
  std::size_t line = 0;
  bool is_revolute = false;  ///< else fixed
  std::string parent = {};
  std::string child = {};
  ArmFrame origin = {};
  Vector3 axis = {1.0, 0.0, 0.0};  ///< the default of the format; of length 1
  std::size_t limit_line = 0;
  double lower_rad = 0.0;
  double upper_rad = 0.0;
  double effort_Nm = 0.0;
  double velocity_rad_s = 0.0;
};

struct UrdfElements {
  std::string robot = {};
  std::size_t line = 0;
  std::vector<UrdfLink> links = {};
  std::vector<UrdfJoint> joints = {};
};

/// Reads the elements and checks each on its own. @throws Error as `read_urdf`.
[[nodiscard]] UrdfElements urdf_elements(std::string_view text, std::string_view file);

}  // namespace torsio
