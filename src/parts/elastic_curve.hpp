#pragma once

#include <cmath>
#include <limits>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The elastic part of a torsion spring with play, asymmetry and an optional stiffer second stage.
///
///     x = δ − b tanh(δ / b)                                  play, smoothed at the centre
///     τ = K x (1 ± a) + K₂ max(|x| − δ₂, 0) sgn x            ± by the sign of x
///
/// δ deflection [rad] (gear minus joint), τ torque of the spring on the joint [Nm], b half gap
/// [rad], a asymmetry [–]. Source: specification 4.1.
class ElasticCurve {
 public:
  struct Parameters {
    double stiffness_Nm_rad = 0.0;
    double half_gap_rad = 0.0;
    double asymmetry = 0.0;  ///< 0.03: 3 % stiffer for positive, 3 % softer for negative deflection
    double stage_rad = std::numeric_limits<double>::infinity();  ///< where the second stage begins
    double stage_stiffness_Nm_rad = 0.0;                         ///< added beyond it
  };

  /// @throws Error if the stiffness is not positive, the asymmetry not inside ±1, or another value
  /// negative.
  explicit ElasticCurve(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// @returns τ [Nm]
  [[nodiscard]] double torque(double deflection_rad) const noexcept TORSIO_REALTIME {
    const double x = without_play(deflection_rad);
    const double torque_Nm = x * (x > 0.0 ? stiffness_up_ : stiffness_down_);
    const double excess = std::abs(x) - parameters_.stage_rad;
    if (!(excess > 0.0)) return torque_Nm;
    return torque_Nm + std::copysign(parameters_.stage_stiffness_Nm_rad * excess, x);
  }

  /// @returns the stored energy ∫₀^δ τ dδ [J], in closed form
  [[nodiscard]] double energy(double deflection_rad) const noexcept;

  /// @returns the deflection [rad] at which the curve gives this torque
  [[nodiscard]] double deflection(double torque_Nm) const noexcept;

  /// @returns the largest slope dτ/dδ [Nm/rad]
  [[nodiscard]] double steepest() const noexcept;

 private:
  [[nodiscard]] double without_play(double deflection_rad) const noexcept {
    // Beyond 20 half gaps tanh is 1 to the last bit.
    const double b = parameters_.half_gap_rad;
    if (std::abs(deflection_rad) >= 20.0 * b) {
      return deflection_rad - std::copysign(b, deflection_rad);
    }
    return deflection_rad - b * std::tanh(deflection_rad / b);
  }

  Parameters parameters_;
  double stiffness_up_;
  double stiffness_down_;
  double stage_onset_rad_;  ///< deflection with x = stage
};

}  // namespace torsio
