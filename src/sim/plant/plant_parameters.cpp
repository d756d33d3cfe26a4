#include "sim/plant/plant_parameters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <variant>
#include <vector>

#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/core/dispatch.hpp"

namespace torsio {
namespace {

Motor::Parameters motor_of(const DataSheet& sheet) {
  const MotorSheet& motor = sheet.motor;
  return {.torque_constant_Nm_A = motor.torque_constant_Nm_A.value,
          .peak_current_A = motor.peak_current_ratio.value * sheet.rating.current_A.value,
          .current_time_constant_s = motor.current_time_constant_s.value,
          .supply_V = motor.supply_V.value,
          .resistance_Ohm = motor.winding_resistance_Ohm.value,
          .ripple = motor.torque_ripple.value,
          .ripple_order = motor.ripple_order.value};
}

Gear::Parameters stage_of(const GearSheet& gear) {
  const double stiffness = gear.stiffness_Nm_rad.value;
  return {.ratio = gear.ratio.value,
          .error_rad = {gear.error_2_rad.value, gear.error_4_rad.value},
          .error_phase_rad = {gear.error_2_phase_rad.value, gear.error_4_phase_rad.value},
          .stiffness_Nm_rad = stiffness,
          .damping_Nms_rad = gear.damping_time_s.value * stiffness,
          .hysteresis_Nm = gear.hysteresis_rad.value * stiffness,
          .break_away_rad = gear.break_away_rad.value};
}

Gear::Parameters stage_of(const TubeSheet& tube) {
  return {.ratio = tube.ratio.value,
          .stiffness_Nm_rad = tube.stiffness_Nm_rad.value,
          .damping_Nms_rad = tube.damping_Nms_rad.value};
}

SlipClutch::Parameters stage_of(const ClutchSheet& clutch) {
  return {.ratio = clutch.ratio.value,
          .stiffness_Nm_rad = clutch.stiffness_Nm_rad.value,
          .static_torque_Nm = clutch.static_torque_Nm.value,
          .sliding_ratio = clutch.sliding_ratio.value,
          .damping_Nms_rad = clutch.damping_Nms_rad.value};
}

template <std::size_t Count>
std::array<double, Count> values(const std::array<SheetValue, Count>& from) {
  std::array<double, Count> of{};
  std::ranges::transform(from, of.begin(), &SheetValue::value);
  return of;
}

double sum(const std::array<double, 3>& of) { return of[0] + of[1] + of[2]; }

/// Three slip elements with these limits.
MaxwellSlip<3>::Parameters slip_of(const std::array<double, 3>& limit_Nm,
                                   const std::array<SheetValue, 3>& break_away_rad) {
  const double all_Nm = sum(limit_Nm);
  return {.constant_Nm = all_Nm,
          .share = {limit_Nm[0] / all_Nm, limit_Nm[1] / all_Nm, limit_Nm[2] / all_Nm},
          .break_away_rad = values(break_away_rad)};
}

ElastomerCoupling::Parameters stage_of(const ElastomerSheet& coupling) {
  return {.stiffness_Nm_rad = coupling.stiffness_Nm_rad.value,
          .branches = {.stiffness_Nm_rad = values(coupling.branch_stiffness_Nm_rad),
                       .relaxation_s = values(coupling.branch_relaxation_s)},
          .output_Nm = values(coupling.output_Nm),
          .slip = slip_of(values(coupling.slip_Nm), coupling.break_away_rad),
          .bonded = coupling.bonded,
          .unbonded_softening = coupling.unbonded_softening.value,
          .slip_load_Nm = coupling.slip_load_Nm.value,
          .creep_per_cycle = coupling.creep_per_cycle.value};
}

RubberSpring::Parameters stage_of(const RubberSheet& rubber) {
  const double branch_Nm_rad = rubber.branch_share.value * rubber.stiffness_Nm_rad.value;
  const double slip_Nm = rubber.slip_Nm.value;
  return {.stiffness_Nm_rad = rubber.stiffness_Nm_rad.value,
          .asymmetry_Nm_rad = rubber.asymmetry_Nm_rad.value,
          .blend_rad = rubber.blend_rad.value,
          .elastic_share = rubber.elastic_share.value,
          .branches = {.stiffness_Nm_rad = {branch_Nm_rad, branch_Nm_rad, branch_Nm_rad},
                       .relaxation_s = values(rubber.branch_relaxation_s)},
          .slip = slip_of({slip_Nm, slip_Nm, slip_Nm}, rubber.break_away_rad)};
}

decltype(Spring::Parameters::friction) friction_of(const SpringSheet& spring) {
  const double constant_Nm = spring.friction_Nm.value;
  const double load_factor = spring.load_friction.value;
  switch (spring.variant) {
    case SpringVariant::bouc_wen:
      return BoucWen::Parameters{.constant_Nm = constant_Nm,
                                 .load_factor = load_factor,
                                 .knee_rad = spring.knee_rad.value};
    case SpringVariant::lugre:
      return LuGreSlip::Parameters{.constant_Nm = constant_Nm,
                                   .load_factor = load_factor,
                                   .static_ratio = spring.static_ratio.value,
                                   .stribeck_rad_s = spring.stribeck_rad_s.value,
                                   .bristle_rad = spring.knee_rad.value};
    case SpringVariant::maxwell_slip: break;
  }
  return MaxwellSlip<4>::Parameters{.constant_Nm = constant_Nm,
                                    .load_factor = load_factor,
                                    .share = values(spring.slip_share),
                                    .break_away_rad = values(spring.break_away_rad)};
}

std::vector<TorqueTable::Point> table_of(const std::vector<CurvePoint>& curve) {
  std::vector<TorqueTable::Point> points(curve.size());
  std::ranges::transform(curve, points.begin(), [](const CurvePoint& of) -> TorqueTable::Point {
    return {of.deflection_rad.value, of.torque_Nm.value};
  });
  return points;
}

Spring::Parameters stage_of(const SpringSheet& spring) {
  const double stage = spring.stage_rad.value;
  return {
      .elastic = {.stiffness_Nm_rad = spring.stiffness_Nm_rad.value,
                  .half_gap_rad = spring.half_gap_rad.value,
                  .asymmetry = spring.asymmetry.value,
                  .stage_rad = stage > 0.0 ? stage : std::numeric_limits<double>::infinity(),
                  .stage_stiffness_Nm_rad = spring.stage_stiffness_Nm_rad.value},
      .table = table_of(spring.curve),
      .friction = friction_of(spring),
      .viscosity_Nms_rad = spring.viscosity_Nms_rad.value,
  };
}

/// The friction at the joint, referred to the gear's input.
LuGreFriction::Parameters friction_of(const FrictionSheet& friction, double ratio) {
  return {.coulomb_Nm = friction.coulomb_Nm.value / ratio,
          .load_factor = friction.load_factor.value / ratio,
          .static_ratio = friction.static_ratio.value,
          .stribeck_rad_s = friction.stribeck_rad_s.value,
          .bristle_rad = friction.bristle_rad.value,
          .viscous_Nms_rad = friction.viscous_Nms_rad.value / (ratio * ratio)};
}

/// A stage without a ratio transmits one to one.
double ratio_of(const auto& stage) {
  return detail::dispatch(stage, [](const auto& of) {
    if constexpr (requires { of.ratio; }) return of.ratio;
    return 1.0;
  });
}

/// Beyond the play, without friction, glassy.
double stiffness_of(const Gear::Parameters& of) { return of.stiffness_Nm_rad; }
double stiffness_of(const SlipClutch::Parameters& of) { return of.stiffness_Nm_rad; }
double stiffness_of(const Spring::Parameters& of) { return of.elastic.stiffness_Nm_rad; }
double stiffness_of(const ElastomerCoupling::Parameters& of) {
  return ElastomerCoupling(of).chain().stiffness();
}
double stiffness_of(const RubberSpring::Parameters& of) {
  return of.elastic_share * of.stiffness_Nm_rad + sum(of.branches.stiffness_Nm_rad);
}

}  // namespace

double total_ratio(const PlantParameters& parameters) noexcept {
  return ratio_of(parameters.first) * ratio_of(parameters.second);
}

std::array<double, 2> natural_frequencies(const PlantParameters& parameters) {
  // All seen from the joint; a chain of three free bodies: λ = ω² solves λ² − sum λ + product = 0.
  const double second_ratio = ratio_of(parameters.second);
  const double both_ratios = total_ratio(parameters);
  const double rotor = parameters.rotor_inertia_kg_m2 * both_ratios * both_ratios;
  const double middle = parameters.middle_inertia_kg_m2 * second_ratio * second_ratio;
  const double joint = parameters.joint_inertia_kg_m2;
  const auto stiffness = [](const auto& stage) { return stiffness_of(stage); };
  const double first = detail::dispatch(parameters.first, stiffness) * second_ratio * second_ratio;
  const double second = detail::dispatch(parameters.second, stiffness);
  const double sum = first * (1.0 / rotor + 1.0 / middle) + second * (1.0 / middle + 1.0 / joint);
  const double product = first * second * (rotor + middle + joint) / (rotor * middle * joint);
  const double high = 0.5 * (sum + std::sqrt(sum * sum - 4.0 * product));
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return {std::sqrt(product / high) / kTurn, std::sqrt(high) / kTurn};
}

ElectricalDrive::Parameters electrical_parameters(const DataSheet& sheet, std::uint64_t seed) {
  const ElectricalSheet parts = electrical_sheet(sheet);
  const double gain_error = parts.current_gain_error.value;
  return {.control = {.windings = {.resistance_Ohm = parts.phase_resistance_Ohm.value,
                                   .inductance_H = parts.phase_inductance_H.value,
                                   .torque_constant_Nm_A = sheet.motor.torque_constant_Nm_A.value,
                                   .pole_pairs = static_cast<int>(parts.pole_pairs.value)},
                      .bandwidth_rad_s = parts.bandwidth_rad_s.value,
                      .peak_current_A =
                          sheet.motor.peak_current_ratio.value * sheet.rating.current_A.value,
                      .trip_current_A = parts.trip_current_A.value},
          .pwm_Hz = parts.pwm_Hz.value,
          .supply_V = sheet.motor.supply_V.value,
          .sensors = {.offset_a_A = parts.current_offset_A.value,
                      .offset_b_A = -parts.current_offset_A.value,
                      .gain_error_a = gain_error,
                      .gain_error_b = -gain_error,
                      .noise_A = parts.current_noise_A.value},
          .commutation_error_rad = parts.commutation_error_rad.value,
          .thermal = {.copper_J_K = parts.copper_J_K.value,
                      .stator_J_K = parts.stator_J_K.value,
                      .copper_stator_K_W = parts.copper_stator_K_W.value,
                      .stator_ambient_K_W = parts.stator_ambient_K_W.value},
          .derating_begins_K = parts.derating_begins_K.value,
          .derating_ends_K = parts.derating_ends_K.value,
          .seed = seed};
}

Brake::Parameters brake_parameters(const DataSheet& sheet) {
  const BrakeSheet parts = brake_sheet(sheet);
  const double static_Nm = parts.static_torque_Nm.value / total_ratio(plant_parameters(sheet));
  return {.static_Nm = static_Nm,
          .sliding_Nm = parts.sliding_ratio.value * static_Nm,
          .bristle_rad = parts.bristle_rad.value,
          .stribeck_rad_s = parts.stribeck_rad_s.value,
          .activation_V = parts.activation_V.value,
          .engage_s = parts.engage_s.value,
          .release_s = parts.release_s.value};
}

PlantParameters plant_parameters(const DataSheet& sheet) {
  PlantParameters plant;
  plant.motor = motor_of(sheet);
  plant.first = std::visit(
      [](const auto& of) -> decltype(PlantParameters::first) { return stage_of(of); }, sheet.first);
  plant.second =
      std::visit([](const auto& of) -> decltype(PlantParameters::second) { return stage_of(of); },
                 sheet.second);
  // The friction sits where the gear is driven.
  if (std::holds_alternative<GearSheet>(sheet.second)) {
    plant.middle_friction = friction_of(sheet.friction, ratio_of(plant.second));
  } else {
    plant.rotor_friction = friction_of(sheet.friction, ratio_of(plant.first));
  }
  plant.rotor_friction.viscous_Nms_rad += sheet.motor.viscous_Nms_rad.value;
  plant.bearing = {.coulomb_Nm = sheet.joint.bearing_friction_Nm.value,
                   .bristle_rad = sheet.joint.bearing_break_away_rad.value};
  plant.joint_viscous_Nms_rad = sheet.joint.viscous_Nms_rad.value;
  plant.rotor_inertia_kg_m2 = sheet.motor.rotor_inertia_kg_m2.value;
  plant.middle_inertia_kg_m2 = sheet.middle_inertia_kg_m2.value;
  plant.joint_inertia_kg_m2 = sheet.joint.inertia_kg_m2.value;
  plant.rated_torque_Nm = sheet.rating.torque_Nm.value;
  return plant;
}

}  // namespace torsio
