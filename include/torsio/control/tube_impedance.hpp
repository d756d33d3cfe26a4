#pragma once

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {

/// The impedance controller of an actuator with a torsion tube before its harmonic drive, on the
/// tube's twist:
///
///     θ_s* = K_pp (q* − q) + K_dp (q̇* − q̇) + τ_ff / κ
///     τ_m = K_tp (θ_s* − θ_s),   i = τ_m / k_t, |i| <= i_peak
///     θ_s = θ_m / N_g − θ_w         the twist of the tube
///     θ_s1 = θ_m / N_g − N_h q      that of tube and gear together, for a tube too stiff to measure
///
/// θ_m, θ_w and q are the angles of rotor, wave generator and joint. At rest the joint is a spring of
///
///     K = κ K_pp,   κ = N_h k K_tp / (K_tp + k / N_g)
///
/// and a damper likewise. Paper 004 uses K_pp = 15, K_tp = 5 (high) and 0, 0.5 (zero), and prints
/// no units: Nm/rad for K_tp is assumed. Source: paper 004 section 2.3, specification 3.11; damping,
/// torque and the conversion from K to K_pp are ours.
class TubeImpedance {
 public:
  struct Gains {
    double position = 0.0;       ///< K_pp [-]
    double damping_s = 0.0;      ///< K_dp
    double torque_Nm_rad = 0.0;  ///< K_tp
  };
  static constexpr Gains kHigh = {15.0, 0.0, 5.0};
  static constexpr Gains kZero = {0.0, 0.0, 0.5};

  enum class Twist { tube, tube_and_gear };

  struct Settings {
    Drive drive = {};          ///< both gears: N = N_g N_h
    double tube_ratio = 1.0;   ///< N_g
    double tube_Nm_rad = 0.0;  ///< k
    Gains gains = {};
    Twist twist = Twist::tube;
    double joint_inertia_kg_m2 = 0.0;
    double joint_viscous_Nms_rad = 0.0;
    /// Accept gains that are stable only with the dry friction of the gear. Those of the paper's
    /// high impedance are of this kind: at 1 kHz the joint without dry friction is unstable with
    /// them.
    bool relies_on_friction = false;
    double speed_cutoff_Hz = 40.0;  ///< low-pass of q̇
    double transfer_s = 0.1;        ///< transition of the current when measurements return
    double fault_decay_s = 0.02;    ///< decay of the current without a usable measurement
  };
  struct Angles {
    double rotor_rad = kNotMeasured;
    double middle_rad = kNotMeasured;  ///< wave generator; only for `Twist::tube`
    double joint_rad = kNotMeasured;
  };
  struct Output {
    double current_A = 0.0;
    double twist_rad = 0.0;         ///< θ_s, or θ_s1
    double position_rad = 0.0;      ///< its share of θ_s*
    double damping_rad = 0.0;       ///< its share of θ_s*
    double feed_forward_rad = 0.0;  ///< its share of θ_s*
    double motor_torque_Nm = 0.0;   ///< τ_m
    double transfer_A = 0.0;        ///< in addition to τ_m / k_t, after a fault
    bool is_limited = false;
    Fault fault = Fault::none;
  };

  /// The gains that render a stiffness and a damping at the joint. @param torque_Nm_rad K_tp
  /// @throws Error if a value is negative, or K_tp not positive.
  [[nodiscard]] static Gains gains_for(const Settings& settings, double stiffness_Nm_rad,
                                       double damping_Nms_rad, double torque_Nm_rad);

  /// @throws Error if the drive is impossible, a gain negative or not finite, or if the loop is
  /// unstable with its output locked or free (with the margin), the gear taken as rigid and its dry
  /// friction as absent, unless `relies_on_friction`.
  TubeImpedance(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;

  /// A reference that is not finite is a fault, and the last finite one is used (none yet: no
  /// current). A measurement that is not finite is a fault too: the current fades to 0 and
  /// continues from there.
  /// @param wanted_Nm τ_ff, a torque on the joint in addition; without effect if K_tp is 0
  Output step(double wanted_rad, double wanted_rad_s, const Angles& measured,
              double wanted_Nm = 0.0) noexcept TORSIO_REALTIME;

  /// K [Nm/rad], at rest.
  [[nodiscard]] double stiffness() const noexcept;
  /// κ [Nm/rad]: the torque at the joint for each rad of θ_s*, at rest; 0 if K_tp is 0.
  [[nodiscard]] static double torque_per_twist(const Settings& settings) noexcept;
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }
  /// The equivalent joint with the tube after both gears, and the feedback. Allocates.
  [[nodiscard]] static SeriesElasticJoint joint_of(const Settings& settings);
  [[nodiscard]] static JointFeedback feedback_of(const Settings& settings, double sample_rate_Hz);

 private:
  Output fade() noexcept;

  Settings settings_;
  double gear_ratio_;
  double fault_keep_;
  Differentiator speed_;
  detail::BumplessTransfer transfer_;
  bool has_reference_ = false;
  bool is_returning_ = false;  ///< from a fault
  double wanted_rad_ = 0.0;
  double wanted_rad_s_ = 0.0;
  double wanted_Nm_ = 0.0;
  double current_A_ = 0.0;
};

/// Like `passive_stiffness` for an impedance on deflection control: the largest passive K of this
/// actuator, with K_tp of `settings` and this damping.
[[nodiscard]] double passive_stiffness(const TubeImpedance::Settings& settings,
                                       double damping_Nms_rad, double passive_to_rad_s,
                                       double sample_rate_Hz);

}  // namespace torsio
