#pragma once

#include <algorithm>
#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A brushless motor with a current loop, its limits and its torque ripple.
///
///     i̇ = (i_ref − i) / T_i,   |i_ref| ≤ i_max,   |R i_ref + k_e ω| ≤ U with k_e = k_t
///     τ = k_t i + r k_t i_max sin(n θ_m)
///
/// The lag is solved exactly over a step. Source: specification 4.1.
class Motor {
 public:
  struct Parameters {
    double torque_constant_Nm_A = 0.0;     ///< k_t
    double peak_current_A = 0.0;           ///< i_max
    double current_time_constant_s = 0.0;  ///< T_i
    double supply_V = 0.0;                 ///< U
    double resistance_Ohm = 0.0;           ///< R
    double ripple = 0.0;                   ///< r, share of the peak torque
    double ripple_order = 0.0;             ///< n, periods a turn
  };

  /// @throws Error if the ripple is negative or another value is not positive.
  explicit Motor(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset(double current_A = 0.0) noexcept { current_A_ = current_A; }
  /// Call before the first `step` and whenever dt changes.
  void set_period(double dt_s) noexcept;

  /// @returns the torque on the rotor [Nm] after one period
  double step(double wanted_A, double rotor_angle_rad,
              double rotor_speed_rad_s) noexcept TORSIO_REALTIME {
    const double back_emf_V = parameters_.torque_constant_Nm_A * rotor_speed_rad_s;
    const double highest_A = (parameters_.supply_V - back_emf_V) * inverse_resistance_;
    const double lowest_A = (-parameters_.supply_V - back_emf_V) * inverse_resistance_;
    double reference_A = std::min(std::max(wanted_A, lowest_A), highest_A);
    reference_A =
        std::min(std::max(reference_A, -parameters_.peak_current_A), parameters_.peak_current_A);
    current_A_ = reference_A + (current_A_ - reference_A) * decay_;
    return parameters_.torque_constant_Nm_A * current_A_ + ripple_torque(rotor_angle_rad);
  }

  /// @returns r k_t i_max sin(n θ_m) [Nm]
  [[nodiscard]] double ripple_torque(double rotor_angle_rad) const noexcept TORSIO_REALTIME {
    if (ripple_Nm_ == 0.0) return 0.0;
    return ripple_Nm_ * std::sin(parameters_.ripple_order * rotor_angle_rad);
  }

  /// @returns i [A]
  [[nodiscard]] double current() const noexcept { return current_A_; }

 private:
  Parameters parameters_;
  double inverse_resistance_;
  double ripple_Nm_;
  double decay_ = 0.0;
  double current_A_ = 0.0;
};

}  // namespace torsio
