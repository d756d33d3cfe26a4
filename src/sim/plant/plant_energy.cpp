#include <cmath>

#include "sim/plant/plant.hpp"
#include "stages.hpp"
#include "torsio/core/dispatch.hpp"

namespace torsio {
namespace {

double half_square(double value) noexcept { return 0.5 * value * value; }

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

double wall_energy(const Load& load, double angle_rad) noexcept {
  const double depth_rad = angle_rad - load.wall_angle_rad;
  return depth_rad > 0.0 ? load.wall_stiffness_Nm_rad * half_square(depth_rad) : 0.0;
}

}  // namespace

double Plant::first_twist() const noexcept { return first_twist_of(first_, state_).angle_rad; }
double Plant::second_twist() const noexcept { return second_twist_of(second_, state_).angle_rad; }

double Plant::first_friction_torque() const noexcept {
  return detail::dispatch(first_, [](const auto& stage) { return friction_torque(stage); });
}
double Plant::second_friction_torque() const noexcept {
  return condition_.second_stage_factor *
         detail::dispatch(second_, [](const auto& stage) { return friction_torque(stage); });
}

std::array<WorkPort, Plant::kWorkPorts> Plant::work_ports(const Load& load) const noexcept {
  using enum WorkPort::Kind;
  const auto damping = [](const auto& stage) { return viscosity(stage); };
  const auto stored = [](const auto& stage) { return friction_energy(stage); };
  const Twist first = first_twist_of(first_, state_);
  const Twist second = second_twist_of(second_, state_);
  const double rotor = state_.rotor_speed_rad_s;
  const double joint = state_.joint_speed_rad_s;
  return {{
      {input, torques_.motor_Nm, rotor},
      {input, load.external_torque_Nm, joint},
      {hysteretic, torques_.rotor_friction_Nm, rotor, 0.0, rotor_friction_.energy()},
      {hysteretic, torques_.middle_friction_Nm, state_.middle_speed_rad_s, 0.0,
       middle_friction_.energy()},
      {hysteretic, torques_.bearing_Nm, joint, 0.0, bearing_.energy()},
      {loss, 0.0, joint, parameters_.joint_viscous_Nms_rad},
      {loss, 0.0, first.rate_rad_s, detail::dispatch(first_, damping)},
      {loss, 0.0, second.rate_rad_s, detail::dispatch(second_, damping)},
      {hysteretic, first_friction_torque(), first.rate_rad_s, 0.0,
       detail::dispatch(first_, stored)},
      {hysteretic, second_friction_torque(), second.rate_rad_s, 0.0,
       detail::dispatch(second_, stored)},
      {hysteretic, torques_.wall_Nm, joint, 0.0, wall_energy(load, state_.joint_angle_rad)},
      {hysteretic, torques_.brake_Nm, rotor, 0.0, brake_ ? brake_->energy() : 0.0},
  }};
}

StoredEnergy Plant::stored_energy(const Load& load) const noexcept {
  double hysteretic_J = 0.0;
  for (const WorkPort& port : work_ports(load)) hysteretic_J += port.stored_J;
  const double kinetic_J =
      parameters_.rotor_inertia_kg_m2 * half_square(state_.rotor_speed_rad_s) +
      parameters_.middle_inertia_kg_m2 * half_square(state_.middle_speed_rad_s) +
      (parameters_.joint_inertia_kg_m2 + load.inertia_kg_m2) *
          half_square(state_.joint_speed_rad_s);
  const auto elastic = [](double twist_rad) {
    return [twist_rad](const auto& stage) { return elastic_energy(stage, twist_rad); };
  };
  const double elastic_J = detail::dispatch(first_, elastic(first_twist())) +
                           detail::dispatch(second_, elastic(second_twist()));
  const double gravity_J = load.gravity_Nm * (1.0 - std::cos(state_.joint_angle_rad));
  return {.all_J = kinetic_J + elastic_J + gravity_J + hysteretic_J, .hysteretic_J = hysteretic_J};
}

}  // namespace torsio
