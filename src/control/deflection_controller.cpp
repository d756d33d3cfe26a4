#include "torsio/control/deflection_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "control/controller_listing.hpp"
#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "deflection controller";

DeflectionController::Settings checked(const DeflectionController::Settings& settings,
                                       double sample_rate_Hz) {
  settings.joint.check();
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  require_positive(kPlace, "bandwidth_rad_s", settings.bandwidth_rad_s);
  require_positive(kPlace, "damping", settings.damping);
  require_not_negative(kPlace, "integral_1_s", settings.integral_1_s);
  require_positive(kPlace, "largest_deflection_rad", settings.largest_deflection_rad);
  require_positive(kPlace, "fault_decay_s", settings.fault_decay_s);
  if (!Pid::is_valid(settings.speed_loop))
    throw Error({.place = kPlace, .expected = "gains of the speed loop >= 0 and finite"});
  return settings;
}

Pid::Settings pid_settings(const DeflectionController::Settings& settings) {
  const bool is_current = settings.actuation == DeflectionController::Actuation::current;
  const double largest =
      is_current ? settings.joint.drive.peak_current_A : std::numeric_limits<double>::infinity();
  return {.gains = settings.gains ? *settings.gains : DeflectionController::gains_for(settings),
          .limits = {.lowest = -largest, .highest = largest},
          .anti_windup = settings.anti_windup,
          .derivative_cutoff_Hz = settings.rate_cutoff_Hz};
}

}  // namespace

Pid::Gains DeflectionController::gains_for(const Settings& settings) {
  if (settings.actuation == Actuation::velocity) return {.proportional = settings.bandwidth_rad_s};
  const Drive& drive = settings.joint.drive;
  const double stiffest_Nm_rad =
      drive.inertia() * settings.bandwidth_rad_s * settings.bandwidth_rad_s;
  if (!(settings.joint.stiffness_Nm_rad < stiffest_Nm_rad))
    throw Error({.place = kPlace,
                 .problem = "the spring alone is faster than the loop's bandwidth",
                 .expected = fmt::format("a stiffness below {:.4g} Nm/rad", stiffest_Nm_rad),
                 .found = fmt::format("{:.4g} Nm/rad", settings.joint.stiffness_Nm_rad),
                 .advice = "Take a higher bandwidth."});
  const double proportional =
      (stiffest_Nm_rad - settings.joint.stiffness_Nm_rad) / drive.torque_per_current();
  return {.proportional = proportional,
          .integral = settings.integral_1_s * proportional,
          .derivative = 2.0 * settings.damping * settings.bandwidth_rad_s * drive.inertia() /
                        drive.torque_per_current()};
}

DeflectionController::DeflectionController(const Settings& settings, double sample_rate_Hz)
    : settings_(checked(settings, sample_rate_Hz)),
      sample_rate_Hz_(sample_rate_Hz),
      feed_forward_A_rad_(settings.actuation == Actuation::current
                              ? settings.joint.stiffness_Nm_rad /
                                    settings.joint.drive.torque_per_current()
                              : 0.0),
      fault_keep_(std::exp(-1.0 / (settings.fault_decay_s * sample_rate_Hz))),
      pid_(pid_settings(settings_), sample_rate_Hz),
      wanted_rate_(sample_rate_Hz, settings.rate_cutoff_Hz) {
  check_stability();
}

void DeflectionController::check_stability() const {
  for (const JointOutput output : {JointOutput::locked, JointOutput::free})
    require_stable(kPlace, open_loop(settings_.joint, feedback(), output), output);
}

void DeflectionController::reset() noexcept {
  pid_.reset();
  wanted_rate_.reset();
  wanted_rad_ = 0.0;
}

DeflectionController::Output DeflectionController::step(double wanted_rad,
                                                        double deflection_rad) noexcept {
  Output output;
  if (std::isfinite(wanted_rad)) {
    wanted_rad_ =
        std::clamp(wanted_rad, -settings_.largest_deflection_rad, settings_.largest_deflection_rad);
    output.is_limited = wanted_rad_ != wanted_rad;
  } else {
    output.fault = Fault::input_not_finite;
  }
  output.wanted_deflection_rad = wanted_rad_;
  const double feed_forward = settings_.actuation == Actuation::current
                                  ? feed_forward_A_rad_ * wanted_rad_
                                  : wanted_rate_.step(wanted_rad_);
  const Pid::Output loop = pid_.step(wanted_rad_, deflection_rad, feed_forward);
  if (loop.fault != Fault::none) {
    output.command = fade(pid_.command());
    output.is_fading = true;
    output.fault = loop.fault;
    return output;
  }
  output.command = loop.command;
  output.proportional = loop.proportional;
  output.integral = loop.integral;
  output.derivative = loop.derivative;
  output.feed_forward = loop.feed_forward;
  output.transfer = loop.transfer;
  output.is_limited = output.is_limited || loop.is_limited;
  return output;
}

double DeflectionController::fade(double applied) noexcept {
  const double faded = applied * fault_keep_;
  pid_.start(std::abs(faded) > 1e-9 ? faded : 0.0);
  return pid_.command();
}

void DeflectionController::list(ControllerListing& listing) const noexcept {
  listing.deflection = {
      .gains = gains(), .feed_forward_A_rad = feed_forward_A_rad_, .fault_keep = fault_keep_};
  listing.pid_transfer_keep = pid_.transfer_keep();
}

JointFeedback DeflectionController::feedback(const Pid::Gains& gains) const {
  const LinearSystem none = LinearSystem::gain(0.0, sample_rate_Hz_);
  const LinearSystem loop = linear_pid(gains, settings_.rate_cutoff_Hz, sample_rate_Hz_);
  if (settings_.actuation == Actuation::current) return {loop, none, none};
  const LinearSystem drive =
      linear_pid(settings_.speed_loop, settings_.rate_cutoff_Hz, sample_rate_Hz_);
  return {drive * loop, drive, none};
}

// The derivative is the measurement's alone.
LinearSystem DeflectionController::reference_path() const {
  const LinearSystem loop =
      linear_pid({.proportional = gains().proportional, .integral = gains().integral},
                 settings_.rate_cutoff_Hz, sample_rate_Hz_);
  if (settings_.actuation == Actuation::current)
    return loop + LinearSystem::gain(feed_forward_A_rad_, sample_rate_Hz_);
  const LinearSystem rate = LinearSystem::lowpass(settings_.rate_cutoff_Hz, sample_rate_Hz_) *
                            LinearSystem::difference(sample_rate_Hz_);
  return linear_pid(settings_.speed_loop, settings_.rate_cutoff_Hz, sample_rate_Hz_) *
         (loop + rate);
}

namespace {

std::complex<double> tracking_of(const SeriesElasticJoint& joint, const JointFeedback& feedback,
                                 const LinearSystem& reference, double rad_s) {
  const std::complex<double> s(0.0, rad_s);
  const std::complex<double> current = current_path(joint, reference.sample_rate_Hz(), rad_s);
  const Drive& drive = joint.drive;
  return current * reference.response(rad_s) /
         (s * (drive.inertia() * s + drive.viscous_Nms_rad) + joint.stiffness_Nm_rad +
          current * (feedback.deflection.response(rad_s) + s * feedback.speed.response(rad_s)));
}

}  // namespace

std::complex<double> DeflectionController::tracking(double rad_s) const {
  return tracking_of(settings_.joint, feedback(), reference_path(), rad_s);
}

double DeflectionController::cutoff_rad_s() const {
  constexpr int kGrid = 400;
  constexpr int kHalvings = 40;
  constexpr double kLowestShare = 1e-4;  // share of the Nyquist frequency
  const JointFeedback own = feedback();
  const LinearSystem reference = reference_path();
  const auto is_below = [&](double rad_s) {
    return std::norm(tracking_of(settings_.joint, own, reference, rad_s)) < 0.5;
  };
  const double highest = std::numbers::pi * sample_rate_Hz_;
  double low = kLowestShare * highest;
  for (int n = 1; n <= kGrid; ++n) {
    double high = highest * std::pow(kLowestShare, 1.0 - static_cast<double>(n) / kGrid);
    if (n < kGrid && !is_below(high)) {
      low = high;
      continue;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (is_below(middle) ? high : low) = middle;
    }
    return high;
  }
  return highest;
}

Margins DeflectionController::margins_of(const Pid::Gains& gains, JointOutput output) const {
  return margins(open_loop(settings_.joint, feedback(gains), output));
}

}  // namespace torsio
