#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "torsio/control/deflection_controller.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/control/spring_controller.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/differentiator.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The current that is used up by friction and by other effects that are not in the joint's
/// equation:
///
///     d = Q (i − (J N² θ̈ + K δ) / (N k_t))
///
/// with Q a second-order low-pass, θ̈ the second difference of the rotor's angle over the ratio, and i
/// the current of the tick before. Added to the command it makes the drive behave as without friction
/// below the cut-off. Source: Ohnishi et al. 1996; the form is ours.
class DisturbanceObserver {
 public:
  /// @throws Error if the joint is impossible, or as `Lowpass` does.
  DisturbanceObserver(const SeriesElasticJoint& joint, double cutoff_Hz, double sample_rate_Hz);

  void reset() noexcept;

  /// @param applied_A of the tick before
  /// @returns d [A]; without two differences yet, 0
  double step(double applied_A, double motor_angle_rad,
              double deflection_rad) noexcept TORSIO_REALTIME;

  /// How a loop changes when d is added to its command. Allocates.
  [[nodiscard]] JointFeedback with(const JointFeedback& loop) const;

 private:
  SeriesElasticJoint joint_;
  double cutoff_Hz_;
  double inverse_ratio_;
  double inertia_As2_rad_;
  double stiffness_A_rad_;
  Differentiator speed_;
  Differentiator acceleration_;
  Lowpass lowpass_;
};

/// Compensates a share of the drive's friction while the spring is wound:
///
///     i_f = s (F_c tanh(v* / v₀) + F_v v*) / (N k_t),   v* = D[τ*] / K, low-passed
///
/// It uses the wanted torque, not the output of an inverse: that depends on the measured motion,
/// and its rate would close a second loop through the model.
struct FrictionCompensation {
  double share = 0.7;         ///< s, 0 to 1; overcompensation causes limit cycles
  double speed_rad_s = 0.02;  ///< v₀, at the joint
};

/// The settings that do not depend on the inverse of a `TorqueController`.
class TorqueLoopCore {
 public:
  struct Settings {
    DeflectionController::Settings deflection = {};
    double largest_torque_Nm = std::numeric_limits<double>::infinity();  ///< reference limit
    std::optional<FrictionCompensation> friction = std::nullopt;
    std::optional<double> observer_cutoff_Hz = std::nullopt;  ///< needs the rotor's angle
    /// Adds i_r = K_d v*, v* as in `FrictionCompensation`: the deflection is damped relative to its
    /// wanted rate instead of relative to standstill, and no longer lags by 2 ζ / ω. The margins do
    /// not change; a step of the torque makes a jump of the current. Use it for a torque that is
    /// planned, not for one that follows from a measurement, like that of an impedance.
    bool feeds_rate_forward = false;
  };

  struct Output {
    double current_A = 0.0;
    double speed_rad_s = 0.0;            ///< with `Actuation::velocity`, in addition to the current
    double wanted_torque_Nm = 0.0;       ///< after its limit
    double wanted_deflection_rad = 0.0;  ///< output of the inverse, after its limit
    double proportional_A = 0.0;         ///< this and the next three: 0 with `Actuation::velocity`
    double integral_A = 0.0;
    double derivative_A = 0.0;
    double feed_forward_A = 0.0;
    double rate_feed_forward_A = 0.0;
    double friction_A = 0.0;
    double observer_A = 0.0;
    double transfer_A = 0.0;  ///< after a change of gains or a fault
    bool is_limited = false;
    Fault inverse =
        Fault::none;  ///< fault of the inverse; the output is usable for a controlled stop
    Fault fault = Fault::none;  ///< a reference or a measurement could not be used
  };

  /// @throws Error as `DeflectionController`, if a setting is out of range, if the loop with the
  /// observer is unstable (with the margin), or for an observer or a feed-forward of the rate if the
  /// deflection controller acts on the speed.
  TorqueLoopCore(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;
  /// @param is_planned false for a torque that follows from a measurement: its rate is not used,
  /// neither for the friction nor for `feeds_rate_forward`
  /// @returns the torque for the inverse: finite, and within the limit
  double accept(double wanted_Nm, bool is_planned = true) noexcept TORSIO_REALTIME;
  Output step(const Estimate& wanted_rad, const JointSample& sample) noexcept TORSIO_REALTIME;
  /// The current (speed) that was applied in place of that of the last step, where a limit after
  /// the controller cut it: the integral does not wind up. Not finite: changes nothing.
  void track(double applied) noexcept TORSIO_REALTIME;
  /// The whole current of the motor in the last tick, for the disturbance observer, where another
  /// controller adds to that of the last step. Not finite: changes nothing.
  void set_motor_current(double current_A) noexcept TORSIO_REALTIME;
  /// Limit of the wanted torque, from the next step on. @returns false, and it is kept, if it is not positive
  [[nodiscard]] bool set_largest_torque(double torque_Nm) noexcept TORSIO_REALTIME;

  [[nodiscard]] const DeflectionController& deflection() const noexcept { return deflection_; }
  [[nodiscard]] DeflectionController& deflection() noexcept { return deflection_; }
  /// The feedback of the loop, the observer included. Allocates.
  [[nodiscard]] JointFeedback feedback() const;
  [[nodiscard]] Margins margins_of(JointOutput output) const;
  /// Fills its own part.
  void list(ControllerListing& listing) const noexcept;

 private:
  void check_stability() const;
  Output fade(Output output) noexcept;

  Settings settings_;
  DeflectionController deflection_;
  detail::BumplessTransfer transfer_;  ///< terms added to the deflection controller's current
  std::optional<DisturbanceObserver> observer_;
  Differentiator wanted_rate_;  ///< D[τ*]
  double amperes_per_Nm_;
  double wanted_Nm_ = 0.0;
  bool is_refused_ = false;
  bool is_planned_ = true;
  bool is_returning_ = false;  ///< from a fault
  double added_A_ = 0.0;       ///< in the last step to the current of the deflection controller
  double applied_ = 0.0;       ///< current [A], or speed [rad/s]
};

/// Torque through the spring: inverse model of the spring, deflection control, and optionally friction
/// compensation, feed-forward of the rate, and a disturbance observer.
///
///     δ* = inverse(τ*),   i = deflection controller(δ*, δ) + i_r + i_f + d,   |i| <= i_peak
///
/// A reference that is not finite is a fault, and the last finite one is used; without a usable
/// measurement the current fades to 0. Where the inverse has a fault the loop continues with its value,
/// and `Output::inverse` reports it. Source: paper 000 section 4, 001 section 6;
/// specification 3.11.
template <SpringInverse I>
class TorqueController : public detail::SpringController<I, TorqueLoopCore> {
  using Base = detail::SpringController<I, TorqueLoopCore>;

 public:
  using typename Base::Output;
  using typename Base::Settings;

  /// @throws Error as `TorqueLoopCore`.
  TorqueController(I inverse, const Settings& settings, double sample_rate_Hz)
      : Base(std::move(inverse), settings, sample_rate_Hz) {}

  Output step(double wanted_Nm, const JointSample& sample) noexcept TORSIO_REALTIME {
    return Base::step_with(Base::own_core().accept(wanted_Nm), sample,
                           &Output::wanted_deflection_rad);
  }
  /// As `DeflectionController::set_gains`.
  [[nodiscard]] bool set_gains(const Pid::Gains& gains) noexcept TORSIO_REALTIME {
    return Base::own_core().deflection().set_gains(gains);
  }
};

}  // namespace torsio
