#include "torsio/sim/plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kMostSmallSteps = 1e6;  // in one step: it must return

bool is_usable(const PlantCommand& command, const Load& load, double dt_s,
               double longest_dt_s) noexcept {
  return dt_s > 0.0 && dt_s <= longest_dt_s && load.inertia_kg_m2 >= 0.0 &&
         std::isfinite(command.current_A + load.inertia_kg_m2 + load.gravity_Nm +
                       load.external_torque_Nm);
}

void require_inertia(const char* name, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw Error({.place = "plant",
               .problem = "impossible parameter",
               .expected = fmt::format("{} > 0 and finite", name),
               .found = fmt::format("{}", value)});
}

std::array<double, 4> values(const std::array<SheetValue, 4>& from) {
  return {from[0].value, from[1].value, from[2].value, from[3].value};
}

}  // namespace

Load lever(double mass_kg, double length_m, double inclination_rad) {
  if (!(mass_kg >= 0.0 && length_m >= 0.0 && std::isfinite(mass_kg * length_m) &&
        std::isfinite(inclination_rad))) {
    throw Error({.place = "lever",
                 .problem = "impossible parameter",
                 .expected = "mass and length >= 0 and finite",
                 .found = fmt::format("{} kg at {} m, inclined by {} rad", mass_kg, length_m,
                                      inclination_rad)});
  }
  return {.inertia_kg_m2 = mass_kg * length_m * length_m,
          .gravity_Nm = mass_kg * length_m * kGravity_m_s2 * std::cos(inclination_rad)};
}

PlantParameters plant_parameters(const DataSheet& sheet) {
  const double ratio = sheet.gear_ratio.value;
  const double gear_stiffness = sheet.gear_stiffness_Nm_rad.value;
  const double stage = sheet.spring_stage_rad.value;
  PlantParameters plant;
  plant.motor = {
      .torque_constant_Nm_A = sheet.torque_constant_Nm_A.value,
      .peak_current_A = sheet.peak_current_ratio.value * sheet.rated_current_A.value,
      .current_time_constant_s = sheet.current_time_constant_s.value,
      .supply_V = sheet.supply_V.value,
      .resistance_Ohm = sheet.winding_resistance_Ohm.value,
      .ripple = sheet.torque_ripple.value,
      .ripple_order = sheet.ripple_order.value,
  };
  plant.motor_friction = {
      .coulomb_Nm = sheet.friction_Nm.value / ratio,
      .load_factor = sheet.friction_load_factor.value / ratio,
      .static_ratio = sheet.friction_static_ratio.value,
      .stribeck_rad_s = sheet.friction_stribeck_rad_s.value,
      .bristle_rad = sheet.friction_bristle_rad.value,
      .viscous_Nms_rad = sheet.friction_viscous_Nms_rad.value / (ratio * ratio),
  };
  plant.gear = {
      .ratio = ratio,
      .error_rad = {sheet.gear_error_rad[0].value, sheet.gear_error_rad[1].value},
      .error_phase_rad = {sheet.gear_error_phase_rad[0].value, sheet.gear_error_phase_rad[1].value},
      .stiffness_Nm_rad = gear_stiffness,
      .damping_Nms_rad = sheet.gear_damping_time_s.value * gear_stiffness,
      .hysteresis_Nm = sheet.gear_hysteresis_rad.value * gear_stiffness,
      .break_away_rad = sheet.gear_break_away_rad.value,
  };
  plant.spring = {
      .elastic = {.stiffness_Nm_rad = sheet.spring_stiffness_Nm_rad.value,
                  .half_gap_rad = sheet.spring_half_gap_rad.value,
                  .asymmetry = sheet.spring_asymmetry.value,
                  .stage_rad = stage > 0.0 ? stage : std::numeric_limits<double>::infinity(),
                  .stage_stiffness_Nm_rad = sheet.spring_stage_stiffness_Nm_rad.value},
      .friction = MaxwellSlip<4>::Parameters{.constant_Nm = sheet.spring_friction_Nm.value,
                                             .load_factor = sheet.spring_load_friction.value,
                                             .share = values(sheet.spring_slip_share),
                                             .break_away_rad = values(sheet.spring_break_away_rad)},
      .viscosity_Nms_rad = sheet.spring_viscosity_Nms_rad.value,
  };
  plant.bearing = {.coulomb_Nm = sheet.bearing_friction_Nm.value,
                   .bristle_rad = sheet.bearing_break_away_rad.value};
  plant.joint_viscous_Nms_rad = sheet.joint_viscous_Nms_rad.value;
  plant.rotor_inertia_kg_m2 = sheet.rotor_inertia_kg_m2.value;
  plant.gear_inertia_kg_m2 = sheet.gear_inertia_kg_m2.value;
  plant.output_inertia_kg_m2 = sheet.output_inertia_kg_m2.value;
  plant.rated_torque_Nm = sheet.rated_torque_Nm.value;
  return plant;
}

Plant::Plant(const PlantParameters& parameters, double longest_step_s)
    : parameters_(parameters),
      motor_(parameters.motor),
      motor_friction_(parameters.motor_friction),
      gear_(parameters.gear),
      spring_(parameters.spring),
      bearing_(parameters.bearing),
      longest_step_s_(longest_step_s) {
  require_inertia("rotor_inertia_kg_m2", parameters.rotor_inertia_kg_m2);
  require_inertia("gear_inertia_kg_m2", parameters.gear_inertia_kg_m2);
  require_inertia("output_inertia_kg_m2", parameters.output_inertia_kg_m2);
  const double limit_s = step_limit(parameters);
  if (!(longest_step_s > 0.0 && longest_step_s <= limit_s)) {
    throw Error({.place = "plant",
                 .problem = "the step does not suit the stiffest mode",
                 .expected = fmt::format("0 s < step <= {:.3g} s", limit_s),
                 .found = fmt::format("{:.3g} s", longest_step_s),
                 .advice = "shorten the step, or soften the stiffest spring"});
  }
  reset();
}

double Plant::step_limit(const PlantParameters& parameters) {
  // The largest row sum of M^-1 K bounds its largest eigenvalue. The speeds are scaled so that the
  // rotor moves as much as the gear's output.
  const double gear = Gear(parameters.gear).steepest();
  const double spring = Spring(parameters.spring).steepest(parameters.rated_torque_Nm);
  const double ratio = parameters.gear.ratio;
  const double friction =
      LuGreFriction(parameters.motor_friction).stiffness(parameters.rated_torque_Nm);
  const double bearing = LuGreFriction(parameters.bearing).stiffness(0.0);
  const double at_gear = (gear + spring) / parameters.gear_inertia_kg_m2;
  const double at_rotor = (gear / (ratio * ratio) + friction) / parameters.rotor_inertia_kg_m2;
  const double at_joint = (spring + bearing) / parameters.output_inertia_kg_m2;
  // Off-diagonal terms couple two neighbours: sqrt(k/m1 * k/m2) each, which their sum bounds.
  const double coupled =
      gear / std::sqrt(parameters.gear_inertia_kg_m2 * ratio * ratio *
                       parameters.rotor_inertia_kg_m2) +
      spring / std::sqrt(parameters.gear_inertia_kg_m2 * parameters.output_inertia_kg_m2);
  return 0.25 / std::sqrt(std::max({at_gear, at_rotor, at_joint}) + coupled);
}

void Plant::set_period(double dt_s) noexcept {
  asked_dt_s_ = dt_s;
  small_steps_ = static_cast<std::size_t>(std::ceil(dt_s / longest_step_s_ * (1.0 - 1e-12)));
  dt_s_ = dt_s / static_cast<double>(small_steps_);
  motor_.set_period(dt_s_);
}

void Plant::reset(const PlantState& state) noexcept {
  state_ = state;
  torques_ = {};
  motor_.reset();
  motor_friction_.reset();
  gear_.reset(state.rotor_angle_rad, state.gear_angle_rad);
  spring_.reset(state.gear_angle_rad - state.joint_angle_rad);
  bearing_.reset();
}

void Plant::reset(double joint_angle_rad, const Load& load) noexcept {
  const double torque_Nm =
      load.is_locked ? 0.0 : load.gravity_Nm * std::sin(joint_angle_rad) - load.external_torque_Nm;
  PlantState rest{.joint_angle_rad = joint_angle_rad};
  rest.gear_angle_rad = joint_angle_rad + spring_.elastic().deflection(torque_Nm);
  const double unloaded_rad = rest.gear_angle_rad + torque_Nm / parameters_.gear.stiffness_Nm_rad;
  // The kinematic error is far flatter than the gear's own slope: this contracts.
  rest.rotor_angle_rad = parameters_.gear.ratio * unloaded_rad;
  for (int i = 0; i < 20; ++i) {
    const double error_rad = gear_.kinematics(rest.rotor_angle_rad).angle_rad - unloaded_rad;
    rest.rotor_angle_rad -= parameters_.gear.ratio * error_rad;
  }
  reset(rest);
  const double rotor_torque_Nm = torque_Nm * gear_.kinematics(rest.rotor_angle_rad).slope;
  motor_.reset(rotor_torque_Nm / parameters_.motor.torque_constant_Nm_A);
  torques_ = {.motor_Nm = rotor_torque_Nm,
              .gear_Nm = torque_Nm,
              .gear_on_rotor_Nm = rotor_torque_Nm,
              .spring_Nm = torque_Nm,
              .joint_Nm = torque_Nm};
}

Fault Plant::step(const PlantCommand& command, const Load& load, double dt_s) noexcept {
  if (!is_usable(command, load, dt_s, kMostSmallSteps * longest_step_s_))
    return Fault::input_not_finite;
  if (dt_s != asked_dt_s_) set_period(dt_s);
  for (std::size_t i = 0; i < small_steps_; ++i) small_step(command, load);
  return Fault::none;
}

void Plant::small_step(const PlantCommand& command, const Load& load) noexcept {
  PlantState& s = state_;
  const double dt = dt_s_;

  torques_.motor_Nm = motor_.step(command.current_A, s.rotor_angle_rad, s.rotor_speed_rad_s);
  torques_.spring_Nm =
      spring_.step(s.gear_angle_rad - s.joint_angle_rad, s.gear_speed_rad_s - s.joint_speed_rad_s);
  const Gear::Output gear =
      gear_.step(s.rotor_angle_rad, s.rotor_speed_rad_s, s.gear_angle_rad, s.gear_speed_rad_s);
  torques_.gear_Nm = gear.torque_Nm;
  torques_.gear_on_rotor_Nm = gear.rotor_torque_Nm;
  torques_.motor_friction_Nm = motor_friction_.step(s.rotor_speed_rad_s, gear.torque_Nm, dt);
  torques_.bearing_Nm = bearing_.step(s.joint_speed_rad_s, 0.0, dt);
  torques_.joint_Nm = torques_.spring_Nm - torques_.bearing_Nm;

  s.rotor_speed_rad_s =
      command.is_motor_held
          ? 0.0
          : s.rotor_speed_rad_s +
                dt * (torques_.motor_Nm - torques_.motor_friction_Nm - gear.rotor_torque_Nm) /
                    parameters_.rotor_inertia_kg_m2;
  s.gear_speed_rad_s += dt * (gear.torque_Nm - torques_.spring_Nm) / parameters_.gear_inertia_kg_m2;
  s.joint_speed_rad_s =
      load.is_locked
          ? 0.0
          : s.joint_speed_rad_s + dt *
                                      (torques_.joint_Nm + load.external_torque_Nm -
                                       parameters_.joint_viscous_Nms_rad * s.joint_speed_rad_s -
                                       load.gravity_Nm * std::sin(s.joint_angle_rad)) /
                                      (parameters_.output_inertia_kg_m2 + load.inertia_kg_m2);

  s.rotor_angle_rad += dt * s.rotor_speed_rad_s;
  s.gear_angle_rad += dt * s.gear_speed_rad_s;
  s.joint_angle_rad += dt * s.joint_speed_rad_s;
}

}  // namespace torsio
