#pragma once

#include "sim/plant/plant.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The position controller of the bench, on the rotor's encoder: it moves the lever for a
/// recording.
///
///     e = k_p (q* − θ_m / N) + q̇* − v,   i = k_v (e + k_i ∫ e dt)
///     k_v = J_m N ω_c / k_t,  k_p = k_i = 0.32 ω_c
///
/// v is the difference of θ_m / N, filtered by a low-pass at 2.4 Hz per rad/s of ω_c (but at most a
/// fifth of the sample rate), q̇* the difference of q*; the integral stops at the peak current.
/// With the 25 rad/s of the levers k_p = k_i = 8 1/s and the low-pass is at 60 Hz. Source:
/// specification 4.7; the dependence of the gains on the bandwidth is ours.
class BenchPositionLoop {
 public:
  static constexpr double kDefaultBandwidth_rad_s = 25.0;

  /// @param bandwidth_rad_s ω_c of the speed loop
  /// @throws UsageError if it is not positive, or so low that the low-pass cannot follow.
  BenchPositionLoop(const PlantParameters& plant, double sample_rate_Hz,
                    double bandwidth_rad_s = kDefaultBandwidth_rad_s);

  void reset() noexcept;

  /// @param wanted_rad q*, of the joint
  /// What is not finite changes nothing: the last current holds.
  /// @returns the motor current [A]
  double step(double wanted_rad, double rotor_angle_rad) noexcept TORSIO_REALTIME;

 private:
  double sample_rate_Hz_;
  double inverse_ratio_;
  double speed_gain_A_s_rad_;
  double position_gain_;  ///< k_p = k_i [1/s]
  double integral_limit_;
  Lowpass speed_filter_;
  double integral_ = 0.0;
  double last_wanted_rad_ = 0.0;
  double last_angle_rad_ = 0.0;
  double current_A_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
