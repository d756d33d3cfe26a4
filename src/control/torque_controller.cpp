#include "torsio/control/torque_controller.hpp"

#include <fmt/format.h>

#include "control/controller_listing.hpp"
#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "torque controller";
constexpr double kTransfer_s = 0.1;  // as that of the deflection controller

bool acts_on_speed(const TorqueLoopCore::Settings& settings) {
  return settings.deflection.actuation == DeflectionController::Actuation::velocity;
}

TorqueLoopCore::Settings checked(const TorqueLoopCore::Settings& settings) {
  if (acts_on_speed(settings) && (settings.observer_cutoff_Hz || settings.feeds_rate_forward))
    throw Error({.place = kPlace,
                 .problem = "the deflection controller acts on the speed",
                 .expected = "no disturbance observer and no feed-forward of the rate",
                 .advice = "Leave both out, or let it act on the current."});
  require_parameter(settings.largest_torque_Nm > 0.0, kPlace, "largest_torque_Nm > 0",
                    settings.largest_torque_Nm);
  if (settings.friction) {
    require_parameter(settings.friction->share >= 0.0 && settings.friction->share <= 1.0, kPlace,
                      "a friction share from 0 to 1", settings.friction->share);
    require_positive(kPlace, "speed_rad_s of the friction", settings.friction->speed_rad_s);
  }
  return settings;
}

}  // namespace

TorqueLoopCore::TorqueLoopCore(const Settings& settings, double sample_rate_Hz)
    : settings_(checked(settings)),
      deflection_(settings.deflection, sample_rate_Hz),
      transfer_(kTransfer_s, sample_rate_Hz),
      wanted_rate_(sample_rate_Hz, settings.deflection.rate_cutoff_Hz),
      amperes_per_Nm_(1.0 / settings.deflection.joint.drive.torque_per_current()) {
  if (!settings.observer_cutoff_Hz) return;
  observer_.emplace(settings.deflection.joint, *settings.observer_cutoff_Hz, sample_rate_Hz);
  check_stability();
}

JointFeedback TorqueLoopCore::feedback() const {
  const JointFeedback loop = deflection_.feedback();
  return observer_ ? observer_->with(loop) : loop;
}

Margins TorqueLoopCore::margins_of(JointOutput output) const {
  return margins(open_loop(settings_.deflection.joint, feedback(), output));
}

void TorqueLoopCore::list(ControllerListing& listing) const noexcept {
  deflection_.list(listing);
  listing.largest_torque_Nm = settings_.largest_torque_Nm;
  listing.torque_transfer_keep = transfer_.keep();
}

void TorqueLoopCore::check_stability() const {
  for (const JointOutput output : {JointOutput::locked, JointOutput::free})
    require_stable(kPlace, open_loop(settings_.deflection.joint, feedback(), output), output);
}

void TorqueLoopCore::reset() noexcept {
  deflection_.reset();
  if (observer_) observer_->reset();
  wanted_rate_.reset();
  transfer_.reset();
  wanted_Nm_ = 0.0;
  is_refused_ = false;
  is_returning_ = false;
  added_A_ = 0.0;
  applied_ = 0.0;
}

bool TorqueLoopCore::set_largest_torque(double torque_Nm) noexcept {
  if (!(torque_Nm > 0.0)) return false;
  settings_.largest_torque_Nm = torque_Nm;
  return true;
}

double TorqueLoopCore::accept(double wanted_Nm, bool is_planned) noexcept {
  is_planned_ = is_planned;
  is_refused_ = !std::isfinite(wanted_Nm);
  if (!is_refused_)
    wanted_Nm_ = std::clamp(wanted_Nm, -settings_.largest_torque_Nm, settings_.largest_torque_Nm);
  return wanted_Nm_;
}

TorqueLoopCore::Output TorqueLoopCore::step(const Estimate& wanted_rad,
                                            const JointSample& sample) noexcept {
  const Drive& drive = settings_.deflection.joint.drive;
  const double deflection_rad = sample.spring_deflection_rad();
  const bool is_measured =
      std::isfinite(deflection_rad) && (!observer_ || std::isfinite(sample.motor_angle_rad));
  const DeflectionController::Output loop =
      deflection_.step(wanted_rad.value, is_measured ? deflection_rad : kNotMeasured);
  const bool is_speed = acts_on_speed(settings_);
  Output output = {.wanted_torque_Nm = wanted_Nm_,
                   .wanted_deflection_rad = loop.wanted_deflection_rad,
                   .proportional_A = is_speed ? 0.0 : loop.proportional,
                   .integral_A = is_speed ? 0.0 : loop.integral,
                   .derivative_A = is_speed ? 0.0 : loop.derivative,
                   .feed_forward_A = is_speed ? 0.0 : loop.feed_forward,
                   .transfer_A = is_speed ? 0.0 : loop.transfer,
                   .is_limited = loop.is_limited,
                   .inverse = wanted_rad.fault,
                   .fault = is_refused_ ? Fault::input_not_finite : loop.fault};
  if (!is_planned_) wanted_rate_.reset();
  const double rate_rad_s =
      wanted_rate_.step(wanted_Nm_) / settings_.deflection.joint.stiffness_Nm_rad;
  if (loop.is_fading) return fade(output);
  if (const auto& friction = settings_.friction)
    output.friction_A = friction->share * amperes_per_Nm_ *
                        (drive.coulomb_Nm * std::tanh(rate_rad_s / friction->speed_rad_s) +
                         drive.viscous_Nms_rad * rate_rad_s);
  if (settings_.feeds_rate_forward)
    output.rate_feed_forward_A = deflection_.gains().derivative * rate_rad_s;
  if (observer_)
    output.observer_A = observer_->step(applied_, sample.motor_angle_rad, deflection_rad);
  const double terms_A = output.rate_feed_forward_A + output.friction_A + output.observer_A;
  // The loop itself continues from the current that was applied; the other terms fade in.
  if (is_returning_) transfer_.add(-terms_A);
  is_returning_ = false;
  const double fading_A = transfer_.step();
  output.transfer_A += fading_A;
  added_A_ = terms_A + fading_A;
  const double all_A = is_speed ? added_A_ : loop.command + added_A_;
  if (!std::isfinite(all_A)) return fade(output);
  output.current_A = std::clamp(all_A, -drive.peak_current_A, drive.peak_current_A);
  output.is_limited = output.is_limited || output.current_A != all_A;
  if (is_speed) {
    output.speed_rad_s = loop.command;
    applied_ = loop.command;
    return output;
  }
  if (output.current_A != all_A) deflection_.track(output.current_A - added_A_);
  applied_ = output.current_A;
  return output;
}

void TorqueLoopCore::track(double applied) noexcept {
  deflection_.track(acts_on_speed(settings_) ? applied : applied - added_A_);
}

void TorqueLoopCore::set_motor_current(double current_A) noexcept {
  if (std::isfinite(current_A) && !acts_on_speed(settings_)) applied_ = current_A;
}

// The whole current fades, not the deflection controller's part of it.
TorqueLoopCore::Output TorqueLoopCore::fade(Output output) noexcept {
  if (observer_) observer_->reset();
  transfer_.reset();
  is_returning_ = true;
  applied_ = deflection_.fade(applied_);
  const bool is_speed = acts_on_speed(settings_);
  return {.current_A = is_speed ? 0.0 : applied_,
          .speed_rad_s = is_speed ? applied_ : 0.0,
          .wanted_torque_Nm = output.wanted_torque_Nm,
          .wanted_deflection_rad = output.wanted_deflection_rad,
          .inverse = output.inverse,
          .fault = Fault::input_not_finite};
}

}  // namespace torsio
