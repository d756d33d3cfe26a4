#pragma once

#include "torsio/actuator/current_sensor.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/encoder.hpp"
#include "torsio/actuator/torque_sensor.hpp"
#include "torsio/core/random.hpp"
#include "torsio/sim/plant.hpp"

namespace torsio {

/// What the loop and the logger see at one tick.
struct Measurement {
  double motor_angle_rad = 0.0;  ///< of the rotor
  double gear_angle_rad = 0.0;
  double joint_angle_rad = 0.0;
  double motor_current_A = 0.0;
  double torque_Nm = 0.0;        ///< load cell: held between its samples, late
  bool is_torque_fresh = false;  ///< the load cell delivered at this tick
};

/// The sensors of one actuator with their noise. A tick draws the same numbers whatever the plant
/// does, so that equal seeds compare plants under equal noise.
class SensorSet {
 public:
  /// @throws Error if the loop's rate is no multiple of the load cell's.
  SensorSet(const DataSheet& sheet, double sample_rate_Hz, std::uint64_t seed);

  /// As if the load cell had been running at this torque for long. Goes on in the same noise.
  void reset(const Plant& plant) noexcept;
  Measurement step(const Plant& plant) noexcept;

 private:
  Random random_;
  Encoder motor_encoder_;
  Encoder gear_encoder_;
  Encoder joint_encoder_;
  CurrentSensor current_sensor_;
  TorqueSensor torque_sensor_;
};

}  // namespace torsio
