#pragma once

#include <optional>

#include "parts/current_sensor.hpp"
#include "parts/encoder.hpp"
#include "parts/torque_sensor.hpp"
#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/random.hpp"

namespace torsio {

/// The rate of the benches' loops; a logger may be slower.
constexpr double kBenchRate_Hz = 1000.0;

/// The signals of the loop and the log at one tick.
struct Measurement {
  double motor_angle_rad = 0.0;   ///< angle of the rotor
  double middle_angle_rad = 0.0;  ///< angle of the body between the stages
  double joint_angle_rad = 0.0;
  double twist_rad = 0.0;  ///< twist of the second stage, if it has a sensor
  double motor_current_A = 0.0;
  // With an electrical drive: what its sensors measure.
  double phase_a_current_A = 0.0;
  double phase_b_current_A = 0.0;
  double supply_current_A = 0.0;
  double stator_temperature_K = 0.0;
  double torque_Nm = 0.0;  ///< load cell: held between its samples, delayed
  // Whether the sensor delivered at this tick; where not, its last value is held.
  bool is_motor_angle_fresh = true;
  bool is_middle_angle_fresh = true;
  bool is_joint_angle_fresh = true;
  bool is_twist_fresh = true;
  bool is_motor_current_fresh = true;
  bool is_drive_fresh = true;
  bool is_torque_fresh = false;
};

/// What the sensors of an actuator read of its plant.
struct SensedPlant {
  PlantState state;
  double second_twist_rad = 0.0;
  double current_A = 0.0;
  const ElectricalDrive* electrical = nullptr;  ///< null: none
};
[[nodiscard]] SensedPlant sensed(const Plant& plant) noexcept;

/// The sensors of one actuator with their noise. A tick draws the same numbers whatever the plant
/// does, so that equal seeds compare plants under equal noise.
class SensorSet {
 public:
  /// @throws Error if the loop's rate is not a multiple of the load cell's.
  SensorSet(const DataSheet& sheet, double sample_rate_Hz, std::uint64_t seed);

  /// Sets the load cell to the steady state at this torque. The noise sequence continues.
  void reset(double torque_Nm) noexcept;
  /// @param torque_Nm torque at the load cell
  Measurement step(const SensedPlant& plant, double torque_Nm) noexcept;

 private:
  Random random_;
  Encoder motor_encoder_;
  Encoder middle_encoder_;
  Encoder joint_encoder_;
  std::optional<Encoder> twist_sensor_;
  CurrentSensor current_sensor_;
  TorqueSensor torque_sensor_;
};

}  // namespace torsio
