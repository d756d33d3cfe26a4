#include "turned_sensor.hpp"

#include <utility>
#include <variant>

#include "sim/plant/plant_parameters.hpp"

namespace torsio {

TurnedSensor::TurnedSensor(const DataSheet& sheet, double step_s,
                           std::optional<double> output_inertia_kg_m2)
    : train_(plant_parameters(sheet)),
      ratio_(total_ratio(plant_parameters(sheet))),
      step_s_(step_s),
      output_inertia_kg_m2_(output_inertia_kg_m2),
      state_(train_.rest(0.0, 0.0)) {
  train_.set_period(step_s);
  train_.reset(state_);
}

void TurnedSensor::step(double input_rad, double external_Nm) {
  const double rotor_rad = input_rad * ratio_;
  const double rotor_speed_rad_s = (rotor_rad - state_.rotor_angle_rad) / step_s_;
  state_.rotor_angle_rad = rotor_rad;
  state_.rotor_speed_rad_s = rotor_speed_rad_s;
  const PlantCommand held{.is_motor_held = true, .is_powered = false};
  train_.find_torques(held, state_, torques_);
  state_.rotor_speed_rad_s = 0.0;
  train_.move(held, torques_, state_);
  state_.rotor_speed_rad_s = rotor_speed_rad_s;
  if (!output_inertia_kg_m2_) return;
  state_.joint_speed_rad_s += step_s_ * (torques_.joint_Nm + external_Nm) / *output_inertia_kg_m2_;
  state_.joint_angle_rad += step_s_ * state_.joint_speed_rad_s;
}

double TurnedSensor::slip_rad() const { return std::get<SlipClutch>(train_.first()).slip(); }

double TurnedSensor::twist_rad() const { return train_.second_twist(state_); }

}  // namespace torsio
