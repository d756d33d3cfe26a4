#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "torsio/core/units.hpp"

namespace torsio {

/// How well a number of a data sheet is known.
enum class Origin : char {
  printed = 'P',  ///< printed in a paper
  derived = 'D',  ///< computed from printed numbers
  assumed = 'A',  ///< engineering estimate
};

/// A number and where it comes from.
struct SheetValue {
  double value = 0.0;
  Origin origin = Origin::assumed;
};
constexpr SheetValue printed(double value) { return {value, Origin::printed}; }
constexpr SheetValue derived(double value) { return {value, Origin::derived}; }
constexpr SheetValue assumed(double value) { return {value, Origin::assumed}; }

// The parts of a sheet. SI everywhere; a default is what specification 4.1 gives to all.

struct RatingSheet {
  SheetValue torque_Nm;  ///< at the joint
  SheetValue current_A;
  SheetValue speed_rad_s;  ///< speed of the joint
};

struct MotorSheet {
  SheetValue torque_constant_Nm_A;
  SheetValue rotor_inertia_kg_m2;
  SheetValue winding_resistance_Ohm;
  SheetValue viscous_Nms_rad = assumed(0.0);  ///< friction of the rotor's bearing
  SheetValue supply_V;
  SheetValue peak_current_ratio = assumed(2.0);  ///< over the rated current
  SheetValue current_time_constant_s = assumed(0.5e-3);
  SheetValue torque_ripple = assumed(0.002);  ///< share of the peak torque
  SheetValue ripple_order = assumed(30.0);    ///< periods a rotor turn: 6 times 5 pole pairs
};

/// A strain-wave gear.
struct GearSheet {
  SheetValue ratio;
  SheetValue stiffness_Nm_rad;                  ///< at its output, like all below
  SheetValue damping_time_s = assumed(4e-4);    ///< damping over stiffness
  SheetValue hysteresis_rad = assumed(1.2e-4);  ///< half width, times the stiffness
  SheetValue break_away_rad = assumed(6e-5);
  SheetValue error_2_rad = assumed(1.5e-4);  ///< twice a turn of the wave generator
  SheetValue error_4_rad = assumed(0.5e-4);
  SheetValue error_2_phase_rad = assumed(0.4);
  SheetValue error_4_phase_rad = assumed(1.1);
};

/// A torsion tube after an ideal first reduction.
struct TubeSheet {
  SheetValue ratio;
  SheetValue stiffness_Nm_rad;
  SheetValue damping_Nms_rad;
};

/// A planetary gearhead and a cable drive that end in a friction clutch.
struct ClutchSheet {
  SheetValue ratio;
  SheetValue stiffness_Nm_rad;  ///< stiffness of the cable
  SheetValue damping_Nms_rad;
  SheetValue static_torque_Nm;
  SheetValue sliding_ratio;  ///< sliding over static torque
};

/// Dry and viscous friction at the gear's input, referred to its output.
struct FrictionSheet {
  SheetValue coulomb_Nm;
  SheetValue viscous_Nms_rad;
  SheetValue load_factor = assumed(0.10);
  SheetValue static_ratio = assumed(1.15);
  SheetValue stribeck_rad_s = assumed(3.0);  ///< speed of the gear's input
  SheetValue bristle_rad = assumed(0.02);    ///< angle of the gear's input
};

/// How the inner friction of a spring is modelled (specification 4.6).
enum class SpringVariant { maxwell_slip, bouc_wen, lugre };

/// A point of a measured or designed torque curve.
struct CurvePoint {
  SheetValue deflection_rad;
  SheetValue torque_Nm;
};

struct SpringSheet {
  SpringVariant variant = SpringVariant::maxwell_slip;
  SheetValue stiffness_Nm_rad;
  SheetValue stage_rad = assumed(0.0);  ///< where the second stage begins; 0: there is none
  SheetValue stage_stiffness_Nm_rad = assumed(0.0);
  SheetValue half_gap_rad;
  SheetValue asymmetry;
  SheetValue friction_Nm;
  SheetValue load_friction;
  SheetValue viscosity_Nms_rad = assumed(0.3);
  std::array<SheetValue, 4> slip_share = {assumed(0.30), assumed(0.30), assumed(0.25),
                                          assumed(0.15)};
  std::array<SheetValue, 4> break_away_rad;
  SheetValue knee_rad = assumed(rad_from_deg(0.15));  ///< bouc-wen, lugre
  SheetValue static_ratio = assumed(1.15);            ///< lugre
  SheetValue stribeck_rad_s = assumed(0.05);          ///< lugre
  /// The elastic curve as a table, in the order of the deflection. It replaces second stage, play
  /// and asymmetry; the stiffness is then the nominal one, for the design of controllers and for
  /// frequencies. Empty: none.
  std::vector<CurvePoint> curve = {};
};

/// A shaft coupling of elastomer: branches from slow to fast.
struct ElastomerSheet {
  bool bonded = true;
  SheetValue stiffness_Nm_rad;  ///< relaxed
  std::array<SheetValue, 3> branch_stiffness_Nm_rad;
  std::array<SheetValue, 3> branch_relaxation_s;
  std::array<SheetValue, 3> output_Nm;  ///< coefficients of the output curve
  std::array<SheetValue, 3> slip_Nm;
  std::array<SheetValue, 3> break_away_rad;
  SheetValue unbonded_softening;  ///< bonded over unbonded stiffness
  SheetValue slip_load_Nm;        ///< from where the slip of the unbonded one is full
  SheetValue creep_per_cycle;     ///< share of the torque that the glue loses in a load cycle
};

/// A torsion spring of rubber: branches from slow to fast.
struct RubberSheet {
  SheetValue stiffness_Nm_rad;
  SheetValue asymmetry_Nm_rad;
  SheetValue blend_rad;
  SheetValue elastic_share;
  SheetValue branch_share;  ///< each branch's stiffness over the spring's
  std::array<SheetValue, 3> branch_relaxation_s;
  SheetValue slip_Nm;  ///< slip torque of each element
  std::array<SheetValue, 3> break_away_rad;
};

struct JointSheet {
  SheetValue inertia_kg_m2 = assumed(0.15);  ///< flange and bare arm
  SheetValue bearing_friction_Nm;
  SheetValue bearing_break_away_rad = assumed(2e-4);
  SheetValue viscous_Nms_rad = assumed(0.05);
};

struct SensorSheet {
  SheetValue motor_encoder_bits = printed(19.0);
  SheetValue middle_encoder_bits = printed(19.0);
  SheetValue joint_encoder_bits = printed(19.0);
  SheetValue twist_sensor_bits =
      assumed(0.0);  ///< sensor of the second stage's twist; 0: there is none
  SheetValue encoder_jitter_lsb = assumed(0.5);
  SheetValue motor_zero_rad = assumed(0.0);  ///< zero error of the encoder
  SheetValue middle_zero_rad = assumed(0.0);
  SheetValue joint_zero_rad = assumed(0.0);
  SheetValue twist_zero_rad = assumed(0.0);
  SheetValue current_noise_A = assumed(0.02);
  SheetValue torque_range_Nm;
  SheetValue torque_noise_share = assumed(0.0005 / 3.0);  ///< 0.05 % class read as three sigma
  SheetValue torque_rate_Hz = printed(125.0);
  SheetValue torque_latency_s = assumed(2e-3);
  SheetValue log_rate_Hz = printed(1000.0);
};

/// The bench of an actuator: its experiments and its logged channels.
enum class ActuatorFamily { series_elastic, elastomer, rubber_clutch, harmonic_drive };

/// Everything that the plant and the sensors of one actuator are built from, in SI.
///
/// An actuator is a chain of three bodies: rotor, first stage, middle body, second stage, joint
/// (see `Plant`). The values are fixed by specification 4.1 to 4.5 and are never tuned to the
/// results of a method.
struct DataSheet {
  ActuatorFamily family = ActuatorFamily::series_elastic;
  std::string name;
  std::string title;
  std::array<std::string_view, 3> variants = {};  ///< the first is the default; empty: no more
  std::string_view variant = {};                  ///< one of them
  std::optional<unsigned> serial = {};            ///< none: the nominal actuator

  RatingSheet rating;
  MotorSheet motor;
  std::variant<GearSheet, TubeSheet, ClutchSheet> first;
  FrictionSheet friction;  ///< friction of the gear and its drive
  SheetValue middle_inertia_kg_m2;
  std::variant<SpringSheet, ElastomerSheet, RubberSheet, GearSheet> second;
  JointSheet joint;
  SensorSheet sensors;
};

/// One line of a printed data sheet.
struct SheetRow {
  std::string name;
  std::string_view unit;  ///< as printed; empty for a dimensionless number
  SheetValue value;
};

/// Every number of the sheet, in the order above.
[[nodiscard]] std::vector<SheetRow> describe(const DataSheet& sheet);

/// What the paper of the actuator prints and the plant does not use: rated speed, mass, size. Empty for a
/// sheet of another name.
[[nodiscard]] std::vector<SheetRow> printed_facts(const DataSheet& sheet);

/// The nominal sheets in their default variants.
[[nodiscard]] std::span<const DataSheet> data_sheets() noexcept;

/// @param name NAME, NAME:VARIANT, NAME#SERIAL or NAME:VARIANT#SERIAL, as "dfki-50:bouc-wen#03". A
/// serial number names a specimen with the spread of specification 4.6; the same one always
/// gives the same specimen.
/// @throws UsageError that lists the known names or variants.
[[nodiscard]] DataSheet data_sheet(std::string_view name);

/// @returns the name for `data_sheet`, with the variant only if it is not the default
[[nodiscard]] std::string full_name(const DataSheet& sheet);

/// Identifies a data sheet: a hash of the full name, including the variant, and of every number.
/// @returns 16 hexadecimal digits, the same on every platform
[[nodiscard]] std::string sheet_hash(const DataSheet& sheet);

}  // namespace torsio
