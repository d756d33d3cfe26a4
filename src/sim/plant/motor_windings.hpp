#pragma once

#include <complex>

#include "control/current_controller.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The currents in the windings of a brushless motor that turns at constant speed while constant
/// phase voltages are applied. In axes that do not turn, with i = i_α + j i_β,
///
///     L di/dt = v − R i − j ω_e ψ exp(j θ_e)
///
/// which is solved exactly over a step, as are the mean torque 3/2 p ψ mean(i_q) and the charge that
/// the supply delivers. Open switches: the currents are 0 (the diodes are assumed to have ended
/// them within the step).
class MotorWindings {
 public:
  struct Step {
    double torque_Nm = 0.0;     ///< mean over the step
    double electrical_J = 0.0;  ///< from the supply
    double copper_J = 0.0;      ///< heat, 3/2 R |i|² integrated
  };

  /// @throws Error if a value of the windings is not positive.
  explicit MotorWindings(const Windings& windings);

  /// @param angle_rad electrical
  void reset(const DirectQuadrature& current_A = {}, double angle_rad = 0.0) noexcept {
    current_A_ = std::complex<double>(current_A.d, current_A.q) * std::polar(1.0, angle_rad);
  }
  /// The resistance changes with the temperature of the copper. One that is not positive is ignored.
  void set_resistance(double resistance_Ohm) noexcept {
    if (resistance_Ohm > 0.0) windings_.resistance_Ohm = resistance_Ohm;
  }

  /// @param command duties of the switches, and whether they are on
  /// @param angle_rad electrical, at the beginning of the step
  /// @param speed_rad_s electrical
  Step step(const CurrentController::Output& command, double supply_V, double angle_rad,
            double speed_rad_s, double dt_s) noexcept;

  /// @returns i_d + j i_q at this electrical angle
  [[nodiscard]] DirectQuadrature current(double angle_rad) const noexcept;
  [[nodiscard]] double stored_J() const noexcept;

 private:
  Windings windings_;
  std::complex<double> current_A_;  ///< i_α + j i_β
};

}  // namespace torsio
