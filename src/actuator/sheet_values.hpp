#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstddef>
#include <string_view>
#include <type_traits>
#include <variant>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// A sheet or a part of one, const or not.
template <class Sheet, class Part>
concept SheetOf = std::same_as<std::remove_const_t<Sheet>, Part>;

// One list a part: visit(name, unit, value).

template <SheetOf<RatingSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("rated_torque", "Nm", of.torque_Nm);
  visit("rated_current", "A", of.current_A);
  visit("top_speed", "rad/s", of.speed_rad_s);
}

template <SheetOf<MotorSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("torque_constant", "Nm/A", of.torque_constant_Nm_A);
  visit("rotor_inertia", "kg m^2", of.rotor_inertia_kg_m2);
  visit("winding_resistance", "Ohm", of.winding_resistance_Ohm);
  visit("rotor_viscous", "Nms/rad", of.viscous_Nms_rad);
  visit("supply", "V", of.supply_V);
  visit("peak_current_ratio", "", of.peak_current_ratio);
  visit("current_time_constant", "s", of.current_time_constant_s);
  visit("torque_ripple", "", of.torque_ripple);
  visit("ripple_order", "", of.ripple_order);
}

template <SheetOf<GearSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("gear_ratio", "", of.ratio);
  visit("gear_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit("gear_damping_time", "s", of.damping_time_s);
  visit("gear_hysteresis", "rad", of.hysteresis_rad);
  visit("gear_break_away", "rad", of.break_away_rad);
  visit("gear_error_2_per_turn", "rad", of.error_2_rad);
  visit("gear_error_4_per_turn", "rad", of.error_4_rad);
  visit("gear_error_2_phase", "rad", of.error_2_phase_rad);
  visit("gear_error_4_phase", "rad", of.error_4_phase_rad);
}

template <SheetOf<TubeSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("tube_ratio", "", of.ratio);
  visit("tube_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit("tube_damping", "Nms/rad", of.damping_Nms_rad);
}

template <SheetOf<ClutchSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("clutch_ratio", "", of.ratio);
  visit("cable_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit("cable_damping", "Nms/rad", of.damping_Nms_rad);
  visit("clutch_static_torque", "Nm", of.static_torque_Nm);
  visit("clutch_sliding_ratio", "", of.sliding_ratio);
}

template <SheetOf<FrictionSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("friction", "Nm", of.coulomb_Nm);
  visit("friction_viscous", "Nms/rad", of.viscous_Nms_rad);
  visit("friction_load_factor", "", of.load_factor);
  visit("friction_static_ratio", "", of.static_ratio);
  visit("friction_stribeck", "rad/s", of.stribeck_rad_s);
  visit("friction_bristle", "rad", of.bristle_rad);
}

/// visit("name_1", unit, values[0]), ...
template <class Values, class Visit>
void visit_each(std::string_view name, std::string_view unit, Values& values, const Visit& visit) {
  for (std::size_t i = 0; i < values.size(); ++i)
    visit(fmt::format("{}_{}", name, i + 1), unit, values[i]);
}

template <SheetOf<SpringSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("spring_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit("spring_stage", "rad", of.stage_rad);
  visit("spring_stage_stiffness", "Nm/rad", of.stage_stiffness_Nm_rad);
  visit("spring_half_gap", "rad", of.half_gap_rad);
  visit("spring_asymmetry", "", of.asymmetry);
  visit("spring_friction", "Nm", of.friction_Nm);
  visit("spring_load_friction", "", of.load_friction);
  visit("spring_viscosity", "Nms/rad", of.viscosity_Nms_rad);
  visit_each("spring_slip_share", "", of.slip_share, visit);
  visit_each("spring_break_away", "rad", of.break_away_rad, visit);
  visit("spring_knee", "rad", of.knee_rad);
  visit("spring_static_ratio", "", of.static_ratio);
  visit("spring_stribeck", "rad/s", of.stribeck_rad_s);
  for (std::size_t i = 0; i < of.curve.size(); ++i) {
    visit(fmt::format("spring_curve_deflection_{}", i + 1), "rad", of.curve[i].deflection_rad);
    visit(fmt::format("spring_curve_torque_{}", i + 1), "Nm", of.curve[i].torque_Nm);
  }
}

template <SheetOf<ElastomerSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("coupling_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit_each("coupling_branch_stiffness", "Nm/rad", of.branch_stiffness_Nm_rad, visit);
  visit_each("coupling_branch_relaxation", "s", of.branch_relaxation_s, visit);
  visit_each("coupling_output", "Nm", of.output_Nm, visit);
  visit_each("coupling_slip", "Nm", of.slip_Nm, visit);
  visit_each("coupling_break_away", "rad", of.break_away_rad, visit);
  visit("coupling_unbonded_softening", "", of.unbonded_softening);
  visit("coupling_slip_load", "Nm", of.slip_load_Nm);
  visit("coupling_creep_per_cycle", "", of.creep_per_cycle);
}

template <SheetOf<RubberSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("rubber_stiffness", "Nm/rad", of.stiffness_Nm_rad);
  visit("rubber_asymmetry", "Nm/rad", of.asymmetry_Nm_rad);
  visit("rubber_blend", "rad", of.blend_rad);
  visit("rubber_elastic_share", "", of.elastic_share);
  visit("rubber_branch_share", "", of.branch_share);
  visit_each("rubber_branch_relaxation", "s", of.branch_relaxation_s, visit);
  visit("rubber_slip", "Nm", of.slip_Nm);
  visit_each("rubber_break_away", "rad", of.break_away_rad, visit);
}

template <SheetOf<JointSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("output_inertia", "kg m^2", of.inertia_kg_m2);
  visit("bearing_friction", "Nm", of.bearing_friction_Nm);
  visit("bearing_break_away", "rad", of.bearing_break_away_rad);
  visit("joint_viscous", "Nms/rad", of.viscous_Nms_rad);
}

template <SheetOf<SensorSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  visit("motor_encoder_bits", "", of.motor_encoder_bits);
  visit("middle_encoder_bits", "", of.middle_encoder_bits);
  visit("joint_encoder_bits", "", of.joint_encoder_bits);
  visit("twist_sensor_bits", "", of.twist_sensor_bits);
  visit("encoder_jitter", "LSB", of.encoder_jitter_lsb);
  visit("motor_encoder_zero", "rad", of.motor_zero_rad);
  visit("middle_encoder_zero", "rad", of.middle_zero_rad);
  visit("joint_encoder_zero", "rad", of.joint_zero_rad);
  visit("twist_sensor_zero", "rad", of.twist_zero_rad);
  visit("current_noise", "A", of.current_noise_A);
  visit("torque_sensor_range", "Nm", of.torque_range_Nm);
  visit("torque_sensor_noise_share", "", of.torque_noise_share);
  visit("torque_sensor_rate", "Hz", of.torque_rate_Hz);
  visit("torque_sensor_latency", "s", of.torque_latency_s);
  visit("log_rate", "Hz", of.log_rate_Hz);
}

template <SheetOf<DataSheet> Sheet, class Visit>
void visit_values(Sheet& of, const Visit& visit) {
  const auto visit_part = [&](auto& part) { visit_values(part, visit); };
  visit_part(of.rating);
  visit_part(of.motor);
  std::visit(visit_part, of.first);
  visit_part(of.friction);
  visit("middle_inertia", "kg m^2", of.middle_inertia_kg_m2);
  std::visit(visit_part, of.second);
  visit_part(of.joint);
  visit_part(of.sensors);
}

}  // namespace torsio
