#include <cmath>

#include "sim/plant/plant.hpp"

namespace torsio {
namespace {

double wall_energy(const Load& load, double angle_rad) noexcept {
  const double depth_rad = angle_rad - load.wall_angle_rad;
  return depth_rad > 0.0 ? load.wall_stiffness_Nm_rad * half_square(depth_rad) : 0.0;
}

}  // namespace

std::array<WorkPort, Plant::kWorkPorts> Plant::work_ports(const Load& load) const noexcept {
  using enum WorkPort::Kind;
  const auto [motor, rotor_friction, middle_friction, bearing, first_damping, second_damping,
              first_hysteresis, second_hysteresis, brake] = drive_.work_ports(state_, torques_);
  const double joint = state_.joint_speed_rad_s;
  return {{
      motor,
      {input, load.external_torque_Nm, joint},
      rotor_friction,
      middle_friction,
      bearing,
      {loss, 0.0, joint, parameters().joint_viscous_Nms_rad},
      first_damping,
      second_damping,
      first_hysteresis,
      second_hysteresis,
      {hysteretic, torques_.wall_Nm, joint, 0.0, wall_energy(load, state_.joint_angle_rad)},
      brake,
  }};
}

StoredEnergy Plant::stored_energy(const Load& load) const noexcept {
  double hysteretic_J = 0.0;
  for (const WorkPort& port : work_ports(load)) hysteretic_J += port.stored_J;
  const double kinetic_J =
      drive_.kinetic_energy(state_) + (parameters().joint_inertia_kg_m2 + load.inertia_kg_m2) *
                                          half_square(state_.joint_speed_rad_s);
  const double gravity_J = load.gravity_Nm * (1.0 - std::cos(state_.joint_angle_rad));
  return {.all_J = kinetic_J + drive_.elastic_energy(state_) + gravity_J + hysteretic_J,
          .hysteretic_J = hysteretic_J};
}

}  // namespace torsio
