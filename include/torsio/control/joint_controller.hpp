#pragma once

#include <optional>
#include <utility>

#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/spring_controller.hpp"
#include "torsio/control/torque_controller.hpp"

namespace torsio {

/// The part of a `JointController` that does not depend on the inverse of the spring.
class JointControllerCore {
 public:
  struct Settings {
    /// With the joint, and the `actuation` of the deflection controller: current or velocity.
    TorqueLoopCore::Settings torque = {};
    /// Its `torque_Nm` is a limit beside `largest_torque_Nm`.
    JointCascade::Limits limits = {};
    double override_rad_s = 50.0;  ///< bandwidth of the speed loops that override near a limit
    /// None: those of `JointCascade` for `override_rad_s`. With `Actuation::velocity` the speed loop
    /// is four times as fast as the deflection controller, if the sample rate allows it. The torque
    /// gains have no effect: torque is controlled through the spring.
    std::optional<JointCascade::Gains> gains = std::nullopt;
    double speed_cutoff_Hz = 120.0;  ///< low-pass of the speed of the motor side
  };

  struct Output {
    double current_A = 0.0;
    JointCascade::Limit limit = JointCascade::Limit::none;  ///< the last that cut current or speed
    bool is_limited =
        false;  ///< a limit changed the torque, the deflection, the speed or the current
    bool is_reference_refused = false;
    /// The wanted one after its limit; in a mode without the spring, the last measured one.
    double spring_deflection_rad = 0.0;
    TorqueLoopCore::Output torque = {};  ///< before the limits; torque, impedance and deflection
    JointCascade::Output cascade = {};   ///< its current is that of this output
    JointState state = {};  ///< motor side over the ratio, and the linear spring's torque
    Fault fault = Fault::none;
  };

  /// @returns the bandwidth [rad/s] of the velocity loop inside a deflection controller on the
  /// velocity, if no gains are given: four times that of the controller, at most a fifth of the
  /// sample rate
  [[nodiscard]] static double velocity_bandwidth(double deflection_rad_s,
                                                 double sample_rate_Hz) noexcept;

  /// @throws Error as `TorqueLoopCore` and `JointCascade`.
  JointControllerCore(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;
  /// Takes the reference, or refuses it, and the measurements.
  /// @returns the torque [Nm] for the inverse: the wanted one, or the present one in a mode that
  /// needs none; finite
  double accept(const JointReference& reference,
                const JointSample& sample) noexcept TORSIO_REALTIME;
  /// @param wanted_rad of the inverse, for that torque
  Output step(const Estimate& wanted_rad, const JointSample& sample) noexcept TORSIO_REALTIME;
  /// As `JointCascade::track`.
  void track(double applied_A) noexcept TORSIO_REALTIME;
  /// As `JointCascade::set_gains`, without effect on the modes of the spring.
  [[nodiscard]] bool set_gains(const JointCascade::Gains& gains) noexcept TORSIO_REALTIME {
    return cascade_.set_gains(gains);
  }
  /// As `JointCascade::set_motion_limits` and `TorqueLoopCore::set_largest_torque`, all or none.
  [[nodiscard]] bool set_limits(double lowest_rad, double highest_rad, double speed_rad_s,
                                double torque_Nm) noexcept TORSIO_REALTIME;

  [[nodiscard]] const JointCascade& cascade() const noexcept { return cascade_; }
  [[nodiscard]] const TorqueLoopCore& torque() const noexcept { return torque_; }
  /// For what writes the controller down in another language.
  [[nodiscard]] ControllerListing listing() const noexcept;

 private:
  void enter(JointMode mode) noexcept;
  JointState measure(const JointSample& sample) noexcept;
  double wanted_torque() noexcept;
  [[nodiscard]] JointCascade::Limit limit_of(const Output& output) const noexcept;
  void track_spring_loop(double applied_A) noexcept;

  SeriesElasticJoint joint_;
  bool acts_on_speed_;
  TorqueLoopCore torque_;
  JointCascade cascade_;
  JointImpedance impedance_;
  Differentiator speed_;
  JointReference reference_;
  JointState state_;
  double deflection_rad_ = 0.0;  ///< the last measured one
  double accepted_Nm_ = 0.0;
  double transfer_A_ = 0.0;  ///< transfer of the cascade in the last tick
  bool is_number_ = true;    ///< the last reference
  bool is_accepted_ = true;  ///< the last reference
};

/// Every controller of a series-elastic joint in one class: current, velocity, position, and through
/// the spring deflection, torque and impedance, within the limits of a `JointCascade`.
///
///     torque       δ* = inverse(τ*)                       (`TorqueController`)
///     impedance    τ* = K (q* − q) + D (q̇* − q̇) + τ_ff    at the motor side (`JointImpedance`)
///     deflection   δ*, within the largest torque over K
///
/// each then by the deflection controller, which acts on the current, i = PID(δ* − δ) + K δ* / (N
/// k_t), or on the velocity loop, θ̇* = ω (δ* − δ) + D[δ*]. In every mode position and velocity
/// controllers are inactive until the motor side comes near a limit, and then override
/// (see `JointCascade` for the guarantee and its conditions). The deflection controller is given what
/// they removed, so that its integral does not wind up. Every change of mode and every return from
/// an override continues from the present current. Settings of the torque loop that add to its
/// current act in the spring's modes only; those that use the rate of the wanted torque (friction,
/// feed-forward of the rate) do not act in an impedance, whose torque follows from measurements.
///
/// The load of the motor is taken as K δ of the linear spring; its error belongs to
/// `max_unmeasured_load_Nm`, and the largest spring torque to `max_measured_load_Nm`. References and
/// measurements that are not finite: as `JointCascade`.
///
/// Source: paper 000 section 4, Figure 6 (position and velocity controllers that override); the
/// continuous override is ours.
template <SpringInverse I>
class JointController : public detail::SpringController<I, JointControllerCore> {
  using Base = detail::SpringController<I, JointControllerCore>;

 public:
  using typename Base::Output;
  using typename Base::Settings;

  /// @throws Error as `JointControllerCore`.
  JointController(I inverse, const Settings& settings, double sample_rate_Hz)
      : Base(std::move(inverse), settings, sample_rate_Hz) {}

  /// The inverse takes part in every mode, so that one with a memory is ready when it is needed.
  Output step(const JointReference& reference, const JointSample& sample) noexcept TORSIO_REALTIME {
    return Base::step_with(Base::own_core().accept(reference, sample), sample,
                           &Output::spring_deflection_rad);
  }
  /// As `JointCascade::track`.
  void track(double applied_A) noexcept TORSIO_REALTIME { Base::own_core().track(applied_A); }
  /// As `JointControllerCore::set_gains` and `set_limits`.
  [[nodiscard]] bool set_gains(const JointCascade::Gains& gains) noexcept TORSIO_REALTIME {
    return Base::own_core().set_gains(gains);
  }
  [[nodiscard]] bool set_limits(double lowest_rad, double highest_rad, double speed_rad_s,
                                double torque_Nm) noexcept TORSIO_REALTIME {
    return Base::own_core().set_limits(lowest_rad, highest_rad, speed_rad_s, torque_Nm);
  }
};

}  // namespace torsio
