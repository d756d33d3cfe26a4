#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace torsio {

/// How well a number of a data sheet is known.
enum class Origin : char {
  printed = 'P',  ///< printed in a paper
  derived = 'D',  ///< computed from printed numbers
  assumed = 'A',  ///< engineering judgement
};

/// A number and where it comes from.
struct SheetValue {
  double value = 0.0;
  Origin origin = Origin::assumed;
};
constexpr SheetValue printed(double value) { return {value, Origin::printed}; }
constexpr SheetValue derived(double value) { return {value, Origin::derived}; }
constexpr SheetValue assumed(double value) { return {value, Origin::assumed}; }

/// Everything that the plant and the sensors of one actuator are built from, in SI.
///
/// The values are fixed by SPEC sections 4.1 and 4.2 and are never tuned to what a method makes of
/// them. Those that are the same for the whole family stand here as defaults. "Output" means behind
/// the gear, "rotor" before it.
struct DataSheet {
  std::string_view name;
  std::string_view title;

  // Ratings
  SheetValue rated_torque_Nm;
  SheetValue rated_current_A;
  SheetValue top_speed_rad_s;  ///< of the joint

  // Motor and its current loop
  SheetValue torque_constant_Nm_A;
  SheetValue rotor_inertia_kg_m2;
  SheetValue winding_resistance_Ohm;
  SheetValue supply_V = printed(48.0);
  SheetValue peak_current_ratio = assumed(2.0);  ///< over the rated current
  SheetValue current_time_constant_s = assumed(0.5e-3);
  SheetValue torque_ripple = assumed(0.002);  ///< share of the peak torque
  SheetValue ripple_order = assumed(30.0);    ///< periods a rotor turn: 6 times 5 pole pairs

  // Gear
  SheetValue gear_ratio;
  SheetValue gear_inertia_kg_m2;  ///< output side
  SheetValue gear_stiffness_Nm_rad;
  SheetValue gear_damping_time_s = assumed(4e-4);    ///< damping over stiffness
  SheetValue gear_hysteresis_rad = assumed(1.2e-4);  ///< half width, times the stiffness
  SheetValue gear_break_away_rad = assumed(6e-5);
  std::array<SheetValue, 2> gear_error_rad = {assumed(1.5e-4), assumed(0.5e-4)};
  std::array<SheetValue, 2> gear_error_phase_rad = {assumed(0.4), assumed(1.1)};

  // Friction of motor and gear, as felt at the output
  SheetValue friction_Nm;
  SheetValue friction_viscous_Nms_rad;
  SheetValue friction_load_factor = assumed(0.10);
  SheetValue friction_static_ratio = assumed(1.15);
  SheetValue friction_stribeck_rad_s = assumed(3.0);  ///< rotor speed
  SheetValue friction_bristle_rad = assumed(0.02);    ///< rotor angle

  // Spring
  SheetValue spring_stiffness_Nm_rad;
  SheetValue spring_stage_rad = assumed(0.0);  ///< where the second stage begins; 0: there is none
  SheetValue spring_stage_stiffness_Nm_rad = assumed(0.0);
  SheetValue spring_half_gap_rad;
  SheetValue spring_asymmetry;
  SheetValue spring_friction_Nm;
  SheetValue spring_load_friction;
  SheetValue spring_viscosity_Nms_rad = assumed(0.3);
  std::array<SheetValue, 4> spring_slip_share = {assumed(0.30), assumed(0.30), assumed(0.25),
                                                 assumed(0.15)};
  std::array<SheetValue, 4> spring_break_away_rad;

  // Joint
  SheetValue output_inertia_kg_m2 = assumed(0.15);  ///< flange and bare arm
  SheetValue bearing_friction_Nm;
  SheetValue bearing_break_away_rad = assumed(2e-4);
  SheetValue joint_viscous_Nms_rad = assumed(0.05);

  // Sensors
  SheetValue encoder_bits = printed(19.0);
  SheetValue encoder_jitter_lsb = assumed(0.5);
  SheetValue current_noise_A = assumed(0.02);
  SheetValue torque_range_Nm;
  SheetValue torque_noise_share = assumed(0.0005 / 3.0);  ///< 0.05 % class read as three sigma
  SheetValue torque_rate_Hz = printed(125.0);
  SheetValue torque_latency_s = assumed(2e-3);
};

/// One line of a printed data sheet.
struct SheetRow {
  std::string_view name;
  std::string_view unit;  ///< as a person writes it; empty for a plain number
  SheetValue value;
};

/// Every number of the sheet, in the order above.
[[nodiscard]] std::vector<SheetRow> describe(const DataSheet& sheet);

/// The actuators that torsio knows, in the order of their size.
[[nodiscard]] std::span<const DataSheet> data_sheets() noexcept;

/// @throws UsageError that lists the known names if there is none of this name.
[[nodiscard]] const DataSheet& data_sheet(std::string_view name);

}  // namespace torsio
