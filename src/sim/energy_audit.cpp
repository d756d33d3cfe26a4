#include "torsio/sim/energy_audit.hpp"

#include <cmath>

namespace torsio {
namespace {

double twist(const Plant& plant) {
  const PlantState& state = plant.state();
  return plant.gear().kinematics(state.rotor_angle_rad).angle_rad - state.gear_angle_rad;
}

double half_square(double value) { return 0.5 * value * value; }

}  // namespace

EnergyAudit::EnergyAudit(const Plant& plant, const Load& load)
    : last_(plant.state()), last_twist_rad_(twist(plant)) {
  const Stored stored = stored_in(plant, load);
  first_stored_J_ = stored_J_ = stored.all_J;
  first_slip_stored_J_ = slip_stored_J_ = stored.slip_J;
}

EnergyAudit::Stored EnergyAudit::stored_in(const Plant& plant, const Load& load) noexcept {
  const PlantParameters& parts = plant.parameters();
  const PlantState& state = plant.state();
  const double slip_J = plant.spring().friction_energy() + plant.gear().hysteresis_energy();
  const double kinetic_J =
      parts.rotor_inertia_kg_m2 * half_square(state.rotor_speed_rad_s) +
      parts.gear_inertia_kg_m2 * half_square(state.gear_speed_rad_s) +
      (parts.output_inertia_kg_m2 + load.inertia_kg_m2) * half_square(state.joint_speed_rad_s);
  const double elastic_J =
      plant.spring().elastic().energy(state.gear_angle_rad - state.joint_angle_rad) +
      parts.gear.stiffness_Nm_rad * half_square(twist(plant));
  const double gravity_J = load.gravity_Nm * (1.0 - std::cos(state.joint_angle_rad));
  return {.all_J = kinetic_J + elastic_J + gravity_J + slip_J, .slip_J = slip_J};
}

void EnergyAudit::observe(const Plant& plant, const Load& load, double dt_s) noexcept {
  const PlantState& now = plant.state();
  const PlantTorques& torques = plant.torques();
  // A constant torque over the step works through the mean of the speeds before and after.
  const double rotor_rad = 0.5 * dt_s * (last_.rotor_speed_rad_s + now.rotor_speed_rad_s);
  const double joint_rad = 0.5 * dt_s * (last_.joint_speed_rad_s + now.joint_speed_rad_s);
  const double gear_rad = 0.5 * dt_s * (last_.gear_speed_rad_s + now.gear_speed_rad_s);
  const double deflection_rad = gear_rad - joint_rad;
  const double twist_rad = twist(plant);
  const double twisted_rad = twist_rad - last_twist_rad_;

  const double input_J = torques.motor_Nm * rotor_rad + load.external_torque_Nm * joint_rad;
  input_J_ += input_J;
  throughput_J_ += std::abs(input_J);
  const double deflection_rate = last_.gear_speed_rad_s - last_.joint_speed_rad_s;
  lost_J_ += torques.motor_friction_Nm * rotor_rad + torques.bearing_Nm * joint_rad +
             plant.parameters().joint_viscous_Nms_rad * last_.joint_speed_rad_s * joint_rad +
             plant.spring().viscosity() * deflection_rate * deflection_rad +
             plant.parameters().gear.damping_Nms_rad * plant.gear().twist_rate() * twisted_rad;
  slip_work_J_ += plant.spring().friction_torque() * deflection_rad +
                  plant.gear().hysteresis_torque() * twisted_rad;

  const Stored stored = stored_in(plant, load);
  stored_J_ = stored.all_J;
  slip_stored_J_ = stored.slip_J;
  last_ = now;
  last_twist_rad_ = twist_rad;
}

}  // namespace torsio
