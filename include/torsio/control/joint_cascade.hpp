#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "torsio/control/design/drive.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

struct ControllerListing;

/// The current that a winding withstands: the square of the current, through a first-order lag,
/// stays below the square of the rated current (I²t).
///
///     ẇ = (i² − w) / τ,   i² <= min(i_peak², i_rated² + κ (i_rated² − w)),   κ = 4 (i_peak² / i_rated² − 1)
///
/// so that w < i_rated² for any command, since then (i_rated² − w)˙ >= −(1 + κ) (i_rated² − w) / τ.
/// The limit falls from peak to rated over the last quarter of w: it fades, and never switches.
class ThermalLimit {
 public:
  /// @throws Error if a value is not positive, the peak below the rated current, or the time
  /// constant not above 1 + κ samples.
  ThermalLimit(double rated_A, double peak_A, double time_constant_s, double sample_rate_Hz);

  void reset() noexcept { load_ = 0.0; }

  /// @returns the largest current [A] of this tick
  [[nodiscard]] double allowed_A() const noexcept TORSIO_REALTIME {
    return is_warm() ? std::min(peak_A_, rated_A_ * std::sqrt(1.0 + fade_ * (1.0 - load_)))
                     : peak_A_;
  }
  /// Whether the limit has begun to fall, at three quarters of the heat.
  [[nodiscard]] bool is_warm() const noexcept TORSIO_REALTIME { return load_ > kCold; }
  /// @param current_A the current that flows in this tick, finite
  void step(double current_A) noexcept TORSIO_REALTIME {
    const double ratio = current_A / rated_A_;
    load_ += share_ * (ratio * ratio - load_);
  }
  /// @returns w / i_rated², 0 cold, 1 as hot as it may be
  [[nodiscard]] double load() const noexcept { return load_; }
  /// Fills its own part.
  void list(ControllerListing& listing) const noexcept;

 private:
  static constexpr double kCold = 0.75;

  double rated_A_;
  double peak_A_;
  double fade_;   ///< κ
  double share_;  ///< first-order lag per tick
  double load_ = 0.0;
};

/// `deflection` is a mode of `JointController`; a `JointCascade` rejects it.
enum class JointMode : std::uint8_t { current, velocity, position, torque, impedance, deflection };

/// The reference of a joint in one tick. A mode ignores the fields that are not listed for it, but
/// every number must be finite: a reference is accepted as a whole or rejected.
struct JointReference {
  JointMode mode = JointMode::current;
  double position_rad = 0.0;         ///< position, impedance
  double velocity_rad_s = 0.0;       ///< velocity; feed-forward in position, impedance
  double acceleration_rad_s2 = 0.0;  ///< feed-forward J N² a in position, velocity
  double torque_Nm = 0.0;            ///< torque; feed-forward in position, velocity, impedance
  double current_A = 0.0;            ///< current; feed-forward in every other mode
  double stiffness_Nm_rad = 0.0;     ///< impedance, >= 0
  double damping_Nms_rad = 0.0;      ///< impedance, >= 0
  double deflection_rad = 0.0;       ///< deflection
};

/// Whether every number is finite.
[[nodiscard]] bool is_finite(const JointReference& reference) noexcept;

/// What a joint measures: angle and speed of the side that the motor moves (rotor over ratio), and
/// the torque that loads the motor (the spring's).
struct JointState {
  double angle_rad = kNotMeasured;
  double speed_rad_s = kNotMeasured;
  double torque_Nm = kNotMeasured;  ///< only if the cascade was configured with a torque sensor
};

/// Position P -> velocity PI -> current, torque PID -> current, impedance -> torque; all with
/// feed-forward, switched without a jump, within limits that hold in every mode.
///
///     position    v* = k_q (q* − q) + q̇*, cut to [v_lo, v_hi]
///     velocity    i = PI(v* − v) + (J N² a* + τ*) / (N k_t) + i*
///     torque      i = PID(τ* − τ) + τ* / (N k_t) + i*
///     impedance   τ* = K (q* − q) + D (q̇* − q̇) + τ_ff, then torque
///
/// After a change of mode or of gains, also of those in an impedance's reference, the current
/// continues from its last value; the difference decays (`BumplessTransfer`). The impedance is a
/// `JointImpedance`.
///
/// **Limit override.** In every mode the current stays between those of two speed loops, which
/// become active only where the joint comes near a limit:
///
///     k_v (v_lo − v) + τ / (N k_t)  <=  i  <=  k_v (v_hi − v) + τ / (N k_t),   k_v = J N² ω / (N k_t)
///     v_hi = min(v_max′, ω_p e, √(2 a (e − a / 2ω_p²))),   e = q_max − m − q,   and v_lo alike
///
/// with ω_p = ω / 5, a = (N k_t i_rated − d − τ_c) / (2 J N²), half of what the rated current can
/// brake in addition to the loads, and the margins m = d / (J N² ω ω_p), v_max′ = v_max − d / (J N²
/// ω) for a load d that the cascade does not measure: in a joint that starts within its limits, q
/// <= q_max and v <= v_max for any command, any such load and any measured one up to τ_c, hot
/// winding or cold. Both bounds are continuous in the state and have no memory. The smaller one
/// applies, nothing can wind up, and the override releases the current at the value at which it
/// took over. The limits after it (current, I²t, voltage) reduce the current further. A rate limit
/// acts on the command of the mode; one that is slower than the override is rejected. Without a
/// torque sensor τ is 0 and d is the whole load.
///
/// Source: paper 000 section 4 (specification 3.11); the bounds and their proof are ours.
class JointCascade {
 public:
  struct Gains {
    double position_1_s = 0.0;  ///< k_q
    Pid::Gains velocity = {};   ///< A s/rad
    Pid::Gains torque = {};     ///< A/Nm
  };
  struct Limits {
    double lowest_rad = -std::numeric_limits<double>::infinity();
    double highest_rad = std::numeric_limits<double>::infinity();
    double speed_rad_s = 0.0;
    double max_unmeasured_load_Nm =
        0.0;  ///< d: the largest load that is not measured (friction, torque
              ///< error, what changes faster than the current follows)
    double max_measured_load_Nm = 0.0;  ///< largest measured load: reduces the torque for braking
    double torque_Nm = std::numeric_limits<double>::infinity();  ///< limit of the wanted torque
    double current_rate_A_s = std::numeric_limits<double>::infinity();
    double thermal_time_s = 10.0;  ///< time constant of the winding
  };
  struct Settings {
    Drive drive = {};
    double bandwidth_rad_s = 50.0;  ///< ω, of the speed loop
    Limits limits = {};
    bool has_torque = false;          ///< the state has a torque
    std::optional<Gains> gains = {};  ///< none: `gains_for`
    double torque_cutoff_Hz = 120.0;  ///< low-pass of the torque's derivative
    double transfer_s = 0.1;
    double fault_decay_s = 0.02;  ///< decay of the current without a usable measurement
  };

  enum class Limit : std::uint8_t {
    none,
    position,
    speed,
    rate,
    current,
    thermal,
    voltage,
  };

  struct Output {
    double current_A = 0.0;
    double wanted_velocity_rad_s = 0.0;  ///< after the limits; position and velocity
    double wanted_torque_Nm = 0.0;       ///< after its limit; torque and impedance
    double proportional_A = 0.0;
    double integral_A = 0.0;
    double derivative_A = 0.0;
    double feed_forward_A = 0.0;
    double transfer_A = 0.0;
    double thermal_load = 0.0;  ///< 0 cold, 1 as hot as the winding may be
    Limit limit = Limit::none;  ///< the last that cut the current
    bool is_reference_refused =
        false;  ///< not finite, negative impedance, or a mode without a sensor
    Fault fault = Fault::none;
  };

  /// Default gains: k_q = ω / 5; velocity J N² ω / (N k_t), its integral ω / 5 times that; no
  /// torque gains.
  [[nodiscard]] static Gains gains_for(const Drive& drive, double bandwidth_rad_s);

  /// @throws Error if the drive is impossible, a gain negative, or if the limits contradict each
  /// other: no space between them and their margins, no current left to brake with, a rate
  /// limit that is slower than the override, a speed that the supply does not reach.
  JointCascade(const Settings& settings, double sample_rate_Hz);

  /// Clears the memory: no current, mode `current` with 0 A; the temperature of the winding is
  /// kept.
  void reset() noexcept;

  /// After a rejected reference the last good one remains in use (0 A if there was none), with
  /// `Fault::input_not_finite` if the rejected one is not finite. A measurement that is not finite
  /// is that fault too: the current fades to 0 with `fault_decay_s`, and continues from there when
  /// measurements return.
  Output step(const JointReference& reference, const JointState& measured) noexcept TORSIO_REALTIME;

  /// The current that was applied in place of that of the last step: no integral winds up, what is
  /// left of a transfer that the cut opposes is dropped, and the next transfer continues from this
  /// current. Not finite: changes nothing.
  void track(double applied_A) noexcept TORSIO_REALTIME;
  /// The next current continues from the last one, as after a change of mode: for a controller
  /// before this one whose own mode changes.
  void continue_from_last() noexcept TORSIO_REALTIME { is_switching_ = true; }

  /// All at once, from the next step on, without a jump.
  /// @returns false, and all are kept, if one is negative or not finite
  [[nodiscard]] bool set_gains(const Gains& gains) noexcept TORSIO_REALTIME;

  /// The limits of the motion, from the next step on. Beyond a new limit the override brings the joint back.
  /// @returns false, and all are kept, if the speed is not finite or above that of the construction, or the limits leave no
  /// space for their margins
  [[nodiscard]] bool set_motion_limits(double lowest_rad, double highest_rad,
                                       double speed_rad_s) noexcept TORSIO_REALTIME;

  /// @returns m [rad], v_max′ [rad/s]
  [[nodiscard]] double position_margin() const noexcept { return margin_rad_; }
  [[nodiscard]] double soft_speed() const noexcept { return soft_speed_rad_s_; }
  /// Fills its own part.
  void list(ControllerListing& listing) const noexcept;

 private:
  struct Bounds {
    double lowest = 0.0;
    double highest = 0.0;
  };
  void check_limits() const;
  [[nodiscard]] bool is_usable(const JointReference& reference) const noexcept;
  [[nodiscard]] double approach(double room_rad) const noexcept;
  [[nodiscard]] Bounds speed_bounds(double angle_rad) const noexcept;
  void enter(JointMode mode) noexcept;
  double wanted_current(const JointState& measured, const Bounds& speed, Output& output) noexcept;
  double within_limits(double wanted_A, const JointState& measured, const Bounds& speed,
                       Output& output) noexcept;
  double impedance_torque(const JointState& measured) noexcept;
  Output fade() noexcept;

  Settings settings_;
  double period_s_;
  double amperes_per_Nm_;
  double speed_gain_A_s_rad_;  ///< k_v of the override
  double approach_1_s_;        ///< ω_p
  double braking_rad_s2_;      ///< a
  double margin_rad_;
  double soft_speed_rad_s_;
  double largest_speed_rad_s_;  ///< limit of the construction, which the supply reaches
  double fault_keep_;
  double position_1_s_;
  Pid velocity_;
  Pid torque_;
  JointImpedance impedance_;
  detail::BumplessTransfer transfer_;
  ThermalLimit thermal_;
  JointReference reference_;
  double current_A_ = 0.0;
  bool is_switching_ = false;
};

/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(JointCascade::Limit limit) noexcept;
[[nodiscard]] std::string_view name(JointMode mode) noexcept;

}  // namespace torsio
