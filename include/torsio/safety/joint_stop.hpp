#pragma once

#include <cstdint>
#include <string_view>

#include "torsio/control/joint_cascade.hpp"

namespace torsio {

/// Stop categories as builders of machines use them (IEC 60204-1).
enum class StopCategory : std::uint8_t {
  power_off,       ///< 0: the power is removed at once, and the brake closes
  ramp_and_brake,  ///< 1: under power to rest, then the brake, then the power is removed
  ramp_and_hold,   ///< 2: under power to rest, and held there under power
};

/// Brings a joint to rest, on request, between its controller and its drive:
///
///     reference -> `reference` -> JointCascade or JointController -> `step` -> drive and brake
///
/// Categories 1 and 2 lower the speed of the motor side at a constant rate and then hold it, by the
/// controller's velocity mode (its integral holds the position). From the trigger on **the motor adds no energy**: with
///
///     W = Σ N k_t i Δθ   over all ticks since the trigger
///
/// a current that works with the motion is limited to what keeps W <= 0, so that the energy of
/// rotor, spring, link and load stays below that at the trigger plus the work of external forces (a
/// passivity observer and controller, Hannaford & Ryu 2002). A load that was being lifted therefore
/// stops by its weight, and sinks a little before the motor holds it.
///
/// A category 1 or 2 becomes category 0 if the joint is not at rest in time, or if a measurement is
/// not finite. A stop is latched, and only a lower category can replace it; after `release` the
/// motor holds the joint until the brake has opened. What is reported is measured, never assumed:
/// `Output::is_at_rest` comes from the speed, also when the power is off.
class JointStop {
 public:
  struct Settings {
    Drive drive = {};
    double deceleration_rad_s2 = 0.0;  ///< rate of the ramp, motor side over the ratio
    double longest_ramp_s = 1.0;       ///< until the power is removed
    double standstill_rad_s = 0.01;    ///< slower than this, for `standstill_s`, is at rest
    double standstill_s = 0.02;
    double brake_static_Nm = 0.0;   ///< referred to the joint
    double brake_sliding_Nm = 0.0;  ///< referred to the joint
    double brake_engage_s = 0.0;
    double brake_release_s = 0.0;
    double load_Nm = 0.0;  ///< the largest torque that pulls at the joint at rest: gravity
  };

  enum class Phase : std::uint8_t {
    running,    ///< no stop
    ramping,    ///< to rest, under power
    engaging,   ///< at rest, under power until the brake has closed
    holding,    ///< at rest, under power
    off,        ///< no power, the brake closes or is closed
    releasing,  ///< the brake opens, the motor holds
  };

  struct Output {
    double current_A = 0.0;  ///< for the drive
    bool is_powered = true;
    bool is_brake_open = true;    ///< command to the coil
    bool is_current_cut = false;  ///< by this class: call the controller's `track(current_A)`
    Phase phase = Phase::running;
    double speed_rad_s = kNotMeasured;  ///< measured, of the motor side
    bool is_at_rest = false;            ///< measured
    double since_s = 0.0;               ///< since the trigger
    double motor_work_J = 0.0;          ///< W
    bool has_escalated = false;         ///< a category 1 or 2 has become category 0
  };

  /// @throws Error if the drive is impossible, a time, the deceleration or a torque of the brake is
  /// not positive, or the brake is too weak: its sliding torque below the load, or its static torque
  /// below the sliding one.
  JointStop(const Settings& settings, double sample_rate_Hz);

  /// From the next `reference` on. Of two stops the lower category is executed.
  void trigger(StopCategory category) noexcept TORSIO_REALTIME;
  /// Ends a stop whose joint is at rest. @returns false, and nothing changes, if it is not
  [[nodiscard]] bool release() noexcept TORSIO_REALTIME;

  /// @returns what the controller gets in place of the wanted reference
  JointReference reference(const JointReference& wanted,
                           const JointState& measured) noexcept TORSIO_REALTIME;
  /// @param current_A of the controller in this tick; one that is not finite is none
  Output step(double current_A, const JointState& measured) noexcept TORSIO_REALTIME;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 private:
  void begin(Phase phase) noexcept;
  void advance() noexcept;
  void watch(const JointState& measured) noexcept;
  [[nodiscard]] double limited(double current_A, double speed_rad_s) const noexcept;

  Settings settings_;
  double period_s_;
  Phase phase_ = Phase::running;
  StopCategory category_ = StopCategory::ramp_and_hold;
  bool is_triggered_ = false;  ///< the next `reference` begins the stop
  bool has_escalated_ = false;
  double since_s_ = 0.0;
  double phase_s_ = 0.0;
  double start_rad_s_ = 0.0;  ///< speed at the trigger
  double slow_s_ = 0.0;       ///< how long the joint has been slow
  double work_J_ = 0.0;
  double applied_A_ = 0.0;
  double last_angle_rad_ = kNotMeasured;
};

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(StopCategory category) noexcept;
[[nodiscard]] std::string_view name(JointStop::Phase phase) noexcept;

}  // namespace torsio
