#include "sim/plant/drive_train.hpp"

#include <fmt/format.h>

#include <cmath>
#include <variant>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlant = "plant";

template <class Stage, class Parameters>
Stage made(const Parameters& parameters) {
  return std::visit([](const auto& of) -> Stage { return make_stage(of); }, parameters);
}

struct Twist {
  double angle_rad = 0.0;
  double rate_rad_s = 0.0;
};

template <class Stage>
Twist twist(const Stage& stage, double input_rad, double input_rad_s, double output_rad,
            double output_rad_s) noexcept {
  const Gear::Kinematics moved =
      detail::dispatch(stage, [&](const auto& of) { return kinematics(of, input_rad); });
  return {moved.angle_rad - output_rad, moved.slope * input_rad_s - output_rad_s};
}
Twist first_twist_of(const FirstStage& stage, const PlantState& s) noexcept {
  return twist(stage, s.rotor_angle_rad, s.rotor_speed_rad_s, s.middle_angle_rad,
               s.middle_speed_rad_s);
}
Twist second_twist_of(const SecondStage& stage, const PlantState& s) noexcept {
  return twist(stage, s.middle_angle_rad, s.middle_speed_rad_s, s.joint_angle_rad,
               s.joint_speed_rad_s);
}

template <class Stage>
double slope_at(const Stage& stage, double input_rad) noexcept {
  return detail::dispatch(stage, [&](const auto& of) { return kinematics(of, input_rad).slope; });
}

void require_no_slip(const PlantParameters& parameters) {
  if (!std::holds_alternative<SlipClutch::Parameters>(parameters.first)) return;
  throw Error({.place = kPlant,
               .problem = "a slip clutch is not rigid",
               .expected = "a gear as the first stage",
               .found = "a slip clutch",
               .advice = "simulate this actuator with its elastic first stage"});
}

}  // namespace

DriveTrain::DriveTrain(const PlantParameters& parameters, FirstStageForm form)
    : parameters_(parameters),
      is_rigid_(form == FirstStageForm::rigid),
      ratio_(std::visit([](const auto& of) { return of.ratio; }, parameters.first)),
      middle_inertia_kg_m2_(parameters.middle_inertia_kg_m2),
      motor_(parameters.motor),
      rotor_friction_(parameters.rotor_friction),
      first_(made<FirstStage>(parameters.first)),
      middle_friction_(parameters.middle_friction),
      second_(made<SecondStage>(parameters.second)),
      bearing_(parameters.bearing) {
  require_positive(kPlant, "rotor_inertia_kg_m2", parameters.rotor_inertia_kg_m2);
  require_positive(kPlant, "middle_inertia_kg_m2", parameters.middle_inertia_kg_m2);
  if (!is_rigid_) return;
  require_no_slip(parameters);
  middle_inertia_kg_m2_ += parameters.rotor_inertia_kg_m2 * ratio_ * ratio_;
}

double DriveTrain::stiffest_stop(double joint_inertia_kg_m2, double step_s) const noexcept {
  const double second_ratio =
      detail::dispatch(second_, [](const auto& stage) { return ratio(stage); });
  const double middle_kg_m2 = middle_inertia_kg_m2_ * second_ratio * second_ratio;
  return 0.25 * middle_kg_m2 * joint_inertia_kg_m2 /
         ((middle_kg_m2 + joint_inertia_kg_m2) * step_s * step_s);
}

void DriveTrain::use(const Brake::Parameters& brake, double longest_step_s) {
  const Brake made(brake);
  const double longest_s = 0.25 / std::sqrt(made.steepest() / parameters_.rotor_inertia_kg_m2);
  if (!(longest_step_s <= longest_s))
    throw Error({.place = kPlant,
                 .problem = "the bristle of the brake is too stiff for the steps",
                 .expected = fmt::format("a step of at most {:.3g} s", longest_s),
                 .found = fmt::format("{:.3g} s", longest_step_s),
                 .advice = "Give it a larger break-away angle."});
  brake_.emplace(made);
}

Fault DriveTrain::set_condition(const PlantCondition& condition,
                                double stiffest_stop_Nm_rad) noexcept {
  const auto is_factor = [](double value) { return value >= 0.0 && value <= 1e3; };
  if (!is_factor(condition.friction_factor) || !is_factor(condition.torque_constant_factor) ||
      !is_factor(condition.second_stage_factor) || !(condition.stop_twist_rad >= 0.0) ||
      !(condition.stop_stiffness_Nm_rad >= 0.0 &&
        condition.stop_stiffness_Nm_rad <= stiffest_stop_Nm_rad * (1.0 + 1e-9))) {
    return Fault::input_not_finite;
  }
  condition_ = condition;
  is_sound_ = condition.second_stage_factor == 1.0 && std::isinf(condition.stop_twist_rad);
  return Fault::none;
}

void DriveTrain::set_period(double dt_s) noexcept {
  dt_s_ = dt_s;
  motor_.set_period(dt_s);
  detail::dispatch(first_, [&](auto& stage) { set_stage_period(stage, dt_s); });
  detail::dispatch(second_, [&](auto& stage) { set_stage_period(stage, dt_s); });
}

PlantState DriveTrain::rest(double joint_angle_rad, double torque_Nm) const noexcept {
  PlantState rest{.joint_angle_rad = joint_angle_rad};
  rest.middle_angle_rad = detail::dispatch(
      second_, [&](const auto& stage) { return input_angle(stage, joint_angle_rad, torque_Nm); });
  if (is_rigid_) {
    align_rotor(rest);
    return rest;
  }
  const double middle_Nm = torque_Nm * slope_at(second_, rest.middle_angle_rad);
  rest.rotor_angle_rad = detail::dispatch(first_, [&](const auto& stage) {
    return input_angle(stage, rest.middle_angle_rad, middle_Nm);
  });
  return rest;
}

void DriveTrain::reset(PlantState& state) noexcept {
  if (is_rigid_) align_rotor(state);
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

PlantTorques DriveTrain::reset_at_rest(PlantState& rest, double torque_Nm) noexcept {
  reset(rest);
  const double middle_Nm = torque_Nm * slope_at(second_, rest.middle_angle_rad);
  const double rotor_Nm =
      is_rigid_ ? middle_Nm / ratio_ : middle_Nm * slope_at(first_, rest.rotor_angle_rad);
  const double current_A = rotor_Nm / parameters_.motor.torque_constant_Nm_A;
  motor_.reset(current_A);
  if (electrical_) electrical_->reset(current_A, rest.rotor_angle_rad);
  return {.motor_Nm = rotor_Nm,
          .first_Nm = middle_Nm,
          .first_on_rotor_Nm = rotor_Nm,
          .second_Nm = torque_Nm,
          .second_on_middle_Nm = middle_Nm,
          .joint_Nm = torque_Nm};
}

double DriveTrain::electrical_torque(double wanted_A, const PlantState& state) noexcept {
  return motor_.ripple_torque(state.rotor_angle_rad) +
         electrical_->step(wanted_A, state.rotor_angle_rad, state.rotor_speed_rad_s, dt_s_);
}

double DriveTrain::switched_off() noexcept {
  motor_.reset();
  if (electrical_) electrical_->switch_off(dt_s_);
  return 0.0;
}

StageTorques DriveTrain::with_condition(StageTorques torques,
                                        const StageMotion& motion) const noexcept {
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

double DriveTrain::first_twist(const PlantState& state) const noexcept {
  return is_rigid_ ? 0.0 : first_twist_of(first_, state).angle_rad;
}
double DriveTrain::second_twist(const PlantState& state) const noexcept {
  return second_twist_of(second_, state).angle_rad;
}

double DriveTrain::first_friction_torque() const noexcept {
  return detail::dispatch(first_, [](const auto& stage) { return friction_torque(stage); });
}
double DriveTrain::second_friction_torque() const noexcept {
  return condition_.second_stage_factor *
         detail::dispatch(second_, [](const auto& stage) { return friction_torque(stage); });
}

std::array<WorkPort, DriveTrain::kWorkPorts> DriveTrain::work_ports(
    const PlantState& state, const PlantTorques& torques) const noexcept {
  using enum WorkPort::Kind;
  const auto damping = [](const auto& stage) { return viscosity(stage); };
  const auto stored = [](const auto& stage) { return friction_energy(stage); };
  const Twist first = is_rigid_ ? Twist{} : first_twist_of(first_, state);
  const Twist second = second_twist_of(second_, state);
  const double rotor = state.rotor_speed_rad_s;
  return {{
      {input, torques.motor_Nm, rotor},
      {hysteretic, torques.rotor_friction_Nm, rotor, 0.0, rotor_friction_.energy()},
      {hysteretic, torques.middle_friction_Nm, state.middle_speed_rad_s, 0.0,
       middle_friction_.energy()},
      {hysteretic, torques.bearing_Nm, state.joint_speed_rad_s, 0.0, bearing_.energy()},
      {loss, 0.0, first.rate_rad_s, detail::dispatch(first_, damping)},
      {loss, 0.0, second.rate_rad_s, detail::dispatch(second_, damping)},
      {hysteretic, first_friction_torque(), first.rate_rad_s, 0.0,
       detail::dispatch(first_, stored)},
      {hysteretic, second_friction_torque(), second.rate_rad_s, 0.0,
       detail::dispatch(second_, stored)},
      {hysteretic, torques.brake_Nm, rotor, 0.0, brake_ ? brake_->energy() : 0.0},
  }};
}

double DriveTrain::kinetic_energy(const PlantState& state) const noexcept {
  return parameters_.rotor_inertia_kg_m2 * half_square(state.rotor_speed_rad_s) +
         parameters_.middle_inertia_kg_m2 * half_square(state.middle_speed_rad_s);
}

double DriveTrain::elastic_energy(const PlantState& state) const noexcept {
  const auto elastic = [](double twist_rad) {
    return [twist_rad](const auto& stage) { return torsio::elastic_energy(stage, twist_rad); };
  };
  return detail::dispatch(first_, elastic(first_twist(state))) +
         detail::dispatch(second_, elastic(second_twist(state)));
}

}  // namespace torsio
