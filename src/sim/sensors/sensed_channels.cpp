#include "sim/sensors/sensed_channels.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data/names.hpp"
#include "sim/plant/plant.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

SensedChannel motor_angle(std::string_view name, double scale = 1.0) {
  return {name, &Measurement::motor_angle_rad, &Measurement::is_motor_angle_fresh, scale};
}
SensedChannel middle_angle(std::string_view name) {
  return {name, &Measurement::middle_angle_rad, &Measurement::is_middle_angle_fresh};
}
SensedChannel motor_current(std::string_view name, double scale = 1.0) {
  return {name, &Measurement::motor_current_A, &Measurement::is_motor_current_fresh, scale};
}

SensedChannel drive_channel(std::string_view name, double Measurement::*value) {
  return {name, value, &Measurement::is_drive_fresh};
}

constexpr SensedChannel kJointAngle{"joint_angle_rad", &Measurement::joint_angle_rad,
                                    &Measurement::is_joint_angle_fresh};
constexpr SensedChannel kTwist{"spring_deflection_rad", &Measurement::twist_rad,
                               &Measurement::is_twist_fresh};
constexpr SensedChannel kTorque{"torque_Nm", &Measurement::torque_Nm,
                                &Measurement::is_torque_fresh};

std::vector<SensedChannel> mechanical_channels(const DataSheet& sheet) {
  switch (sheet.family) {
    case ActuatorFamily::series_elastic: break;
    case ActuatorFamily::elastomer:
      return {motor_angle("motor_angle_rad"), kTwist, motor_current("motor_current_A"), kTorque};
    case ActuatorFamily::rubber_clutch:
      return {motor_angle("input_angle_rad", 1.0 / total_ratio(plant_parameters(sheet))),
              kJointAngle, motor_current("motor_current_A"), kTorque};
    case ActuatorFamily::harmonic_drive:
      return {motor_angle("motor_angle_rad"), middle_angle("wave_generator_angle_rad"), kJointAngle,
              motor_current("motor_torque_Nm", sheet.motor.torque_constant_Nm_A.value), kTorque};
  }
  return {motor_angle("motor_angle_rad"), middle_angle("gear_angle_rad"), kJointAngle,
          motor_current("motor_current_A"), kTorque};
}

}  // namespace

std::vector<SensedChannel> sensed_channels(const DataSheet& sheet, bool is_electrical) {
  std::vector<SensedChannel> channels = mechanical_channels(sheet);
  if (is_electrical)
    channels.insert(channels.end() - 1,
                    {drive_channel("phase_a_current_A", &Measurement::phase_a_current_A),
                     drive_channel("phase_b_current_A", &Measurement::phase_b_current_A),
                     drive_channel("supply_current_A", &Measurement::supply_current_A),
                     drive_channel("stator_temperature_K", &Measurement::stator_temperature_K)});
  return channels;
}

std::vector<SensedChannel> sensed_inputs(const DataSheet& sheet,
                                         const std::vector<std::string>& names,
                                         std::string_view place, bool is_electrical) {
  const std::vector<SensedChannel> channels = sensed_channels(sheet, is_electrical);
  std::vector<SensedChannel> inputs;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(channels, name, &SensedChannel::name);
    if (found == channels.end()) {
      std::vector<std::string> known;
      known.reserve(channels.size());
      for (const SensedChannel& channel : channels) known.emplace_back(channel.name);
      throw Error({.place = fmt::format("{} of {}", place, sheet.name),
                   .expected = "inputs that its sensors measure: " + joined(known),
                   .found = fmt::format("'{}'", printable(name))});
    }
    inputs.push_back(*found);
  }
  return inputs;
}

}  // namespace torsio
