#pragma once

#include <cstdint>

#include "control/current_controller.hpp"
#include "control/temperature_derating.hpp"
#include "sim/plant/motor_windings.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Errors of the current sensors in two phases; the third current is computed from these two.
struct PhaseSensors {
  double offset_a_A = 0.0;
  double offset_b_A = 0.0;
  double gain_error_a = 0.0;  ///< share
  double gain_error_b = 0.0;
  double noise_A = 0.0;  ///< standard deviation of a sample
};

/// Heat from the copper through the stator to the surroundings.
struct MotorThermal {
  double copper_J_K = 0.0;  ///< heat capacity
  double stator_J_K = 0.0;
  double copper_stator_K_W = 0.0;  ///< thermal resistance
  double stator_ambient_K_W = 0.0;
};

/// A brushless motor with its inverter and field-oriented current control, sub-stepped with the
/// period of the pulse-width modulation. It can replace `Motor` in a plant.
///
/// A voltage is computed from the currents at the beginning of a period and applied in the next one.
/// The inverter is ideal: no dead time, no ripple at the frequency of the modulation.
///
///     C_c Ṫ_c = P − (T_c − T_s) / R_cs,   C_s Ṫ_s = (T_c − T_s) / R_cs − (T_s − T_a) / R_sa
///     R(T_c) = R (1 + 0.00393 (T_c − 293.15 K)) of copper
///
/// An error of the commutation angle ε reduces the torque to k_t (i_q cos ε + i_d sin ε).
class ElectricalDrive {
 public:
  struct Parameters {
    CurrentController::Settings control = {};
    double pwm_Hz = 30e3;
    double supply_V = 0.0;
    PhaseSensors sensors = {};
    double commutation_error_rad = 0.0;  ///< ε, electrical: measured less true angle
    MotorThermal thermal = {};
    double ambient_K = 293.15;
    double derating_begins_K = 0.0;  ///< stator temperatures (`TemperatureDerating`)
    double derating_ends_K = 0.0;
    std::uint64_t seed = 1;
  };

  struct Energy {
    double electrical_J = 0.0;  ///< from the supply
    double mechanical_J = 0.0;  ///< to the rotor
    double copper_J = 0.0;      ///< heat
  };

  /// @throws Error if a setting of the controller is refused, or a parameter is not positive (an
  /// error of a sensor: not finite).
  explicit ElectricalDrive(const Parameters& parameters);

  /// This current i_q, and the voltage that holds it at standstill; the temperatures remain.
  void reset(double current_A = 0.0, double rotor_angle_rad = 0.0) noexcept;

  /// @param wanted_A i_q; its magnitude is limited to the peak current
  /// @param rotor_speed_rad_s constant during dt
  /// @returns the mean torque on the rotor [Nm] during dt
  double step(double wanted_A, double rotor_angle_rad, double rotor_speed_rad_s,
              double dt_s) noexcept TORSIO_REALTIME;

  /// The inverter is off for so long: no current at once (it flows back into the supply within a
  /// small part of a millisecond), and the motor cools.
  void switch_off(double dt_s) noexcept TORSIO_REALTIME;

  /// @returns i_q after the last step [A]
  [[nodiscard]] double current() const noexcept { return current_A_.q; }
  [[nodiscard]] double direct_current() const noexcept { return current_A_.d; }
  /// The latest output of the controller, which is applied in the next period.
  [[nodiscard]] const CurrentController::Output& command() const noexcept { return next_; }
  /// What the sensors measured at the last period.
  [[nodiscard]] const ThreePhase& measured_phases() const noexcept { return measured_A_; }
  [[nodiscard]] double supply_current_A() const noexcept { return supply_current_A_; }
  [[nodiscard]] double copper_K() const noexcept { return copper_K_; }
  [[nodiscard]] double stator_K() const noexcept { return stator_K_; }
  /// Sums since the construction.
  [[nodiscard]] const Energy& energy() const noexcept { return energy_; }
  [[nodiscard]] double stored_J() const noexcept { return windings_.stored_J(); }

 private:
  void begin_period(double wanted_A, double angle_rad, double speed_rad_s) noexcept;
  [[nodiscard]] ThreePhase measure(double angle_rad) noexcept;
  void warm(double copper_J, double dt_s) noexcept;

  Parameters parameters_;
  MotorWindings windings_;
  CurrentController controller_;
  TemperatureDerating derating_;
  Random noise_;
  CurrentController::Output present_;  ///< applied in this period
  CurrentController::Output next_;
  ThreePhase measured_A_;
  double left_s_ = 0.0;         ///< until the end of this period
  DirectQuadrature current_A_;  ///< after the last step
  double supply_current_A_ = 0.0;
  double copper_K_;
  double stator_K_;
  Energy energy_;
};

}  // namespace torsio
