#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// The numbers of a drive's equations of motion, all referred to the joint: speeds and torques of the motor are
/// those after an ideal gear.
///
/// One mass (no spring), q the joint's angle, v = q':
///
///     (inertia + armature + joint_inertia) q'' = tau_m + tau_e - tau_f
///     current    i  = (supply sgn(d) |d|^duty_exponent - kt v) / (R + resistance_rise d^2), d the duty
///     motor   tau_m = kt i; 0 while the power is off and the winding open
///             with `speed_limit`, of a law that commands torque: at most stall_torque (1 - v / no_load_speed) forwards,
///             stall_torque (1 + v / no_load_speed) backwards
///     gravity tau_e = -gravity sin(q + zero)
///     friction |tau_f| <= coulomb + load_friction L + load_stribeck L exp(-|v| / load_speed)
///                         + stribeck exp(-|v| / stribeck_speed) + viscous |v|
///     load        L = |tau_m (1 + direction) - tau_e (1 - direction)|
///
/// Two masses, th the motor's angle after the gear, x = th - q less the backlash on both sides, within which x and x'
/// are 0:
///
///     armature th'' = tau_m - tau_f - tau_s, L = |tau_s|
///     (inertia + joint_inertia) q'' = tau_s + tau_e - bearing (at most, as dry friction) - bearing_viscous v
///     tau_s = stiffness x + spring_damping x' + hysteresis s,  s' = x' / hysteresis_width, |s| <= 1
///
/// With `presliding` p > 0 the dry friction of the motor's side is that sum without the viscous part times z,
/// z' = th' / p (1 - z sgn th') (Dahl 1968).
enum class DriveParameter : std::uint8_t {
  torque_constant,
  resistance,
  armature,
  zero,
  coulomb,
  viscous,
  delay,
  load_friction,
  load_stribeck,
  load_speed,
  stribeck,
  stribeck_speed,
  resistance_rise,
  duty_exponent,
  no_load_speed,
  stall_torque,
  direction,
  joint_inertia,
  stiffness,
  spring_damping,
  hysteresis,
  hysteresis_width,
  backlash,
  bearing,
  bearing_viscous,
  presliding,
};
inline constexpr std::size_t kDriveParameters = 26;

/// What belongs together in the choice of a structure: the parameters of a term are searched for, or none of them.
enum class DriveTerm : std::uint8_t {
  base,  ///< torque constant and resistance (as far as the law has them), armature, zero, coulomb, viscous
  delay,
  load_friction,
  load_stribeck,
  stribeck,
  resistance_rise,
  duty_exponent,
  speed_limit,  ///< what the supply leaves of the torque at high speed
  direction,
  joint_inertia,
  spring,  ///< second mass: stiffness and damping
  hysteresis,
  backlash,
  bearing,
  presliding,
};
inline constexpr std::size_t kDriveTerms = 15;

using DriveTerms = std::bitset<kDriveTerms>;

[[nodiscard]] std::string_view name(DriveTerm term);
[[nodiscard]] DriveTerms drive_terms(std::initializer_list<DriveTerm> terms);
/// The base and the terms of these names.
/// @param place for messages: "--terms"
/// @param expected what they are, before the known names: "auto, or terms of "
/// @throws UsageError for an unknown name, with the nearest one.
[[nodiscard]] DriveTerms drive_terms_named(std::span<const std::string> names,
                                           const std::string& place, const std::string& expected);
[[nodiscard]] inline bool has(const DriveTerms& terms, DriveTerm term) {
  return terms.test(static_cast<std::size_t>(term));
}

/// One row for each `DriveParameter`.
struct DriveParameterInfo {
  DriveParameter parameter;
  DriveTerm term;
  std::string_view name;     ///< with its unit: "armature_kg_m2"
  std::string_view meaning;  ///< for tables: "inertia of the motor"
  double neutral;            ///< value at which the term has no effect
  double lowest;             ///< bound of the search
  double highest;
  bool is_positive;  ///< searched for by its logarithm
};

[[nodiscard]] std::span<const DriveParameterInfo, kDriveParameters> drive_parameters();
[[nodiscard]] const DriveParameterInfo& drive_parameter_info(DriveParameter parameter);

using DriveValues = std::array<double, kDriveParameters>;

/// Every value neutral.
[[nodiscard]] DriveValues neutral_drive_values();

[[nodiscard]] inline double& at(DriveValues& values, DriveParameter parameter) {
  return values[static_cast<std::size_t>(parameter)];
}
[[nodiscard]] inline double at(const DriveValues& values, DriveParameter parameter) {
  return values[static_cast<std::size_t>(parameter)];
}

}  // namespace torsio
