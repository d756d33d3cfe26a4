#pragma once

#include "torsio/core/realtime.hpp"
#include "torsio/signal/lowpass.hpp"
#include "torsio/sim/plant.hpp"

namespace torsio {

/// The bench's own position controller, on the rotor's encoder: it moves the lever so that there is
/// something to record.
///
///     e = k_p (q* − θ_m / N) + q̇* − v,   i = k_v (e + k_i ∫ e dt)
///     k_v = J_m N ω_c / k_t,  ω_c = 25 rad/s,  k_p = k_i = 8 1/s
///
/// v is the difference of θ_m / N behind a 60 Hz low-pass, q̇* the difference of q*; the integral
/// stops at the peak current. Source: SPEC section 4.7.
class PositionLoop {
 public:
  PositionLoop(const PlantParameters& plant, double sample_rate_Hz);

  void reset() noexcept;

  /// @param wanted_rad q*, of the joint
  /// @returns the motor current [A]
  double step(double wanted_rad, double rotor_angle_rad) noexcept TORSIO_REALTIME;

 private:
  double sample_rate_Hz_;
  double inverse_ratio_;
  double speed_gain_A_s_rad_;
  double integral_limit_;
  Lowpass speed_filter_;
  double integral_ = 0.0;
  double last_wanted_rad_ = 0.0;
  double last_angle_rad_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
