#include "torsio/control/joint_stop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "joint stop";
/// A current acts during the present tick and, because of the current loop, in the next one.
constexpr double kTicksOfACurrent = 2.0;
/// A brake may be slower than its data sheet: no command before twice its delay.
constexpr double kReleaseMargin = 2.0;

JointStop::Settings checked(const JointStop::Settings& settings, double sample_rate_Hz) {
  settings.drive.check();
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  require_positive(kPlace, "speed_rad_s", settings.speed_rad_s);
  require_positive(kPlace, "deceleration_rad_s2", settings.deceleration_rad_s2);
  require_positive(kPlace, "longest_ramp_s", settings.longest_ramp_s);
  require_positive(kPlace, "standstill_rad_s", settings.standstill_rad_s);
  require_positive(kPlace, "standstill_s", settings.standstill_s);
  require_positive(kPlace, "hold_rad", settings.hold_rad);
  require_positive(kPlace, "brake_static_Nm", settings.brake_static_Nm);
  require_positive(kPlace, "brake_sliding_Nm", settings.brake_sliding_Nm);
  require_not_negative(kPlace, "brake_engage_s", settings.brake_engage_s);
  require_not_negative(kPlace, "brake_release_s", settings.brake_release_s);
  require_not_negative(kPlace, "load_Nm", settings.load_Nm);
  require_positive(kPlace, "takeover_s", settings.takeover_s);
  require_parameter(settings.brake_static_Nm >= settings.brake_sliding_Nm, kPlace,
                    fmt::format("a static torque of the brake of at least the sliding {:.4g} Nm",
                                settings.brake_sliding_Nm),
                    settings.brake_static_Nm);
  if (!(settings.brake_sliding_Nm > settings.load_Nm))
    throw Error({.place = kPlace,
                 .problem = "the brake is weaker than the load",
                 .expected = fmt::format("a sliding torque above the {:.4g} Nm of the load",
                                         settings.load_Nm),
                 .found = fmt::format("{:.4g} Nm", settings.brake_sliding_Nm),
                 .advice = "Reduce the load, or take a stronger brake."});
  const Drive& drive = settings.drive;
  const double strongest_rad_s2 =
      drive.torque_per_current() * drive.rated_current_A / drive.inertia();
  require_parameter(settings.deceleration_rad_s2 <= strongest_rad_s2, kPlace,
                    fmt::format("a deceleration that the rated current makes, up to {:.4g} rad/s2",
                                strongest_rad_s2),
                    settings.deceleration_rad_s2);
  require_parameter(
      settings.speed_rad_s <= settings.deceleration_rad_s2 * settings.longest_ramp_s, kPlace,
      fmt::format("a ramp that ends within longest_ramp_s, from a speed up to {:.4g} rad/s",
                  settings.deceleration_rad_s2 * settings.longest_ramp_s),
      settings.speed_rad_s);
  return settings;
}

bool is_measured(const JointState& state) noexcept {
  return std::isfinite(state.angle_rad + state.speed_rad_s);
}

}  // namespace

JointStop::JointStop(const Settings& settings, double sample_rate_Hz)
    : settings_(checked(settings, sample_rate_Hz)), period_s_(1.0 / sample_rate_Hz) {}

void JointStop::trigger(StopCategory category) noexcept {
  const bool is_stopping = phase_ != Phase::running && phase_ != Phase::releasing;
  if ((is_stopping || is_triggered_) && category >= category_) return;
  category_ = category;
  if (!is_stopping) is_triggered_ = true;
  if (category == StopCategory::power_off) {
    if (!is_stopping) {
      begin(Phase::ramping);           // resets the clocks; off in this very tick
      last_angle_rad_ = kNotMeasured;  // the work of the current before the trigger is not counted
    }
    is_triggered_ = false;
    begin(Phase::off);
  } else if (phase_ == Phase::holding) {
    begin(Phase::engaging);
  }
}

bool JointStop::release() noexcept {
  const bool is_stopped = phase_ == Phase::off || phase_ == Phase::holding;
  if (!is_stopped || !(slow_s_ >= settings_.standstill_s)) return false;
  begin(phase_ == Phase::holding ? Phase::running : Phase::releasing);
  has_escalated_ = false;
  load_Nm_ = last_Nm_;
  hold_rad_ = last_angle_rad_;
  return true;
}

void JointStop::begin(Phase phase) noexcept {
  if (phase == Phase::ramping) {
    since_s_ = 0.0;
    work_J_ = 0.0;
    has_escalated_ = false;
  }
  phase_ = phase;
  phase_s_ = 0.0;
}

void JointStop::escalate() noexcept {
  has_escalated_ = true;
  begin(Phase::off);
}

bool JointStop::is_under_power() const noexcept {
  return phase_ == Phase::ramping || phase_ == Phase::engaging || phase_ == Phase::holding ||
         phase_ == Phase::releasing;
}

void JointStop::advance(const JointState& measured) noexcept {
  const bool is_lost = !(std::abs(measured.angle_rad - hold_rad_) <= settings_.hold_rad);
  switch (phase_) {
    case Phase::running:
    case Phase::off: return;
    case Phase::ramping:
      if (slow_s_ >= settings_.standstill_s) {
        hold_rad_ = measured.angle_rad;
        begin(category_ == StopCategory::ramp_and_hold ? Phase::holding : Phase::engaging);
      } else if (since_s_ >= settings_.longest_ramp_s) {
        escalate();
      }
      return;
    case Phase::engaging:
      if (is_lost)
        escalate();
      else if (phase_s_ >= settings_.brake_engage_s)
        begin(Phase::off);
      return;
    case Phase::holding:
      if (is_lost) escalate();
      return;
    case Phase::releasing:
      if (is_lost)
        escalate();
      else if (phase_s_ >= settings_.takeover_s + kReleaseMargin * settings_.brake_release_s)
        begin(Phase::running);
      return;
  }
}

void JointStop::watch(const JointState& measured) noexcept {
  if (!is_measured(measured)) {
    slow_s_ = 0.0;
    last_angle_rad_ = kNotMeasured;
    if (is_under_power()) escalate();
    return;
  }
  const bool is_slow = std::abs(measured.speed_rad_s) <= settings_.standstill_rad_s;
  slow_s_ = is_slow ? slow_s_ + period_s_ : 0.0;
  if (std::isfinite(last_angle_rad_))
    work_J_ +=
        settings_.drive.torque_per_current() * applied_A_ * (measured.angle_rad - last_angle_rad_);
  last_angle_rad_ = measured.angle_rad;
  if (std::isfinite(measured.torque_Nm)) last_Nm_ = measured.torque_Nm;
}

JointReference JointStop::reference(const JointReference& wanted,
                                    const JointState& measured) noexcept {
  watch(measured);
  if (is_triggered_) {
    is_triggered_ = false;
    begin(Phase::ramping);
    slow_s_ = 0.0;
    start_rad_s_ = measured.speed_rad_s;
    if (!is_measured(measured)) escalate();  // no ramp without a speed
  }
  advance(measured);
  since_s_ += period_s_;
  phase_s_ += period_s_;
  switch (phase_) {
    case Phase::running: return wanted;
    case Phase::off: return {.mode = JointMode::current};
    case Phase::ramping: {
      const double left_rad_s = std::abs(start_rad_s_) - settings_.deceleration_rad_s2 * phase_s_;
      if (!(left_rad_s > 0.0)) return {.mode = JointMode::velocity};
      return {.mode = JointMode::velocity,
              .velocity_rad_s = std::copysign(left_rad_s, start_rad_s_),
              .acceleration_rad_s2 = -std::copysign(settings_.deceleration_rad_s2, start_rad_s_)};
    }
    case Phase::releasing: return {.mode = JointMode::velocity, .torque_Nm = load_Nm_};
    case Phase::engaging:
    case Phase::holding: break;
  }
  // The integral of the speed is the position: it does not creep against dry friction.
  return {.mode = JointMode::velocity};
}

// A torque s tau moves the rotor by w t + (s tau - tau_spring) t^2 / (2 J) while the current acts, so that also a
// current against the motion does positive work where it reverses it. The share s is the largest one with
//
//     s tau (w t + (s tau - tau_spring) t^2 / (2 J)) <= -W
double JointStop::limited(double current_A, const JointState& measured) const noexcept {
  const double torque_Nm = settings_.drive.torque_per_current() * current_A;
  const double time_s = kTicksOfACurrent * period_s_;
  const double travel_per_Nm = 0.5 * time_s * time_s / settings_.drive.inertia();
  const double spring_Nm = std::isfinite(measured.torque_Nm) ? measured.torque_Nm : 0.0;
  const double square_J = torque_Nm * torque_Nm * travel_per_Nm;
  const double line_J = torque_Nm * (measured.speed_rad_s * time_s - spring_Nm * travel_per_Nm);
  const double budget_J = std::max(-work_J_, 0.0);
  if (!(square_J + line_J > budget_J)) return current_A;
  const double root_J = std::sqrt(line_J * line_J + 4.0 * square_J * budget_J);
  // The root of the quadratic equation, without a difference of nearly equal numbers.
  const double share =
      line_J > 0.0 ? 2.0 * budget_J / (line_J + root_J) : (root_J - line_J) / (2.0 * square_J);
  return current_A * std::min(1.0, std::isfinite(share) ? share : 0.0);
}

JointStop::Output JointStop::step(double current_A, const JointState& measured,
                                  Fault fault) noexcept {
  if (fault != Fault::none && is_under_power()) escalate();
  Output output = {.current_A = std::isfinite(current_A) ? current_A : 0.0,
                   .phase = phase_,
                   .speed_rad_s = measured.speed_rad_s,
                   .spring_Nm = measured.torque_Nm,
                   .is_drive_at_rest = slow_s_ >= settings_.standstill_s,
                   .has_escalated = has_escalated_};
  if (phase_ == Phase::off) {
    output.current_A = 0.0;
    output.is_powered = false;
  } else if (phase_ != Phase::running && phase_ != Phase::releasing) {
    output.current_A = limited(output.current_A, measured);
  }
  const bool is_taking_over = phase_ == Phase::releasing && phase_s_ <= settings_.takeover_s;
  output.is_brake_open = phase_ != Phase::off && phase_ != Phase::engaging && !is_taking_over;
  output.is_current_cut = output.current_A != current_A;
  if (phase_ != Phase::running) {
    output.since_s = since_s_;
    output.motor_work_J = work_J_;
  }
  applied_A_ = output.current_A;
  return output;
}

std::string_view name(StopCategory category) noexcept {
  switch (category) {
    case StopCategory::power_off: return "power_off";
    case StopCategory::ramp_and_brake: return "ramp_and_brake";
    case StopCategory::ramp_and_hold: return "ramp_and_hold";
  }
  return "unknown";
}

std::string_view name(JointStop::Phase phase) noexcept {
  using enum JointStop::Phase;
  switch (phase) {
    case running: return "running";
    case ramping: return "ramping";
    case engaging: return "engaging";
    case holding: return "holding";
    case off: return "off";
    case releasing: return "releasing";
  }
  return "unknown";
}

}  // namespace torsio
