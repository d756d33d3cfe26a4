#pragma once

#include <cstdint>
#include <string_view>

#include "torsio/control/joint_cascade.hpp"

namespace torsio {

/// The stop categories of IEC 60204-1.
enum class StopCategory : std::uint8_t {
  power_off,       ///< 0: the power is removed at once, and the brake closes
  ramp_and_brake,  ///< 1: under power to rest, then the brake, then the power is removed
  ramp_and_hold,   ///< 2: under power to rest, and held there under power
};

/// Brings a joint to rest, on request, between its controller and its drive:
///
///     reference -> `reference` -> JointCascade or JointController -> `step` -> drive and brake
///
/// Categories 1 and 2 lower the speed of the drive at a constant rate and then hold it, by the
/// controller's velocity mode (its integral holds the position). From the trigger on the current
/// adds no energy: with
///
///     W = Σ N k_t i Δθ   over all ticks since the trigger
///
/// a current that would do positive work is reduced so that W stays <= 0, as far as the rotor moves as its inertia
/// and the measured torque of the spring predict for the two ticks in which a current acts. With friction and play
/// W was at most 2 % of the energy in motion in 300 random stops (test `DoesNoWorkInRandomStops`). As far as the current of
/// the motor is the commanded one, the energy of rotor, spring, link and load then stays below that at
/// the trigger plus the work of external forces (a passivity observer and controller, Hannaford &
/// Ryu 2002). A load that was being lifted is therefore stopped by its weight, and sinks a little
/// before the motor holds it.
///
/// A category 1 or 2 becomes category 0 if the drive is not at rest in time, if it leaves the
/// position that it holds, or on any fault of the measurements or of the controller. A stop is
/// latched, and only a lower category can replace it. After `release` the motor takes over the load
/// that the spring measures before the brake opens.
///
/// What is reported is measured, never assumed: `Output::is_drive_at_rest` comes from the speed, also
/// when the power is off. It is the drive that rests: a link after a spring may still swing
/// (`Output::spring_Nm`). All functions are called by one thread.
class JointStop {
 public:
  struct Settings {
    Drive drive = {};
    double speed_rad_s = 0.0;          ///< largest speed of the drive, of the rotor over the ratio
    double deceleration_rad_s2 = 0.0;  ///< rate of the ramp, rotor over the ratio
    double longest_ramp_s = 1.0;       ///< until the power is removed
    double standstill_rad_s = 0.01;    ///< slower than this, for `standstill_s`, is at rest
    double standstill_s = 0.02;
    double hold_rad = 0.05;         ///< farther than this from the position of rest is category 0
    double brake_static_Nm = 0.0;   ///< referred to the joint
    double brake_sliding_Nm = 0.0;  ///< referred to the joint
    double brake_engage_s = 0.0;
    double brake_release_s = 0.0;
    double load_Nm = 0.0;     ///< the largest torque that pulls at the joint at rest: gravity
    double takeover_s = 0.5;  ///< before the brake opens: several times the controller's transfer
  };

  enum class Phase : std::uint8_t {
    running,    ///< no stop
    ramping,    ///< to rest, under power
    engaging,   ///< at rest, under power until the brake has closed
    holding,    ///< at rest, under power
    off,        ///< no power, the brake closes or is closed
    releasing,  ///< the motor takes over the load, then the brake opens
  };

  struct Output {
    double current_A = 0.0;  ///< for the drive
    bool is_powered = true;
    bool is_brake_open = true;    ///< command to the coil
    bool is_current_cut = false;  ///< by this class: call the controller's `track(current_A)`
    Phase phase = Phase::running;
    double speed_rad_s = kNotMeasured;  ///< measured, of the drive
    double spring_Nm = kNotMeasured;    ///< measured
    bool is_drive_at_rest = false;      ///< measured
    double since_s = 0.0;               ///< since the trigger
    double motor_work_J = 0.0;          ///< W
    bool has_escalated = false;         ///< a category 1 or 2 has become category 0
  };

  /// @throws Error if the drive is impossible, a time, the deceleration or a torque of the brake is
  /// not positive, the ramp from the largest speed takes longer than `longest_ramp_s` or needs more
  /// than the rated current, or the brake is too weak: its sliding torque below the load, or its
  /// static torque below the sliding one.
  JointStop(const Settings& settings, double sample_rate_Hz);

  /// Category 0 acts in the next `step`, the others from the next `reference` on. Of two stops the
  /// lower category is executed.
  void trigger(StopCategory category) noexcept TORSIO_REALTIME;
  /// Ends a stop whose drive is at rest. @returns false, and nothing changes, if it is not
  [[nodiscard]] bool release() noexcept TORSIO_REALTIME;

  /// @returns what the controller gets in place of the wanted reference
  JointReference reference(const JointReference& wanted,
                           const JointState& measured) noexcept TORSIO_REALTIME;
  /// @param current_A of the controller in this tick; one that is not finite is taken as 0 A
  /// @param fault of the controller in this tick
  Output step(double current_A, const JointState& measured,
              Fault fault = Fault::none) noexcept TORSIO_REALTIME;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 private:
  void begin(Phase phase) noexcept;
  void escalate() noexcept;
  void advance(const JointState& measured) noexcept;
  void watch(const JointState& measured) noexcept;
  [[nodiscard]] bool is_under_power() const noexcept;
  [[nodiscard]] double limited(double current_A, const JointState& measured) const noexcept;

  Settings settings_;
  double period_s_;
  Phase phase_ = Phase::running;
  StopCategory category_ = StopCategory::ramp_and_hold;
  bool is_triggered_ = false;  ///< the next `reference` begins the stop
  bool has_escalated_ = false;
  double since_s_ = 0.0;
  double phase_s_ = 0.0;
  double start_rad_s_ = 0.0;  ///< speed at the trigger
  double hold_rad_ = 0.0;     ///< angle of rest
  double load_Nm_ = 0.0;      ///< torque of the spring at `release`
  double slow_s_ = 0.0;       ///< how long the drive has been slow
  double work_J_ = 0.0;
  double applied_A_ = 0.0;
  double last_angle_rad_ = kNotMeasured;
  double last_Nm_ = 0.0;  ///< the last measured torque of the spring
};

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(StopCategory category) noexcept;
[[nodiscard]] std::string_view name(JointStop::Phase phase) noexcept;

}  // namespace torsio
