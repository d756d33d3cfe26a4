#include "torsio/sim/sensor_set.hpp"

namespace torsio {
namespace {

Encoder::Parameters encoder_of(const DataSheet& sheet) {
  return {.bits = sheet.encoder_bits.value, .jitter_lsb = sheet.encoder_jitter_lsb.value};
}

}  // namespace

SensorSet::SensorSet(const DataSheet& sheet, double sample_rate_Hz, std::uint64_t seed)
    : random_(seed),
      motor_encoder_(encoder_of(sheet), random_),
      gear_encoder_(encoder_of(sheet), random_),
      joint_encoder_(encoder_of(sheet), random_),
      current_sensor_({.noise_A = sheet.current_noise_A.value}),
      torque_sensor_({.noise_Nm = sheet.torque_noise_share.value * sheet.torque_range_Nm.value,
                      .sample_rate_Hz = sheet.torque_rate_Hz.value,
                      .latency_s = sheet.torque_latency_s.value},
                     1.0 / sample_rate_Hz) {}

void SensorSet::reset(const Plant& plant) noexcept {
  torque_sensor_.reset(plant.torques().joint_Nm, random_);
}

Measurement SensorSet::step(const Plant& plant) noexcept {
  const PlantState& state = plant.state();
  Measurement measured;
  measured.motor_angle_rad = motor_encoder_.read(state.rotor_angle_rad, random_);
  measured.gear_angle_rad = gear_encoder_.read(state.gear_angle_rad, random_);
  measured.joint_angle_rad = joint_encoder_.read(state.joint_angle_rad, random_);
  measured.motor_current_A = current_sensor_.read(plant.current(), random_);
  const TorqueSensor::Reading cell = torque_sensor_.step(plant.torques().joint_Nm, random_);
  measured.torque_Nm = cell.torque_Nm;
  measured.is_torque_fresh = cell.is_fresh;
  return measured;
}

}  // namespace torsio
