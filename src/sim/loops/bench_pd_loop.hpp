#pragma once

#include "sim/plant/plant.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The drive law of the experiments in the air, simple enough to be known exactly to a reader of the log: proportional
/// and derivative on the rotor's encoder, at most a torque. All quantities are those after the gear.
///
///     τ* = clip(k_p (q* − θ_m / N) − k_d v, ±τ_max),   i = τ* / (N k_t)
///
/// v is the difference of θ_m / N over one sample, without a filter: with 19 bits at the rotor its noise is below
/// 0.2 mrad/s. The current follows with the lag of the motor.
class BenchPdLoop {
 public:
  struct Gains {
    double kp_Nm_rad = 0.0;
    double kd_Nms_rad = 0.0;
    double torque_limit_Nm = 0.0;  ///< τ_max
  };

  /// The two gains give J = armature + joint + load the natural frequency of 6 Hz with the damping 0.5 if nothing
  /// yields, k_p = J ω², k_d = 2 ζ ω J; the limit is the rated torque. The gains are ours.
  /// @param load_inertia_kg_m2 of the lever
  [[nodiscard]] static Gains gains(const PlantParameters& plant, double load_inertia_kg_m2,
                                   double rated_torque_Nm);

  /// @throws Error if a gain is negative or not finite, or the limit not positive.
  BenchPdLoop(const PlantParameters& plant, const Gains& gains, double sample_rate_Hz);

  void reset() noexcept;

  /// @param wanted_rad q*, of the joint
  /// What is not finite changes nothing: the last torque holds.
  /// @returns τ* [Nm]
  double step(double wanted_rad, double rotor_angle_rad) noexcept TORSIO_REALTIME;
  /// @returns the motor current [A] of a torque after the gear
  [[nodiscard]] double current(double torque_Nm) const noexcept {
    return torque_Nm * current_A_Nm_;
  }

 private:
  Gains gains_;
  double sample_rate_Hz_;
  double inverse_ratio_;
  double current_A_Nm_;
  double last_angle_rad_ = 0.0;
  double torque_Nm_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
