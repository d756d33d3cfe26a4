#pragma once

#include "sim/plant/plant.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The torque controller of a series-elastic actuator: it controls the deflection of its spring.
///
///     e = δ* − δ,   i = K_p e + K_i ∫ e dt − K_d δ̇ + K δ* / (N k_t)
///
/// designed on the plant with its output locked, J N² δ̈ + K δ = N k_t i:
///
///     K_p = (J N² ω² − K) / (N k_t),  K_d = 2 ζ ω J N² / (N k_t),  K_i = 6 K_p,  ω = 50 rad/s, ζ =
/// 0.9
///
/// δ is gear angle minus joint angle as measured by the encoders, δ̇ its difference filtered by a
/// 120 Hz low-pass; the integral stops at the peak current. The caller computes δ* for a torque:
/// with the linear model (τ − b) / K, or with the inverse of a model. Source: specification 3.11.
class BenchDeflectionLoop {
 public:
  static constexpr double kLargest_rad = rad_from_deg(9.0);  ///< limit of |δ*|

  /// @throws Error if the second stage is not a spring, or is stiffer than the design allows (K_p
  /// <= 0)
  BenchDeflectionLoop(const PlantParameters& plant, double sample_rate_Hz);

  void reset() noexcept;

  /// What is not finite changes nothing: the last current holds.
  /// @returns the motor current [A]
  double step(double wanted_rad, double deflection_rad) noexcept TORSIO_REALTIME;

 private:
  double sample_rate_Hz_;
  double proportional_A_rad_ = 0.0;
  double derivative_As_rad_ = 0.0;
  double feed_forward_A_rad_ = 0.0;
  double integral_limit_rad_s_ = 0.0;
  Lowpass rate_filter_;
  double integral_rad_s_ = 0.0;
  double last_deflection_rad_ = 0.0;
  double current_A_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
