#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace torsio {

/// The largest number of joints of an arm: the dynamics work on arrays of this size, without a heap.
inline constexpr std::size_t kMaxArmJoints = 8;

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<double, 9>;  ///< row by row
inline constexpr Matrix3 kIdentity3 = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

/// A frame in another one: x_other = rotation x + position_m.
struct ArmFrame {
  Vector3 position_m = {};
  Matrix3 rotation = kIdentity3;
};

/// The mass of a body in a frame.
struct BodyInertia {
  double mass_kg = 0.0;
  Vector3 com_m = {};
  /// xx, yy, zz, xy, xz, yz about the centre of mass, axes parallel to the frame.
  std::array<double, 6> inertia_kg_m2 = {};
};

/// @returns both bodies as one, in the frame in which both are given
[[nodiscard]] BodyInertia together(const BodyInertia& a, const BodyInertia& b) noexcept;
/// @returns a body that is given in `frame`, in the frame in which `frame` is given
[[nodiscard]] BodyInertia moved(const BodyInertia& body, const ArmFrame& frame) noexcept;

/// A revolute joint and the link that it moves.
struct ArmJoint {
  std::string name = {};
  std::string link = {};
  ArmFrame origin =
      {};  ///< the frame of the joint at angle 0 in that of the previous joint (the base)
  Vector3 axis = {0.0, 0.0, 1.0};  ///< in its own frame, of length 1
  BodyInertia body = {};           ///< the link, in the frame of the joint, which turns with it
  double lowest_rad = 0.0;
  double highest_rad = 0.0;
  double speed_rad_s = 0.0;  ///< the largest
  double effort_Nm = 0.0;    ///< the largest torque
};

/// A serial arm of revolute joints, from the base to the flange.
struct ArmModel {
  std::string name = {};
  std::vector<ArmJoint> joints = {};
  ArmFrame flange = {};  ///< in the frame of the last joint
  /// What the arm carries, in the frame of the flange.
  BodyInertia payload = {};
  /// The acceleration of gravity in the frame of the base; `tilted_gravity` for a base that is not level.
  Vector3 gravity_m_s2 = {0.0, 0.0, -9.81};
};

/// @returns gravity in the frame of a base that is turned by this angle about its own y axis
[[nodiscard]] Vector3 tilted_gravity(double tilt_rad) noexcept;

/// Whether its mass is 0 or more, its inertia not negative, and every value finite.
[[nodiscard]] bool is_possible_payload(const BodyInertia& payload) noexcept;

/// @throws Error that names the joint if an arm has none or more than `kMaxArmJoints`, two joints of one name, an axis
/// that is not of length 1, a rotation that is none, a value that is not finite, a mass that is not positive, an inertia
/// that no body has (positive definite, and the sum of two principal moments not below the third), limits that contain no
/// angle, or a speed or effort that is not positive. A payload may have no mass; a point mass has no inertia.
void require_possible(const ArmModel& arm);

}  // namespace torsio
