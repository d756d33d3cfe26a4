#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/arm/cartesian_impedance.hpp"
#include "torsio/arm/contact_detector.hpp"
#include "torsio/arm/contact_reaction.hpp"
#include "torsio/arm/momentum_observer.hpp"
#include "torsio/control/exchangeable_inverse.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {

/// What the arm follows in one tick.
enum class ArmMode : std::uint8_t {
  joints,     ///< each joint its own reference, in any mode of its `JointController`
  position,   ///< angles, speeds and accelerations of the links, by computed torque
  impedance,  ///< a spring and damper at each joint, the arm's weight carried
  cartesian,  ///< springs and dampers at the flange
  guiding,    ///< no torque beyond the arm's weight: it is moved by hand
};

struct ArmReference {
  ArmMode mode = ArmMode::position;
  ArmDynamics::PerJoint position_rad = {};    ///< position, impedance; the posture in cartesian
  ArmDynamics::PerJoint velocity_rad_s = {};  ///< position, impedance
  ArmDynamics::PerJoint acceleration_rad_s2 = {};         ///< position
  ArmDynamics::PerJoint stiffness_Nm_rad = {};            ///< impedance
  ArmDynamics::PerJoint damping_Nms_rad = {};             ///< impedance
  ArmFrame flange = {};                                   ///< cartesian, in the frame of the base
  std::array<JointReference, kMaxArmJoints> joints = {};  ///< joints
};

/// Why an arm was stopped.
enum class ArmStopCause : std::uint8_t {
  none,
  requested,    ///< by `ArmController::stop`
  measurement,  ///< a joint's sample was not finite for too many ticks
  monitor,      ///< the monitor of a joint, or it was not ready in time
  overload,     ///< the external torque of a joint exceeded its limit for too long
  contact,      ///< a contact was found, and the reaction is a stop
};

/// What a joint takes for the torque of its spring.
struct ArmJointModel {
  std::optional<TorqueEstimator> estimator = {};  ///< none: stiffness times deflection
  AnyInverse inverse = LinearInverse(1.0);
  double bearing_Nm = 0.0;       ///< as `ArmController::Joint::bearing_Nm`
  double viscous_Nms_rad = 0.0;  ///< d
};

/// The controllers of an arm of series-elastic joints in one step:
///
///     angles, currents -> torque of each spring with error bar (`TorqueEstimator` or `MonitoredTorque`)
///                      -> external torque (`MomentumObserver`) -> contact (`ContactDetector`)
///     reference        -> torque that the links need, from the arm's dynamics -> `JointStop` -> `JointController`
///                      -> current, power and brake of each joint
///
/// With τ_b(q̇) = F_b tanh(q̇ / v₀) + d q̇, the friction of the bearings between springs and links:
///
///     position    τ* = M(q*) q̈* + c(q*, q̇*) + g(q*) + τ_b(q̇*) + F_c tanh(q̇* / v₀) + F_v q̇*, fed forward in the
///                 position mode of the joint, which follows the motor side:
///                 θ* = q* + τ_s / K + k ∫ (q* − q) dt + T (q̇* − q̇),   θ̇* = q̇* + T (q̈* − q̈)
///                 τ_s the part of τ* that the spring carries, q̈ that of the links under the estimated torques
///     impedance   τ_ff = g(q) + τ_b(q̇), in the impedance mode of the joint
///     cartesian   τ* = `CartesianImpedance` + s τ_b(q̇), in its torque mode
///     guiding     τ* = c(q, q̇) + g(q) + s τ_b(q̇) − M_ii q̇ / T_g − F_g e / w, in its torque mode
///
/// e is the way since the last reversal, within ±w = 0.01 rad: a friction F_g holds the arm where it is left, although the
/// torque of a spring is never exact. s = `friction_share` below 1: more friction than there is must not be compensated. The wanted motion gives the
/// friction its sign where there is one, the measured one elsewhere.
///
/// A fault in one joint stops all of them: each goes to rest by its own `JointStop`, a joint without a usable measurement
/// without power and with its brake. The stop is latched until `release`.
///
/// After `release` the arm holds until all joints run and every monitor watches: with closed brakes the torque of a
/// motor's current differs from that of the spring, so that the monitors are proven after the brakes are open.
///
/// After a contact in the position mode (also while the arm holds) the reaction replaces the reference until `end_reaction`;
/// in the other modes, which yield to a hand, contacts are only reported. A fault during a reaction stops the arm as any other.
///
/// Paper 000 section 6.4 has the arm; the control of the whole arm is ours.
class ArmController {
 public:
  struct Joint {
    JointControllerCore::Settings control = {};  ///< with the motor side's limits of the joint
    AnyInverse inverse = LinearInverse(1.0);
    JointStop::Settings stop = {};
    /// The torque of the spring; none: its stiffness times the deflection.
    std::optional<TorqueEstimator> estimator = {};
    /// Replaces the estimator: redundant torques and their monitor, which stops the arm once it watches.
    std::optional<MonitoredTorque> monitored = {};
    /// F_b, dry friction between spring and link; 0 if the estimated torque is that after the bearing, as of a model
    /// that was trained with a load cell at the link.
    double bearing_Nm = 0.0;
    double viscous_Nms_rad = 0.0;      ///< d
    double guiding_friction_Nm = 0.0;  ///< F_g
    double largest_external_Nm = 0.0;  ///< above it for `longest_overload_s`: a stop
  };
  struct Settings {
    ArmModel arm = {};
    std::vector<Joint> joints = {};
    double speed_cutoff_Hz = 60.0;       ///< low-pass of the measured speed of the links
    double friction_speed_rad_s = 0.02;  ///< v₀
    double friction_share = 0.7;         ///< s
    double link_correction_1_s = 0.5;    ///< k; 0: none
    /// ζ, damps a link that swings on its spring with ω = √(K / M_ii): T = 2 ζ / ω, fading out where ω is faster than
    /// `fastest_swing_rad_s`, which the motor side does not follow. An integral without it would destabilise the swing.
    double link_damping = 0.3;
    double fastest_swing_rad_s = 25.0;
    double guiding_decay_s = 0.4;          ///< T_g: time in which the motion after a push decays
    double largest_correction_rad = 0.05;  ///< limit of the integral k ∫ (q* − q) dt
    /// The position mode does not begin farther from the measured angles than this: the reference is refused.
    double largest_start_error_rad = 0.05;
    MomentumObserver::Settings observer = {};
    std::optional<CartesianImpedance::Settings> cartesian = {};  ///< none: the mode is refused
    std::uint32_t tolerated_losses =
        3;  ///< ticks in a row in which a joint's sample may be missing
    double longest_overload_s = 0.02;
    double longest_proof_s = 1.0;  ///< until the monitors watch, from when all joints run
    std::optional<ContactDetector::Settings> contacts = {};  ///< none: contacts are not looked for
    ContactReaction reaction = ContactReaction::none;
    ReactionMotion::Settings reaction_motion = {};
    StopCategory stop_category =
        StopCategory::ramp_and_brake;  ///< category of a stop after a fault
  };

  struct JointOutput {
    double current_A = 0.0;
    bool is_powered = true;
    bool is_brake_open = true;
    Estimate torque = {};      ///< torque of the spring
    double link_Nm = 0.0;      ///< the same less the friction of the bearing: what moves the link
    double wanted_Nm = 0.0;    ///< torque that the links need, friction included
    double external_Nm = 0.0;  ///< external torque, of the observer
    double external_std_Nm = kNotMeasured;  ///< its standard deviation, if contacts are looked for
    double speed_rad_s = 0.0;               ///< measured, of the link
    JointStop::Phase phase = JointStop::Phase::running;
    double thermal_load = 0.0;  ///< heat of the winding: 0 cold, 1 as hot as it may be
    JointCascade::Limit limit = JointCascade::Limit::none;
    Fault fault = Fault::none;
  };
  /// The last contact.
  struct Contact {
    /// A threshold is exceeded, or was within 0.5 s; with a reaction until `end_reaction` or `release`.
    bool is_found = false;
    std::size_t joint = 0;         ///< in which it was found
    double time_s = kNotMeasured;  ///< `JointSample::t_s` of that joint when it was found
    ContactReaction reaction = ContactReaction::none;  ///< that is in effect, or stopped the arm
  };
  struct Output {
    std::array<JointOutput, kMaxArmJoints> joints = {};
    ArmStopCause cause = ArmStopCause::none;  ///< cause of the stop that is in effect
    std::size_t joint = 0;                    ///< in which it was found
    bool is_at_rest = false;                  ///< all drives, measured, after a stop
    bool is_ready = false;  ///< all joints run, and every monitor watches: references are followed
    bool is_reference_refused =
        false;                    ///< not finite, or a mode that is not configured: the arm holds
    double manipulability = 1.0;  ///< cartesian
    bool is_singular = false;     ///< cartesian
    Contact contact = {};
  };

  /// @throws Error as the parts, if the numbers of joints differ, or a setting is out of range; the message names the
  /// joint.
  ArmController(Settings settings, double sample_rate_Hz);

  /// As after the construction: memories are cleared, and the arm is stopped without power, the brakes closed, until
  /// `release`.
  void reset() noexcept;

  /// Begins a stop of all joints.
  void stop(StopCategory category) noexcept TORSIO_REALTIME;
  /// Ends a stop when all joints are at rest. @returns false, and nothing changes, if one is not
  [[nodiscard]] bool release() noexcept TORSIO_REALTIME;

  void set_reaction(ContactReaction reaction) noexcept TORSIO_REALTIME {
    settings_.reaction = reaction;
  }
  /// Ends hold, retract or float: from the next step on the arm follows its reference again, from where it is.
  void end_reaction() noexcept TORSIO_REALTIME;

  /// @param samples one per joint
  /// @returns valid until the next call
  const Output& step(const ArmReference& reference,
                     std::span<const JointSample> samples) noexcept TORSIO_REALTIME;

  [[nodiscard]] const ArmDynamics& dynamics() const noexcept { return dynamics_; }
  /// As `ArmDynamics::set_payload`, from the next step on.
  bool set_payload(const BodyInertia& payload) noexcept TORSIO_REALTIME {
    return dynamics_.set_payload(payload);
  }
  /// As `JointController::set_gains` of a joint.
  [[nodiscard]] bool set_gains(std::size_t joint,
                               const JointCascade::Gains& gains) noexcept TORSIO_REALTIME {
    return joints_[joint].controller.set_gains(gains);
  }
  /// As `JointController::set_limits` of a joint, at its motor side.
  [[nodiscard]] bool set_limits(std::size_t joint, double lowest_rad, double highest_rad,
                                double speed_rad_s, double torque_Nm) noexcept TORSIO_REALTIME {
    return joints_[joint].controller.set_limits(lowest_rad, highest_rad, speed_rad_s, torque_Nm);
  }
  /// From the next step on another model gives the torque of a joint's spring and its inverse. Neither makes a step: the
  /// difference decays in 0.1 s.
  /// @param model on return the one before
  /// @returns false, and nothing changes, for a joint with a monitor
  [[nodiscard]] bool exchange_model(std::size_t joint,
                                    ArmJointModel& model) noexcept TORSIO_REALTIME;
  /// Subtracts this torque [Nm] from a joint's estimate from the next step on.
  void set_torque_zero(std::size_t joint, double torque_Nm) noexcept TORSIO_REALTIME {
    joints_[joint].torque_zero_Nm = torque_Nm;
  }
  [[nodiscard]] std::size_t size() const noexcept { return joints_.size(); }
  /// @returns none for a joint without a monitor
  [[nodiscard]] const MonitoredTorque* monitored(std::size_t joint) const noexcept {
    return joints_[joint].monitored ? &*joints_[joint].monitored : nullptr;
  }

 private:
  /// The parts and the memory of one joint.
  struct Axis {
    Axis(Joint&& from, double sample_rate_Hz, double speed_cutoff_Hz);

    JointController<ExchangeableInverse> controller;
    JointStop stop;
    std::optional<TorqueEstimator> estimator;
    detail::BumplessTransfer transfer;  ///< difference of the torques of two models
    bool is_exchanged = false;          ///< the model, since the last step
    double torque_zero_Nm = 0.0;
    double spring_Nm =
        0.0;  ///< the last estimate of the linear spring, for a joint without a model
    std::optional<MonitoredTorque> monitored;
    std::optional<detail::JointInputs> monitor_inputs;
    std::vector<SignalSample> monitor_samples;
    Differentiator speed;      ///< speed of the link, filtered
    Differentiator raw_speed;  ///< for the observer
    Differentiator motor_speed;
    Drive drive;
    double stiffness_Nm_rad;
    double speed_limit_rad_s;
    double bearing_Nm;
    double viscous_Nms_rad;
    double largest_external_Nm;
    double guiding_friction_Nm;
    double correction_rad = 0.0;
    double guided_rad = 0.0;    ///< e
    JointState measured = {};   ///< motor side over the ratio, and the linear spring
    double t_s = kNotMeasured;  ///< clock of the last sample
    std::uint32_t lost = 0;     ///< ticks in a row without a sample
    double overloaded_s = 0.0;
  };

  bool sense(std::span<const JointSample> samples) noexcept;
  void sense_motor_side(Axis& axis, const JointSample& sample) const noexcept;
  void estimate(std::span<const JointSample> samples) noexcept;
  void supervise(std::span<const JointSample> samples) noexcept;
  void find(ArmStopCause cause, std::size_t joint) noexcept;
  void prove() noexcept;
  void find_contact(const ArmReference& reference, std::span<const JointSample> samples) noexcept;
  void react() noexcept;
  const ArmReference& reaction_reference() noexcept;
  /// In a retreat or floating, shortly after a contact.
  [[nodiscard]] bool is_yielding() const noexcept;
  [[nodiscard]] bool is_usable(const ArmReference& reference) const noexcept;
  [[nodiscard]] bool is_near(const ArmReference& reference) const noexcept;
  void hold() noexcept;
  void references(const ArmReference& reference) noexcept;
  void follow_position(const ArmReference& reference) noexcept;
  void guide(ArmDynamics::PerJoint& torque_Nm) noexcept;
  void find_swing(ArmDynamics::PerJoint& damping_s,
                  ArmDynamics::PerJoint& acceleration_rad_s2) const noexcept;
  [[nodiscard]] double bearing_torque(const Axis& axis, double speed_rad_s) const noexcept;

  Settings settings_;  ///< without the joints, which are in `joints_`
  double period_s_;
  ArmDynamics dynamics_;
  MomentumObserver observer_;
  std::optional<CartesianImpedance> cartesian_;
  std::optional<ContactDetector> contacts_;
  ReactionMotion reaction_;
  std::vector<Axis> joints_;
  ArmDynamics::PerJoint angle_rad_ = {};
  ArmDynamics::PerJoint speed_rad_s_ = {};
  ArmDynamics::PerJoint raw_speed_rad_s_ = {};
  std::array<JointReference, kMaxArmJoints> references_ = {};
  ArmReference holding_ =
      {};                 ///< where the arm was at the first step, or when a reference was refused
  double proof_s_ = 0.0;  ///< since all joints run
  ArmReference reacting_ = {};  ///< the reference that a reaction makes
  bool is_reacting_ = false;
  double reacting_s_ = 0.0;    ///< since the reaction began
  double no_contact_s_ = 0.0;  ///< since a threshold was exceeded
  bool is_started_ = false;
  bool is_holding_ = false;
  bool is_guided_ = false;  ///< in the last tick
  ArmDynamics::PerJoint last_angle_rad_ = {};
  bool is_following_ = false;  ///< a reference of the position mode was accepted in the last tick
  Output output_;
};

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(ArmMode mode) noexcept;
[[nodiscard]] std::string_view name(ArmStopCause cause) noexcept;

}  // namespace torsio
