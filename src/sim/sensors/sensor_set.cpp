#include "sim/sensors/sensor_set.hpp"

namespace torsio {
namespace {

Encoder encoder_of(const SensorSheet& sheet, const SheetValue& bits, const SheetValue& zero_rad,
                   Random& random) {
  return Encoder({.bits = bits.value,
                  .jitter_lsb = sheet.encoder_jitter_lsb.value,
                  .zero_rad = zero_rad.value},
                 random);
}

std::optional<Encoder> twist_sensor_of(const SensorSheet& sheet, Random& random) {
  if (sheet.twist_sensor_bits.value == 0.0) return {};
  return encoder_of(sheet, sheet.twist_sensor_bits, sheet.twist_zero_rad, random);
}

}  // namespace

SensorSet::SensorSet(const DataSheet& sheet, double sample_rate_Hz, std::uint64_t seed)
    : random_(seed),
      motor_encoder_(encoder_of(sheet.sensors, sheet.sensors.motor_encoder_bits,
                                sheet.sensors.motor_zero_rad, random_)),
      middle_encoder_(encoder_of(sheet.sensors, sheet.sensors.middle_encoder_bits,
                                 sheet.sensors.middle_zero_rad, random_)),
      joint_encoder_(encoder_of(sheet.sensors, sheet.sensors.joint_encoder_bits,
                                sheet.sensors.joint_zero_rad, random_)),
      twist_sensor_(twist_sensor_of(sheet.sensors, random_)),
      current_sensor_({.noise_A = sheet.sensors.current_noise_A.value}),
      torque_sensor_(
          {.noise_Nm = sheet.sensors.torque_noise_share.value * sheet.sensors.torque_range_Nm.value,
           .sample_rate_Hz = sheet.sensors.torque_rate_Hz.value,
           .latency_s = sheet.sensors.torque_latency_s.value},
          1.0 / sample_rate_Hz) {}

void SensorSet::reset(double torque_Nm) noexcept { torque_sensor_.reset(torque_Nm, random_); }

SensedPlant sensed(const Plant& plant) noexcept {
  return {.state = plant.state(),
          .second_twist_rad = plant.second_twist(),
          .current_A = plant.current(),
          .electrical = plant.electrical()};
}

Measurement SensorSet::step(const SensedPlant& plant, double torque_Nm) noexcept {
  const PlantState& state = plant.state;
  Measurement measured;
  measured.motor_angle_rad = motor_encoder_.read(state.rotor_angle_rad, random_);
  measured.middle_angle_rad = middle_encoder_.read(state.middle_angle_rad, random_);
  measured.joint_angle_rad = joint_encoder_.read(state.joint_angle_rad, random_);
  if (twist_sensor_) measured.twist_rad = twist_sensor_->read(plant.second_twist_rad, random_);
  measured.motor_current_A = current_sensor_.read(plant.current_A, random_);
  if (const ElectricalDrive* const drive = plant.electrical) {
    measured.motor_current_A = drive->command().current_A.q;
    measured.phase_a_current_A = drive->measured_phases().a;
    measured.phase_b_current_A = drive->measured_phases().b;
    measured.supply_current_A = drive->supply_current_A();
    measured.stator_temperature_K = drive->stator_K();
  }
  const TorqueSensor::Reading cell = torque_sensor_.step(torque_Nm, random_);
  measured.torque_Nm = cell.torque_Nm;
  measured.is_torque_fresh = cell.is_fresh;
  return measured;
}

}  // namespace torsio
