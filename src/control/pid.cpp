#include "torsio/control/pid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "control/controller_systems.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "pid";

double checked_rate(double sample_rate_Hz) {
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  return sample_rate_Hz;
}

double checked_time(const char* name, double time_s) {
  require_positive(kPlace, name, time_s);
  return time_s;
}

}  // namespace

bool Pid::is_valid(const Gains& gains) noexcept {
  return gains.proportional >= 0.0 && gains.integral >= 0.0 && gains.derivative >= 0.0 &&
         std::isfinite(gains.proportional) && std::isfinite(gains.integral) &&
         std::isfinite(gains.derivative);
}

Pid::Pid(const Settings& settings, double sample_rate_Hz)
    : gains_(settings.gains),
      limits_(settings.limits),
      anti_windup_(settings.anti_windup),
      derivative_of_(settings.derivative_of),
      tracking_s_(settings.tracking_s),
      period_s_(1.0 / checked_rate(sample_rate_Hz)),
      step_limit_(settings.limits.rate_per_s * period_s_),
      differentiator_(sample_rate_Hz, settings.derivative_cutoff_Hz),
      transfer_(checked_time("transfer_s", settings.transfer_s), sample_rate_Hz) {
  require_not_negative(kPlace, "proportional gain", gains_.proportional);
  require_not_negative(kPlace, "integral gain", gains_.integral);
  require_not_negative(kPlace, "derivative gain", gains_.derivative);
  require_parameter(limits_.lowest < limits_.highest, kPlace,
                    fmt::format("a highest command above the lowest, {}", limits_.lowest),
                    limits_.highest);
  require_parameter(limits_.rate_per_s > 0.0, kPlace, "rate_per_s > 0", limits_.rate_per_s);
  if (tracking_s_) require_positive(kPlace, "tracking_s", *tracking_s_);
  set_tracking_share();
  reset();
}

// Never more than the whole way in one tick, or the integral would overshoot what it tracks.
void Pid::set_tracking_share() noexcept {
  if (!(gains_.integral > 0.0)) {
    tracking_share_ = 0.0;  // an integral that no error moves has nothing to unwind
    return;
  }
  const double tracking_s = tracking_s_.value_or(gains_.proportional / gains_.integral);
  tracking_share_ = period_s_ / std::max(tracking_s, period_s_);
}

void Pid::reset() noexcept {
  start(0.0);
  is_starting_ = false;
}

void Pid::start(double command) noexcept {
  differentiator_.reset();
  transfer_.reset();
  last_ = {.command = std::clamp(command, limits_.lowest, limits_.highest)};
  integral_ = 0.0;
  rate_ = 0.0;
  error_ = 0.0;
  increment_ = 0.0;
  is_starting_ = true;
}

double Pid::limited(double command) const noexcept {
  const double moved =
      std::clamp(command, last_.command - step_limit_, last_.command + step_limit_);
  return std::clamp(moved, limits_.lowest, limits_.highest);
}

Pid::Output Pid::step(double reference, double measurement, double feed_forward) noexcept {
  const double error = reference - measurement;
  if (!std::isfinite(error + feed_forward)) return hold();
  rate_ = differentiator_.step(derivative_of_ == DerivativeOf::error ? error : -measurement);
  Output output = {.proportional = gains_.proportional * error,
                   .integral = integral_,
                   .derivative = gains_.derivative * rate_,
                   .feed_forward = feed_forward};
  const double terms =
      output.proportional + output.integral + output.derivative + output.feed_forward;
  if (is_starting_) transfer_.add(last_.command - terms);
  output.transfer = transfer_.step();
  const double wanted = terms + output.transfer;
  if (!std::isfinite(wanted)) {
    start(last_.command);
    return hold();
  }
  is_starting_ = false;
  output.command = limited(wanted);
  output.is_limited = output.command != wanted;
  last_ = output;
  error_ = error;
  integrate(wanted);
  return output;
}

Pid::Output Pid::hold() noexcept {
  differentiator_.skip();
  Output held = last_;
  held.fault = Fault::input_not_finite;
  return held;
}

void Pid::integrate(double wanted) noexcept {
  increment_ = period_s_ * gains_.integral * error_;
  const double excess = wanted - last_.command;
  if (anti_windup_ == AntiWindup::conditional) {
    if (increment_ * excess > 0.0) increment_ = 0.0;
    integral_ += increment_;
  } else {
    integral_ += increment_ - tracking_share_ * excess;
  }
}

void Pid::track(double applied) noexcept {
  if (!std::isfinite(applied)) return;
  const double excess = last_.command - applied;
  if (anti_windup_ == AntiWindup::back_calculation) {
    integral_ -= tracking_share_ * excess;
  } else if (increment_ * excess > 0.0) {
    integral_ -= increment_;
    increment_ = 0.0;
  }
  last_.command = applied;
}

bool Pid::set_gains(const Gains& gains) noexcept {
  if (!is_valid(gains)) return false;
  transfer_.add((gains_.proportional - gains.proportional) * error_ +
                (gains_.derivative - gains.derivative) * rate_);
  gains_ = gains;
  set_tracking_share();
  return true;
}

LinearSystem linear_pid(const Pid::Gains& gains, double derivative_cutoff_Hz,
                        double sample_rate_Hz) {
  const auto gain = [&](double value) { return LinearSystem::gain(value, sample_rate_Hz); };
  LinearSystem all = gain(gains.proportional);
  if (gains.integral > 0.0)
    all = all + gain(gains.integral) * LinearSystem::integrator(sample_rate_Hz);
  if (gains.derivative > 0.0)
    all = all +
          gain(gains.derivative) * (LinearSystem::lowpass(derivative_cutoff_Hz, sample_rate_Hz) *
                                    LinearSystem::difference(sample_rate_Hz));
  return all;
}

}  // namespace torsio
