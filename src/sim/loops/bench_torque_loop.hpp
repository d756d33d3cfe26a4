#pragma once

#include "sim/plant/plant.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The torque controller of a bench whose load cell is fast: PI with feed-forward on the load cell,
/// and damping from the rotor's encoder.
///
///     e = τ* − τ,   i = τ* / (N k_t) + K_p e + K_i ∫ e dt + K_d (τ̇* / K − θ̇_m / N)
///
/// designed on the plant with its output locked, J N² δ̈ + K δ = N k_t i with τ = K δ, whose motion
/// under P and D gets the bandwidth ω = 100 rad/s and the damping ζ = 0.9, the integral taking over
/// five times slower:
///
///     K_p = (J N² ω² / K − 1) / (N k_t),  K_d = 2 ζ ω J N² / (N k_t),  K_i = ω/5 (K_p + 1 / (N
/// k_t))
///
/// K is the stiffness of a fast motion without relaxation. θ̇_m is the encoder's difference,
/// filtered by a 120 Hz low-pass, τ̇* the difference of τ*; the integral stops at the peak current.
/// Paper 003 states only that its loop is PI; feed-forward, damping and gains are ours
/// (specification 4.7).
class BenchTorqueLoop {
 public:
  /// @param stiffness_Nm_rad K, of the second stage
  /// @throws Error if the stiffness is not positive, or too high for the bandwidth (K_p <= 0)
  BenchTorqueLoop(const PlantParameters& plant, double stiffness_Nm_rad, double sample_rate_Hz);

  void reset() noexcept;

  /// @param wanted_Nm τ*
  /// @param torque_Nm τ, of the load cell
  /// What is not finite changes nothing: the last current holds.
  /// @returns the motor current [A]
  double step(double wanted_Nm, double torque_Nm, double rotor_angle_rad) noexcept TORSIO_REALTIME;

 private:
  double sample_rate_Hz_;
  double inverse_ratio_;
  double inverse_stiffness_ = 0.0;
  double feed_forward_A_Nm_ = 0.0;
  double proportional_A_Nm_ = 0.0;
  double integral_A_Nm_s_ = 0.0;
  double derivative_As_rad_ = 0.0;
  double peak_current_A_;
  Lowpass speed_filter_;
  double integral_A_ = 0.0;
  double last_wanted_Nm_ = 0.0;
  double last_angle_rad_ = 0.0;
  double current_A_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
