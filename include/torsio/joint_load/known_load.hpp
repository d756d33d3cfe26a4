#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// A rigid load about the fixed axis of its joint. The torque that moves it at the joint's angle q is
///
///   T(q, q'') = gravity_Nm sin(q + zero_rad) + inertia_kg_m2 q''
///
/// q = -zero_rad is the angle at which it hangs. Any rigid body about a fixed axis has this form.
struct JointLoad {
  double gravity_Nm = 0.0;     ///< largest torque of gravity, >= 0; 0 for a vertical axis
  double inertia_kg_m2 = 0.0;  ///< load, and what the joint itself turns beyond the spring
  double zero_rad = 0.0;
};

/// What one standard error of one stated fact (mass, length, ..) changes in a load.
struct LoadError {
  std::string fact;  ///< as it is named in the file: "mass"
  JointLoad change;
};

/// A load and the independent errors of what it was computed from.
struct KnownLoad {
  JointLoad load;
  std::vector<LoadError> errors;
};

/// A number of a load file, in SI. Either a value, or the name of a condition of each recording.
struct LoadFact {
  double value = 0.0;
  double standard_error = 0.0;  ///< in the unit of the value
  double relative_error = 0.0;  ///< standard error as a share of the value; one of both is 0
  std::string condition = {};   ///< constant channel that has the value; empty: `value`
};

/// The acceleration of gravity of all known loads, as in the simulated plants. It differs from place to place by up to
/// 0.3 %.
inline constexpr double kLoadGravity_m_s2 = 9.81;

/// A mass at the end of an arm: gravity (m + arm/2) g l cos(inclination), inertia m l^2 + arm l^2 / 3.
struct PendulumFacts {
  LoadFact mass_kg = {};
  LoadFact length_m = {};
  LoadFact arm_mass_kg = {};
  LoadFact inclination_rad = {};  ///< between the axis and the horizontal
};

/// What a joint of a URDF moves, the other joints at rest at their zero or at `pose`.
struct UrdfFacts {
  std::string file;  ///< relative to the load file
  std::string joint;
  std::string payload_link = {};  ///< a link that moves, or "flange"; empty: no payload
  LoadFact payload_mass_kg = {};
  std::vector<double> payload_at_m = {};  ///< centre of mass in the link's frame, 3 numbers
  std::vector<std::pair<std::string, double>> pose_rad = {};
};

/// A load file (docs/use/known_load.md):
///
///     load:
///       pendulum: {mass: 9kg, length: lever_m, arm_mass: 0kg, inclination: 0deg}
///       joint_inertia: 0.15kg_m2     # or: fit
///       zero: 0deg                   # or: fit
///     load_uncertainty: {mass: 0.5%, length: 1mm, zero: 0.5deg}
///
/// or `urdf: arm.urdf`, `joint: elbow`, `payload: {link: hand, mass: 2kg, at: [0, 0, 0.05]}` and
/// `pose: {wrist: 90deg}` instead of the pendulum.
struct LoadSheet {
  std::string file;  ///< for messages
  std::variant<PendulumFacts, UrdfFacts> facts = {};
  LoadFact joint_inertia_kg_m2 = {};  ///< the joint's output without the load
  LoadFact zero_rad = {};
  bool fits_joint_inertia = false;  ///< estimated from the recordings, instead of the stated one
  bool fits_zero = false;
};

/// @throws Error naming file, line, key, the known keys and the nearest one, or a value outside its range.
[[nodiscard]] LoadSheet read_load_sheet(const std::string& path);
[[nodiscard]] LoadSheet parse_load_sheet(std::string_view text, const std::string& name);

/// The load of one recording. A number that is fitted is 0 in it.
/// @param recording its conditions are the facts that the sheet names
/// @throws Error if a condition is missing, or a value that the recording states is impossible.
[[nodiscard]] KnownLoad known_load(const LoadSheet& sheet, const Recording& recording);

}  // namespace torsio
