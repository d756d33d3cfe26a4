#include "sim/plant/plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <variant>

#include "core/checks.hpp"
#include "plant_input.hpp"
#include "stages.hpp"
#include "torsio/core/dispatch.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;

template <class Stage, class Parameters>
Stage made(const Parameters& parameters) {
  return std::visit([](const auto& of) -> Stage { return make_stage(of); }, parameters);
}

/// The obstacle's torque against the joint.
double wall_torque(const Load& load, double angle_rad, double speed_rad_s) noexcept {
  const double depth_rad = angle_rad - load.wall_angle_rad;
  if (!(depth_rad > 0.0)) return 0.0;
  return std::max(0.0,
                  load.wall_stiffness_Nm_rad * depth_rad + load.wall_damping_Nms_rad * speed_rad_s);
}

struct StepLimits {
  double stiffness_s = 0.0;
  double damping_s = 0.0;
};

StepLimits step_limits(const PlantParameters& parameters) {
  // The largest row sum of M^-1 K bounds its largest eigenvalue. The speeds are scaled so that
  // each body moves as much as the next one.
  const auto first = made<FirstStage>(parameters.first);
  const auto second = made<SecondStage>(parameters.second);
  const double load_Nm = parameters.rated_torque_Nm;
  const auto stiffness = [&](const auto& stage) { return steepest(stage, load_Nm); };
  const auto damping = [](const auto& stage) { return strongest_damping(stage); };
  const auto ratio_of = [](const auto& stage) { return ratio(stage); };
  const double first_ratio = detail::dispatch(first, ratio_of);
  const double second_ratio = detail::dispatch(second, ratio_of);
  const double first_Nm_rad = detail::dispatch(first, stiffness);
  const double second_Nm_rad = detail::dispatch(second, stiffness);
  const double rotor_Nm_rad = first_Nm_rad / (first_ratio * first_ratio) +
                              LuGreFriction(parameters.rotor_friction).steepest();
  const double middle_Nm_rad = first_Nm_rad + second_Nm_rad / (second_ratio * second_ratio) +
                               LuGreFriction(parameters.middle_friction).steepest();
  const double joint_Nm_rad = second_Nm_rad + LuGreFriction(parameters.bearing).steepest();
  const double rotor = parameters.rotor_inertia_kg_m2;
  const double middle = parameters.middle_inertia_kg_m2;
  const double joint = parameters.joint_inertia_kg_m2;
  // Off-diagonal terms couple two neighbours: sqrt(k/m1 * k/m2) each, which their sum bounds.
  const double coupled = first_Nm_rad / (first_ratio * std::sqrt(middle * rotor)) +
                         second_Nm_rad / (second_ratio * std::sqrt(middle * joint));
  const double own = std::max({rotor_Nm_rad / rotor, middle_Nm_rad / middle, joint_Nm_rad / joint});

  const double first_Nms = detail::dispatch(first, damping);
  const double second_Nms = detail::dispatch(second, damping);
  const double rates_1_s = std::max(
      {(first_Nms / (first_ratio * first_ratio) + parameters.rotor_friction.viscous_Nms_rad) /
           rotor,
       (first_Nms + second_Nms / (second_ratio * second_ratio) +
        parameters.middle_friction.viscous_Nms_rad) /
           middle,
       (second_Nms + parameters.bearing.viscous_Nms_rad + parameters.joint_viscous_Nms_rad) /
           joint});
  return {.stiffness_s = 0.25 / std::sqrt(own + coupled), .damping_s = 0.5 / rates_1_s};
}

bool is_finite(const PlantState& s) noexcept {
  return std::isfinite(s.rotor_angle_rad + s.rotor_speed_rad_s + s.middle_angle_rad +
                       s.middle_speed_rad_s + s.joint_angle_rad + s.joint_speed_rad_s);
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

Plant::Plant(const PlantParameters& parameters, double longest_step_s)
    : parameters_(parameters),
      motor_(parameters.motor),
      rotor_friction_(parameters.rotor_friction),
      first_(made<FirstStage>(parameters.first)),
      middle_friction_(parameters.middle_friction),
      second_(made<SecondStage>(parameters.second)),
      bearing_(parameters.bearing),
      longest_step_s_(longest_step_s) {
  require_positive("plant", "rotor_inertia_kg_m2", parameters.rotor_inertia_kg_m2);
  require_positive("plant", "middle_inertia_kg_m2", parameters.middle_inertia_kg_m2);
  require_positive("plant", "joint_inertia_kg_m2", parameters.joint_inertia_kg_m2);
  const StepLimits limits = step_limits(parameters);
  const double limit_s = std::min(limits.stiffness_s, limits.damping_s);
  if (longest_step_s == 0.0) longest_step_s_ = std::min(limit_s, kDefaultStep_s);
  if (!(longest_step_s_ > 0.0 && longest_step_s_ <= limit_s)) {
    const bool is_stiff = limits.stiffness_s <= limits.damping_s;
    throw Error({.place = "plant",
                 .problem = is_stiff ? "the step does not suit the stiffest mode"
                                     : "the step does not suit the strongest damping",
                 .expected = fmt::format("0 s < step <= {:.3g} s", limit_s),
                 .found = fmt::format("{:.3g} s", longest_step_s_),
                 .advice = is_stiff ? "shorten the step, or soften the stiffest spring"
                                    : "shorten the step, or lower the viscous terms"});
  }
  stiffest_stop_Nm_rad_ = stiffest_stop(parameters, longest_step_s_);
  reset();
}

void Plant::use(const Brake::Parameters& brake) {
  const Brake made(brake);
  const double longest_s = 0.25 / std::sqrt(made.steepest() / parameters_.rotor_inertia_kg_m2);
  if (!(longest_step_s_ <= longest_s))
    throw Error({.place = "plant",
                 .problem = "the bristle of the brake is too stiff for the steps",
                 .expected = fmt::format("a step of at most {:.3g} s", longest_s),
                 .found = fmt::format("{:.3g} s", longest_step_s_),
                 .advice = "Give it a larger break-away angle."});
  brake_.emplace(made);
}

double Plant::step_limit(const PlantParameters& parameters) {
  const StepLimits limits = step_limits(parameters);
  return std::min(limits.stiffness_s, limits.damping_s);
}

double Plant::stiffest_stop(const PlantParameters& parameters, double step_s) {
  const double second_ratio =
      std::visit([](const auto& of) { return ratio(make_stage(of)); }, parameters.second);
  const double middle_kg_m2 = parameters.middle_inertia_kg_m2 * second_ratio * second_ratio;
  const double joint_kg_m2 = parameters.joint_inertia_kg_m2;
  return 0.25 * middle_kg_m2 * joint_kg_m2 / ((middle_kg_m2 + joint_kg_m2) * step_s * step_s);
}

void Plant::set_period(double dt_s) noexcept {
  asked_dt_s_ = dt_s;
  small_steps_ = small_steps(dt_s, longest_step_s_);
  dt_s_ = dt_s / static_cast<double>(small_steps_);
  motor_.set_period(dt_s_);
  detail::dispatch(first_, [this](auto& stage) { set_stage_period(stage, dt_s_); });
  detail::dispatch(second_, [this](auto& stage) { set_stage_period(stage, dt_s_); });
}

Fault Plant::reset(const PlantState& state) noexcept {
  if (!is_finite(state)) return Fault::input_not_finite;
  start(state);
  return Fault::none;
}

void Plant::start(const PlantState& state) noexcept {
  state_ = state;
  torques_ = {};
  motor_.reset();
  if (electrical_) electrical_->reset();
  rotor_friction_.reset();
  if (brake_) brake_->reset(brake_->is_closed());
  middle_friction_.reset();
  detail::dispatch(first_, [&](auto& stage) {
    reset_stage(stage, state.rotor_angle_rad, state.middle_angle_rad);
  });
  detail::dispatch(second_, [&](auto& stage) {
    reset_stage(stage, state.middle_angle_rad, state.joint_angle_rad);
  });
  bearing_.reset();
}

Fault Plant::reset(double joint_angle_rad, const Load& load) noexcept {
  if (!std::isfinite(joint_angle_rad) || !is_usable({}, load)) return Fault::input_not_finite;
  const double torque_Nm =
      load.is_locked ? 0.0 : load.gravity_Nm * std::sin(joint_angle_rad) - load.external_torque_Nm;
  PlantState rest{.joint_angle_rad = joint_angle_rad};
  rest.middle_angle_rad = detail::dispatch(
      second_, [&](const auto& stage) { return input_angle(stage, joint_angle_rad, torque_Nm); });
  const double middle_Nm = torque_Nm * detail::dispatch(second_, [&](const auto& stage) {
                             return kinematics(stage, rest.middle_angle_rad).slope;
                           });
  rest.rotor_angle_rad = detail::dispatch(first_, [&](const auto& stage) {
    return input_angle(stage, rest.middle_angle_rad, middle_Nm);
  });
  if (!is_finite(rest)) return Fault::input_not_finite;
  start(rest);
  const double rotor_Nm = middle_Nm * detail::dispatch(first_, [&](const auto& stage) {
                            return kinematics(stage, rest.rotor_angle_rad).slope;
                          });
  const double current_A = rotor_Nm / parameters_.motor.torque_constant_Nm_A;
  motor_.reset(current_A);
  if (electrical_) electrical_->reset(current_A, rest.rotor_angle_rad);
  torques_ = {.motor_Nm = rotor_Nm,
              .first_Nm = middle_Nm,
              .first_on_rotor_Nm = rotor_Nm,
              .second_Nm = torque_Nm,
              .second_on_middle_Nm = middle_Nm,
              .joint_Nm = torque_Nm};
  return Fault::none;
}

Fault Plant::step(const PlantCommand& command, const Load& load, double dt_s) noexcept {
  if (!is_usable(dt_s, longest_step_s_) || !is_usable(command, load))
    return Fault::input_not_finite;
  if (dt_s != asked_dt_s_) set_period(dt_s);
  if (!is_soft_enough(load, parameters_.joint_inertia_kg_m2, dt_s_)) return Fault::input_not_finite;
  for (std::size_t i = 0; i < small_steps_; ++i) small_step(command, load);
  if (is_finite(state_)) return Fault::none;
  reset();
  return Fault::model_not_finite;
}

void Plant::small_step(const PlantCommand& command, const Load& load) noexcept {
  PlantState& s = state_;
  PlantTorques& t = torques_;
  const double dt = dt_s_;

  t.motor_Nm = command.is_powered
                   ? condition_.torque_constant_factor * motor_torque(command.current_A)
                   : switched_off();
  const StageTorques second = step_second();
  t.second_Nm = second.output_Nm;
  t.second_on_middle_Nm = second.input_Nm;
  const StageTorques first = detail::dispatch(first_, [&](auto& stage) {
    return step_stage(
        stage, {s.rotor_angle_rad, s.rotor_speed_rad_s, s.middle_angle_rad, s.middle_speed_rad_s});
  });
  t.first_Nm = first.output_Nm;
  t.first_on_rotor_Nm = first.input_Nm;
  t.rotor_friction_Nm =
      condition_.friction_factor * rotor_friction_.step(s.rotor_speed_rad_s, t.first_Nm, dt);
  t.middle_friction_Nm =
      condition_.friction_factor * middle_friction_.step(s.middle_speed_rad_s, t.second_Nm, dt);
  if (brake_) t.brake_Nm = brake_->step(command.brake_V, s.rotor_speed_rad_s, dt);
  t.bearing_Nm = bearing_.step(s.joint_speed_rad_s, 0.0, dt);
  t.joint_Nm = t.second_Nm - t.bearing_Nm;
  t.wall_Nm = wall_torque(load, s.joint_angle_rad, s.joint_speed_rad_s);

  const double rotor_Nm = t.motor_Nm - t.rotor_friction_Nm - t.brake_Nm - t.first_on_rotor_Nm;
  const double middle_Nm = t.first_Nm - t.middle_friction_Nm - t.second_on_middle_Nm;
  const double joint_Nm = t.joint_Nm + load.external_torque_Nm - t.wall_Nm -
                          parameters_.joint_viscous_Nms_rad * s.joint_speed_rad_s -
                          load.gravity_Nm * std::sin(s.joint_angle_rad);
  s.rotor_speed_rad_s = command.is_motor_held
                            ? 0.0
                            : s.rotor_speed_rad_s + dt * rotor_Nm / parameters_.rotor_inertia_kg_m2;
  s.middle_speed_rad_s += dt * middle_Nm / parameters_.middle_inertia_kg_m2;
  s.joint_speed_rad_s =
      load.is_locked ? 0.0
                     : s.joint_speed_rad_s +
                           dt * joint_Nm / (parameters_.joint_inertia_kg_m2 + load.inertia_kg_m2);

  s.rotor_angle_rad += dt * s.rotor_speed_rad_s;
  s.middle_angle_rad += dt * s.middle_speed_rad_s;
  s.joint_angle_rad += dt * s.joint_speed_rad_s;
}

double Plant::switched_off() noexcept {
  motor_.reset();
  if (electrical_) electrical_->switch_off(dt_s_);
  return 0.0;
}

double Plant::motor_torque(double wanted_A) noexcept {
  if (!electrical_) return motor_.step(wanted_A, state_.rotor_angle_rad, state_.rotor_speed_rad_s);
  return motor_.ripple_torque(state_.rotor_angle_rad) +
         electrical_->step(wanted_A, state_.rotor_angle_rad, state_.rotor_speed_rad_s, dt_s_);
}

StageTorques Plant::step_second() noexcept {
  const StageMotion motion{state_.middle_angle_rad, state_.middle_speed_rad_s,
                           state_.joint_angle_rad, state_.joint_speed_rad_s};
  StageTorques torques =
      detail::dispatch(second_, [&](auto& stage) { return step_stage(stage, motion); });
  if (is_sound_) return torques;
  torques.output_Nm *= condition_.second_stage_factor;
  torques.input_Nm *= condition_.second_stage_factor;
  const Gear::Kinematics moved = detail::dispatch(
      second_, [&](const auto& stage) { return kinematics(stage, motion.input_angle_rad); });
  const double twist_rad = moved.angle_rad - motion.output_angle_rad;
  const double beyond_rad = std::abs(twist_rad) - condition_.stop_twist_rad;
  if (beyond_rad > 0.0) {
    const double stop_Nm = std::copysign(condition_.stop_stiffness_Nm_rad * beyond_rad, twist_rad);
    torques.output_Nm += stop_Nm;
    torques.input_Nm += stop_Nm * moved.slope;
  }
  return torques;
}

Fault Plant::set_condition(const PlantCondition& condition) noexcept {
  const auto is_factor = [](double value) { return value >= 0.0 && value <= 1e3; };
  if (!is_factor(condition.friction_factor) || !is_factor(condition.torque_constant_factor) ||
      !is_factor(condition.second_stage_factor) || !(condition.stop_twist_rad >= 0.0) ||
      !(condition.stop_stiffness_Nm_rad >= 0.0 &&
        condition.stop_stiffness_Nm_rad <= stiffest_stop_Nm_rad_ * (1.0 + 1e-9))) {
    return Fault::input_not_finite;
  }
  condition_ = condition;
  is_sound_ = condition.second_stage_factor == 1.0 && std::isinf(condition.stop_twist_rad);
  return Fault::none;
}

}  // namespace torsio
