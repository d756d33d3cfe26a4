#pragma once

#include <optional>

#include "sim/plant/drive_train.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// The rubber torque sensor of paper 002, whose input is where it is put.
class TurnedSensor {
 public:
  /// @param output_inertia_kg_m2 of an output that is free to turn; none: it is clamped
  TurnedSensor(const DataSheet& sheet, double step_s, std::optional<double> output_inertia_kg_m2);

  /// Turns the input to this angle within one step. A free output is moved by the torque of the sensor and this one:
  ///
  ///     J q'' = tau + tau_ext
  void step(double input_rad, double external_Nm = 0.0);

  [[nodiscard]] double torque_Nm() const noexcept { return torques_.joint_Nm; }
  [[nodiscard]] double output_rad() const noexcept { return state_.joint_angle_rad; }
  [[nodiscard]] double output_speed_rad_s() const noexcept { return state_.joint_speed_rad_s; }
  [[nodiscard]] double slip_rad() const;   ///< slip of the clutch
  [[nodiscard]] double twist_rad() const;  ///< twist of the rubber

 private:
  DriveTrain train_;
  double ratio_;
  double step_s_;
  std::optional<double> output_inertia_kg_m2_;
  PlantState state_;
  PlantTorques torques_;
};

}  // namespace torsio
