#include "torsio/control/joint_cascade.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "control/controller_listing.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "joint cascade";
/// Below a quarter the approach to a limit is overdamped; a fifth leaves room for the delays.
constexpr double kApproachShare = 0.2;
constexpr double kBrakingShare = 0.5;
constexpr double kMaxBandwidthShare = 0.2;  // share of the sample rate, in rad per sample

JointCascade::Settings checked(const JointCascade::Settings& settings, double sample_rate_Hz) {
  settings.drive.check();
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  const double max_rad_s = kMaxBandwidthShare * sample_rate_Hz;
  require_parameter(settings.bandwidth_rad_s > 0.0 && settings.bandwidth_rad_s <= max_rad_s, kPlace,
                    fmt::format("0 < bandwidth_rad_s <= {}", max_rad_s), settings.bandwidth_rad_s);
  require_not_negative(kPlace, "max_unmeasured_load_Nm", settings.limits.max_unmeasured_load_Nm);
  require_not_negative(kPlace, "max_measured_load_Nm", settings.limits.max_measured_load_Nm);
  require_positive(kPlace, "speed_rad_s", settings.limits.speed_rad_s);
  require_parameter(settings.limits.torque_Nm > 0.0, kPlace, "torque_Nm > 0",
                    settings.limits.torque_Nm);
  require_positive(kPlace, "fault_decay_s", settings.fault_decay_s);
  require_positive(kPlace, "transfer_s", settings.transfer_s);
  return settings;
}

JointCascade::Gains gains_of(const JointCascade::Settings& settings) {
  const JointCascade::Gains gains =
      settings.gains.value_or(JointCascade::gains_for(settings.drive, settings.bandwidth_rad_s));
  require_not_negative(kPlace, "position gain", gains.position_1_s);
  return gains;
}

enum class Loop { none, velocity, torque };

Loop loop_of(JointMode mode) noexcept {
  switch (mode) {
    case JointMode::velocity:
    case JointMode::position: return Loop::velocity;
    case JointMode::torque:
    case JointMode::impedance: return Loop::torque;
    case JointMode::current:
    case JointMode::deflection: break;
  }
  return Loop::none;
}

[[noreturn]] void contradict(std::string problem, std::string expected, std::string found) {
  throw Error({.place = kPlace,
               .problem = std::move(problem),
               .expected = std::move(expected),
               .found = std::move(found)});
}

}  // namespace

bool is_finite(const JointReference& reference) noexcept {
  return std::isfinite(reference.position_rad + reference.velocity_rad_s +
                       reference.acceleration_rad_s2 + reference.torque_Nm + reference.current_A +
                       reference.stiffness_Nm_rad + reference.damping_Nms_rad +
                       reference.deflection_rad);
}

JointCascade::Gains JointCascade::gains_for(const Drive& drive, double bandwidth_rad_s) {
  const double speed_gain = drive.inertia() * bandwidth_rad_s / drive.torque_per_current();
  const double slower_1_s = kApproachShare * bandwidth_rad_s;
  return {.position_1_s = slower_1_s,
          .velocity = {.proportional = speed_gain, .integral = slower_1_s * speed_gain},
          .torque = {}};
}

JointCascade::JointCascade(const Settings& settings, double sample_rate_Hz)
    : settings_(checked(settings, sample_rate_Hz)),
      period_s_(1.0 / sample_rate_Hz),
      amperes_per_Nm_(1.0 / settings.drive.torque_per_current()),
      speed_gain_A_s_rad_(settings.drive.inertia() * settings.bandwidth_rad_s * amperes_per_Nm_),
      approach_1_s_(kApproachShare * settings.bandwidth_rad_s),
      braking_rad_s2_(kBrakingShare *
                      (settings.drive.rated_current_A * settings.drive.torque_per_current() -
                       settings.limits.max_unmeasured_load_Nm -
                       settings.limits.max_measured_load_Nm) /
                      settings.drive.inertia()),
      margin_rad_(settings.limits.max_unmeasured_load_Nm /
                  (settings.drive.inertia() * settings.bandwidth_rad_s * approach_1_s_)),
      soft_speed_rad_s_(settings.limits.speed_rad_s -
                        settings.limits.max_unmeasured_load_Nm /
                            (settings.drive.inertia() * settings.bandwidth_rad_s)),
      largest_speed_rad_s_(settings.limits.speed_rad_s),
      fault_keep_(std::exp(-period_s_ / settings.fault_decay_s)),
      position_1_s_(gains_of(settings).position_1_s),
      velocity_({.gains = gains_of(settings).velocity}, sample_rate_Hz),
      torque_(
          {.gains = gains_of(settings).torque, .derivative_cutoff_Hz = settings.torque_cutoff_Hz},
          sample_rate_Hz),
      impedance_({.torque_Nm = settings.limits.torque_Nm, .transfer_s = settings.transfer_s},
                 sample_rate_Hz),
      transfer_(settings.transfer_s, sample_rate_Hz),
      thermal_(settings.drive.rated_current_A, settings.drive.peak_current_A,
               settings.limits.thermal_time_s, sample_rate_Hz) {
  check_limits();
  reset();
}

void JointCascade::check_limits() const {
  const Limits& limits = settings_.limits;
  if (!(braking_rad_s2_ > 0.0))
    contradict(
        "the rated current cannot brake against the load",
        fmt::format("max_unmeasured_load_Nm and max_measured_load_Nm together below {:.4g} Nm",
                    settings_.drive.rated_current_A / amperes_per_Nm_),
        fmt::format("{:.4g} Nm", limits.max_unmeasured_load_Nm + limits.max_measured_load_Nm));
  if (!(soft_speed_rad_s_ > 0.0))
    contradict("the load alone may use up the speed limit",
               fmt::format("a speed above {:.4g} rad/s, or more bandwidth",
                           limits.speed_rad_s - soft_speed_rad_s_),
               fmt::format("{:.4g} rad/s", limits.speed_rad_s));
  if (!(limits.highest_rad - limits.lowest_rad > 2.0 * margin_rad_))
    contradict("no room between the position limits",
               fmt::format("more than {:.4g} rad, twice the margin for the load, between them",
                           2.0 * margin_rad_),
               fmt::format("{:.4g} to {:.4g} rad", limits.lowest_rad, limits.highest_rad));
  const Drive& drive = settings_.drive;
  const double reached_rad_s = drive.supply_V / (drive.torque_constant_Nm_A * drive.ratio);
  if (!(limits.speed_rad_s < reached_rad_s))
    contradict("the supply is below the back-EMF at the speed limit",
               fmt::format("a speed below {:.4g} rad/s with {:.4g} V, or a higher supply",
                           reached_rad_s, drive.supply_V),
               fmt::format("{:.4g} rad/s", limits.speed_rad_s));
  const double largest_rad_s2 =
      settings_.drive.peak_current_A / (amperes_per_Nm_ * settings_.drive.inertia());
  const double needed_A_s =
      speed_gain_A_s_rad_ * (approach_1_s_ * limits.speed_rad_s + largest_rad_s2);
  if (!(limits.current_rate_A_s >= needed_A_s))
    contradict("the current may not move as fast as the limits need it",
               fmt::format("a current rate of at least {:.4g} A/s, or less bandwidth", needed_A_s),
               fmt::format("{:.4g} A/s", limits.current_rate_A_s));
}

void JointCascade::list(ControllerListing& listing) const noexcept {
  thermal_.list(listing);
  ControllerListing::Cascade& own = listing.cascade;
  own.speed_gain_A_s_rad = speed_gain_A_s_rad_;
  own.approach_1_s = approach_1_s_;
  own.braking_rad_s2 = braking_rad_s2_;
  own.margin_rad = margin_rad_;
  own.soft_speed_rad_s = soft_speed_rad_s_;
  own.position_1_s = position_1_s_;
  own.velocity = velocity_.gains();
  own.fault_keep = fault_keep_;
  own.transfer_keep = transfer_.keep();
}

void JointCascade::reset() noexcept {
  velocity_.reset();
  torque_.reset();
  impedance_.reset();
  transfer_.reset();
  reference_ = {};
  current_A_ = 0.0;
  is_switching_ = false;
}

bool JointCascade::set_gains(const Gains& gains) noexcept {
  if (!(gains.position_1_s >= 0.0 && std::isfinite(gains.position_1_s)) ||
      !Pid::is_valid(gains.velocity) || !Pid::is_valid(gains.torque))
    return false;
  position_1_s_ = gains.position_1_s;
  // Both were found valid.
  static_cast<void>(velocity_.set_gains(gains.velocity));
  static_cast<void>(torque_.set_gains(gains.torque));
  is_switching_ = true;
  return true;
}

bool JointCascade::set_motion_limits(double lowest_rad, double highest_rad,
                                     double speed_rad_s) noexcept {
  Limits& limits = settings_.limits;
  const double soft_rad_s = soft_speed_rad_s_ - limits.speed_rad_s + speed_rad_s;
  if (!(speed_rad_s <= largest_speed_rad_s_ && soft_rad_s > 0.0 &&
        highest_rad - lowest_rad > 2.0 * margin_rad_))
    return false;
  limits.lowest_rad = lowest_rad;
  limits.highest_rad = highest_rad;
  limits.speed_rad_s = speed_rad_s;
  soft_speed_rad_s_ = soft_rad_s;
  return true;
}

bool JointCascade::is_usable(const JointReference& reference) const noexcept {
  const bool needs_torque = loop_of(reference.mode) == Loop::torque;
  return reference.mode <= JointMode::impedance && (settings_.has_torque || !needs_torque) &&
         reference.stiffness_Nm_rad >= 0.0 && reference.damping_Nms_rad >= 0.0;
}

double JointCascade::approach(double room_rad) const noexcept {
  const double linear_rad = braking_rad_s2_ / (approach_1_s_ * approach_1_s_);
  if (room_rad <= linear_rad) return approach_1_s_ * room_rad;
  return std::sqrt(2.0 * braking_rad_s2_ * (room_rad - 0.5 * linear_rad));
}

JointCascade::Bounds JointCascade::speed_bounds(double angle_rad) const noexcept {
  const double above_rad = settings_.limits.highest_rad - margin_rad_ - angle_rad;
  const double below_rad = angle_rad - settings_.limits.lowest_rad - margin_rad_;
  return {std::clamp(-approach(below_rad), -soft_speed_rad_s_, soft_speed_rad_s_),
          std::clamp(approach(above_rad), -soft_speed_rad_s_, soft_speed_rad_s_)};
}

// A loop keeps its integral, which contains the load, if the next mode uses the same loop.
void JointCascade::enter(JointMode mode) noexcept {
  if (mode == reference_.mode) return;
  if (loop_of(mode) != loop_of(reference_.mode)) {
    velocity_.reset();
    torque_.reset();
  }
  impedance_.reset();
  is_switching_ = true;
}

void JointCascade::track(double applied_A) noexcept {
  if (!std::isfinite(applied_A)) return;
  double cut_A = applied_A - current_A_;
  current_A_ = applied_A;
  if (is_switching_) return;
  // What is left of a transfer that points against the cut is dropped first.
  const double fading_A = transfer_.pending();
  if (fading_A * cut_A < 0.0) {
    const double dropped_A = std::clamp(cut_A, -std::abs(fading_A), std::abs(fading_A));
    transfer_.add(dropped_A);
    cut_A -= dropped_A;
  }
  const Loop active = loop_of(reference_.mode);
  if (active == Loop::none) return;
  Pid& loop = active == Loop::torque ? torque_ : velocity_;
  loop.track(loop.command() + cut_A);
}

JointCascade::Output JointCascade::fade() noexcept {
  velocity_.reset();
  torque_.reset();
  impedance_.reset();
  transfer_.reset();
  current_A_ *= fault_keep_;
  if (std::abs(current_A_) < 1e-9) current_A_ = 0.0;
  thermal_.step(current_A_);
  is_switching_ = true;
  return {
      .current_A = current_A_, .thermal_load = thermal_.load(), .fault = Fault::input_not_finite};
}

JointCascade::Output JointCascade::step(const JointReference& reference,
                                        const JointState& measured) noexcept {
  Output output;
  const bool is_number = is_finite(reference);
  const bool is_accepted = is_number && is_usable(reference);
  if (is_accepted) {
    enter(reference.mode);
    reference_ = reference;
  }
  const double torque_Nm = settings_.has_torque ? measured.torque_Nm : 0.0;
  const JointState state = {measured.angle_rad, measured.speed_rad_s, torque_Nm};
  if (std::isfinite(state.angle_rad + state.speed_rad_s + state.torque_Nm)) {
    const Bounds speed = speed_bounds(state.angle_rad);
    const double wanted_A = wanted_current(state, speed, output);
    if (std::isfinite(wanted_A)) {
      current_A_ = within_limits(wanted_A, state, speed, output);
      thermal_.step(current_A_);
      output.current_A = current_A_;
      output.thermal_load = thermal_.load();
      if (!is_number) output.fault = Fault::input_not_finite;
    } else {
      output = fade();
    }
  } else {
    output = fade();
  }
  output.is_reference_refused = !is_accepted;
  return output;
}

double JointCascade::impedance_torque(const JointState& measured) noexcept {
  const JointReference& wanted = reference_;
  // Found to be valid where the reference was taken.
  static_cast<void>(impedance_.set_gains({wanted.stiffness_Nm_rad, wanted.damping_Nms_rad}));
  const JointImpedance::Output impedance =
      impedance_.step({wanted.position_rad, wanted.velocity_rad_s, wanted.torque_Nm},
                      {measured.angle_rad, measured.speed_rad_s});
  return impedance.fault == Fault::none ? impedance.torque_Nm : kNotMeasured;
}

double JointCascade::wanted_current(const JointState& measured, const Bounds& speed,
                                    Output& output) noexcept {
  const JointReference& wanted = reference_;
  Pid::Output loop;
  output.feed_forward_A = wanted.current_A;
  switch (wanted.mode) {
    case JointMode::current:
    case JointMode::deflection: break;
    case JointMode::velocity:
    case JointMode::position: {
      const double position_error_rad =
          wanted.mode == JointMode::position ? wanted.position_rad - measured.angle_rad : 0.0;
      output.wanted_velocity_rad_s = std::clamp(
          position_1_s_ * position_error_rad + wanted.velocity_rad_s, speed.lowest, speed.highest);
      output.feed_forward_A +=
          (settings_.drive.inertia() * wanted.acceleration_rad_s2 + wanted.torque_Nm) *
          amperes_per_Nm_;
      loop = velocity_.step(output.wanted_velocity_rad_s, measured.speed_rad_s);
      break;
    }
    case JointMode::torque:
    case JointMode::impedance: {
      const double torque_Nm =
          wanted.mode == JointMode::impedance ? impedance_torque(measured) : wanted.torque_Nm;
      output.wanted_torque_Nm =
          std::clamp(torque_Nm, -settings_.limits.torque_Nm, settings_.limits.torque_Nm);
      output.feed_forward_A += output.wanted_torque_Nm * amperes_per_Nm_;
      loop = torque_.step(output.wanted_torque_Nm, measured.torque_Nm);
      break;
    }
  }
  output.proportional_A = loop.proportional;
  output.integral_A = loop.integral;
  output.derivative_A = loop.derivative;
  const double terms_A = loop.command + output.feed_forward_A;
  if (is_switching_) {
    transfer_.reset();
    transfer_.add(current_A_ - terms_A);
  }
  is_switching_ = false;
  // The loop's own transfer, after a change of its gains, is part of ours.
  const double fading_A = transfer_.step();
  output.transfer_A = fading_A + loop.transfer;
  return terms_A + fading_A;
}

double JointCascade::within_limits(double wanted_A, const JointState& measured, const Bounds& speed,
                                   Output& output) noexcept {
  double current_A = wanted_A;
  const auto cut = [&](double lowest_A, double highest_A, Limit limit) {
    const double inside_A = std::max(std::min(current_A, highest_A), lowest_A);
    if (inside_A != current_A) output.limit = limit;
    current_A = inside_A;
  };
  const double step_A = settings_.limits.current_rate_A_s * period_s_;
  cut(current_A_ - step_A, current_A_ + step_A, Limit::rate);
  const double load_A = measured.torque_Nm * amperes_per_Nm_;
  const auto holding_A = [&](double speed_rad_s) {
    return speed_gain_A_s_rad_ * (speed_rad_s - measured.speed_rad_s) + load_A;
  };
  const bool is_upper = current_A > holding_A(speed.highest);
  const double bound_rad_s = is_upper ? speed.highest : -speed.lowest;
  cut(holding_A(speed.lowest), holding_A(speed.highest),
      bound_rad_s < soft_speed_rad_s_ ? Limit::position : Limit::speed);
  const Drive& drive = settings_.drive;
  const double back_emf_V = drive.torque_constant_Nm_A * drive.ratio * measured.speed_rad_s;
  cut((-drive.supply_V - back_emf_V) / drive.resistance_Ohm,
      (drive.supply_V - back_emf_V) / drive.resistance_Ohm, Limit::voltage);
  const double allowed_A = thermal_.allowed_A();
  cut(-allowed_A, allowed_A, thermal_.is_warm() ? Limit::thermal : Limit::current);
  const Loop active = loop_of(reference_.mode);
  if (output.limit != Limit::none && active != Loop::none) {
    Pid& loop = active == Loop::torque ? torque_ : velocity_;
    loop.track(loop.command() + current_A - wanted_A);
  }
  return current_A;
}

std::string_view name(JointCascade::Limit limit) noexcept {
  using enum JointCascade::Limit;
  switch (limit) {
    case none: return "none";
    case position: return "position";
    case speed: return "speed";
    case rate: return "rate";
    case current: return "current";
    case thermal: return "thermal";
    case voltage: return "voltage";
  }
  return "unknown";
}

std::string_view name(JointMode mode) noexcept {
  using enum JointMode;
  switch (mode) {
    case current: return "current";
    case velocity: return "velocity";
    case position: return "position";
    case torque: return "torque";
    case impedance: return "impedance";
    case deflection: return "deflection";
  }
  return "unknown";
}

}  // namespace torsio
