#include "bench_log.hpp"

#include <fmt/format.h>

#include <utility>
#include <variant>

namespace torsio {
namespace {

struct StageNames {
  std::string_view first;
  std::string_view second;
};

StageNames stage_names(ActuatorFamily family) {
  switch (family) {
    case ActuatorFamily::series_elastic: break;
    case ActuatorFamily::elastomer: return {"gear", "coupling"};
    case ActuatorFamily::rubber_clutch: return {"clutch", "rubber"};
    case ActuatorFamily::harmonic_drive: return {"tube", "gear"};
  }
  return {"gear", "spring"};
}

}  // namespace

BenchLog::BenchLog(const DataSheet& sheet, std::size_t samples, bool with_truth)
    : rate_Hz_(sheet.sensors.log_rate_Hz.value) {
  add_sensed_channels(sheet);
  if (with_truth) add_truth_channels(sheet);
  for (Sensed& of : sensed_) of.channel.values.reserve(samples);
  for (Truth& of : truth_) of.channel.values.reserve(samples);
  fresh_.reserve(samples);
}

void BenchLog::sense(std::string name, double Measurement::*value, double scale) {
  sensed_.push_back({{std::move(name), {}}, value, scale});
}

void BenchLog::tell(std::string_view name, double (*value)(const Plant& plant)) {
  truth_.push_back({{fmt::format("truth_{}", name), {}}, value});
}

void BenchLog::add_sensed_channels(const DataSheet& sheet) {
  switch (sheet.family) {
    case ActuatorFamily::series_elastic:
      sense("motor_angle_rad", &Measurement::motor_angle_rad);
      sense("gear_angle_rad", &Measurement::middle_angle_rad);
      sense("joint_angle_rad", &Measurement::joint_angle_rad);
      sense("motor_current_A", &Measurement::motor_current_A);
      break;
    case ActuatorFamily::elastomer:
      sense("motor_angle_rad", &Measurement::motor_angle_rad);
      sense("spring_deflection_rad", &Measurement::twist_rad);
      sense("motor_current_A", &Measurement::motor_current_A);
      break;
    case ActuatorFamily::rubber_clutch:
      sense("input_angle_rad", &Measurement::motor_angle_rad,
            1.0 / total_ratio(plant_parameters(sheet)));
      sense("joint_angle_rad", &Measurement::joint_angle_rad);
      sense("motor_current_A", &Measurement::motor_current_A);
      break;
    case ActuatorFamily::harmonic_drive:
      sense("motor_angle_rad", &Measurement::motor_angle_rad);
      sense("wave_generator_angle_rad", &Measurement::middle_angle_rad);
      sense("joint_angle_rad", &Measurement::joint_angle_rad);
      sense("motor_torque_Nm", &Measurement::motor_current_A,
            sheet.motor.torque_constant_Nm_A.value);
      break;
  }
  sense("torque_Nm", &Measurement::torque_Nm);
}

void BenchLog::add_truth_channels(const DataSheet& sheet) {
  const StageNames names = stage_names(sheet.family);
  const auto first = [&](const char* what) { return fmt::format("{}_{}", names.first, what); };
  const auto second = [&](const char* what) { return fmt::format("{}_{}", names.second, what); };
  tell(second("torque_Nm"), [](const Plant& plant) { return plant.torques().second_Nm; });
  tell(second("friction_Nm"), [](const Plant& plant) { return plant.second_friction_torque(); });
  tell(second("deflection_rad"), [](const Plant& plant) { return plant.second_twist(); });
  tell(first("torque_Nm"), [](const Plant& plant) { return plant.torques().first_Nm; });
  tell(first("friction_Nm"), [](const Plant& plant) { return plant.first_friction_torque(); });
  tell(first("deflection_rad"), [](const Plant& plant) { return plant.first_twist(); });
  tell("motor_torque_Nm", [](const Plant& plant) { return plant.torques().motor_Nm; });
  tell("motor_friction_Nm", [](const Plant& plant) { return plant.torques().rotor_friction_Nm; });
  if (sheet.family == ActuatorFamily::harmonic_drive) {
    tell("wave_generator_friction_Nm",
         [](const Plant& plant) { return plant.torques().middle_friction_Nm; });
  }
  tell("motor_speed_rad_s", [](const Plant& plant) { return plant.state().rotor_speed_rad_s; });
  tell("joint_speed_rad_s", [](const Plant& plant) { return plant.state().joint_speed_rad_s; });
}

void BenchLog::add(const Measurement& measured, bool is_torque_fresh, const Plant& plant,
                   double torque_Nm) {
  for (Sensed& of : sensed_) of.channel.values.push_back(of.scale * measured.*of.value);
  fresh_.push_back(is_torque_fresh ? 1 : 0);
  if (truth_.empty()) return;
  truth_torque_Nm_.push_back(torque_Nm);
  for (Truth& of : truth_) of.channel.values.push_back(of.value(plant));
}

Recording BenchLog::finish(std::string name) {
  Recording recording(std::move(name), rate_Hz_);
  sensed_.back().channel.fresh = std::move(fresh_);
  for (Sensed& of : sensed_) recording.add(std::move(of.channel));
  if (!truth_.empty()) recording.add({"truth_torque_Nm", std::move(truth_torque_Nm_)});
  for (Truth& of : truth_) recording.add(std::move(of.channel));
  return recording;
}

}  // namespace torsio
