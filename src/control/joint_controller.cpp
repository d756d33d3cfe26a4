#include "torsio/control/joint_controller.hpp"

#include <algorithm>
#include <cmath>

#include "control/controller_listing.hpp"

namespace torsio {
namespace {

using Actuation = DeflectionController::Actuation;
using Settings = JointControllerCore::Settings;

/// The loop inside has to be faster than the one around it; the share keeps its own delay small.
constexpr double kInnerLoopFactor = 4.0;
constexpr double kMaxBandwidthShare = 0.2;  // share of the sample rate, in rad per sample

constexpr bool uses_spring(JointMode mode) noexcept {
  return mode == JointMode::torque || mode == JointMode::impedance || mode == JointMode::deflection;
}

JointCascade::Gains gains_of(const Settings& settings, double sample_rate_Hz) {
  if (settings.gains) return *settings.gains;
  const DeflectionController::Settings& deflection = settings.torque.deflection;
  const double bandwidth_rad_s =
      deflection.actuation == Actuation::velocity
          ? JointControllerCore::velocity_bandwidth(deflection.bandwidth_rad_s, sample_rate_Hz)
          : settings.override_rad_s;
  return JointCascade::gains_for(deflection.joint.drive, bandwidth_rad_s);
}

TorqueLoopCore::Settings torque_settings(const Settings& settings, double sample_rate_Hz) {
  TorqueLoopCore::Settings torque = settings.torque;
  torque.largest_torque_Nm = std::min(torque.largest_torque_Nm, settings.limits.torque_Nm);
  if (torque.deflection.actuation == Actuation::velocity)
    torque.deflection.speed_loop = gains_of(settings, sample_rate_Hz).velocity;
  return torque;
}

JointCascade::Settings cascade_settings(const Settings& settings, double sample_rate_Hz) {
  return {.drive = settings.torque.deflection.joint.drive,
          .bandwidth_rad_s = settings.override_rad_s,
          .limits = settings.limits,
          .has_torque = true,
          .gains = gains_of(settings, sample_rate_Hz)};
}

}  // namespace

double JointControllerCore::velocity_bandwidth(double deflection_rad_s,
                                               double sample_rate_Hz) noexcept {
  return std::min(kInnerLoopFactor * deflection_rad_s, kMaxBandwidthShare * sample_rate_Hz);
}

JointControllerCore::JointControllerCore(const Settings& settings, double sample_rate_Hz)
    : joint_(settings.torque.deflection.joint),
      acts_on_speed_(settings.torque.deflection.actuation == Actuation::velocity),
      torque_(torque_settings(settings, sample_rate_Hz), sample_rate_Hz),
      cascade_(cascade_settings(settings, sample_rate_Hz), sample_rate_Hz),
      impedance_({.torque_Nm = torque_settings(settings, sample_rate_Hz).largest_torque_Nm},
                 sample_rate_Hz),
      speed_(sample_rate_Hz, settings.speed_cutoff_Hz) {}

ControllerListing JointControllerCore::listing() const noexcept {
  ControllerListing listing;
  torque_.list(listing);
  cascade_.list(listing);
  impedance_.list(listing);
  return listing;
}

void JointControllerCore::reset() noexcept {
  torque_.reset();
  cascade_.reset();
  impedance_.reset();
  speed_.reset();
  reference_ = {};
  state_ = {};
  deflection_rad_ = 0.0;
  accepted_Nm_ = 0.0;
  transfer_A_ = 0.0;
  is_number_ = true;
  is_accepted_ = true;
}

bool JointControllerCore::set_limits(double lowest_rad, double highest_rad, double speed_rad_s,
                                     double torque_Nm) noexcept {
  return torque_Nm > 0.0 && cascade_.set_motion_limits(lowest_rad, highest_rad, speed_rad_s) &&
         torque_.set_largest_torque(torque_Nm);
}

JointState JointControllerCore::measure(const JointSample& sample) noexcept {
  const double angle_rad = sample.motor_angle_rad / joint_.drive.ratio;
  const double deflection_rad = sample.spring_deflection_rad();
  if (!std::isfinite(angle_rad + deflection_rad)) {
    speed_.skip();
    return {};
  }
  deflection_rad_ = deflection_rad;
  return {.angle_rad = angle_rad,
          .speed_rad_s = speed_.step(angle_rad),
          .torque_Nm = joint_.stiffness_Nm_rad * deflection_rad};
}

// Between two modes of the spring the loop keeps its integral, which contains friction and load.
void JointControllerCore::enter(JointMode mode) noexcept {
  if (mode == reference_.mode) return;
  if (!uses_spring(reference_.mode)) torque_.reset();
  impedance_.reset();
  cascade_.continue_from_last();
}

double JointControllerCore::wanted_torque() noexcept {
  switch (reference_.mode) {
    case JointMode::torque: return reference_.torque_Nm;
    case JointMode::impedance: {
      static_cast<void>(
          impedance_.set_gains({reference_.stiffness_Nm_rad, reference_.damping_Nms_rad}));
      return impedance_
          .step({reference_.position_rad, reference_.velocity_rad_s, reference_.torque_Nm},
                {state_.angle_rad, state_.speed_rad_s})
          .torque_Nm;
    }
    case JointMode::deflection: return joint_.stiffness_Nm_rad * reference_.deflection_rad;
    default: return joint_.stiffness_Nm_rad * deflection_rad_;
  }
}

double JointControllerCore::accept(const JointReference& reference,
                                   const JointSample& sample) noexcept {
  is_number_ = is_finite(reference);
  is_accepted_ = is_number_ && reference.mode <= JointMode::deflection &&
                 reference.stiffness_Nm_rad >= 0.0 && reference.damping_Nms_rad >= 0.0;
  if (is_accepted_) {
    enter(reference.mode);
    reference_ = reference;
  }
  state_ = measure(sample);
  accepted_Nm_ = torque_.accept(wanted_torque(), reference_.mode != JointMode::impedance);
  return accepted_Nm_;
}

JointControllerCore::Output JointControllerCore::step(const Estimate& wanted_rad,
                                                      const JointSample& sample) noexcept {
  Output output = {.is_reference_refused = !is_accepted_,
                   .spring_deflection_rad = deflection_rad_,
                   .state = state_};
  JointReference command = reference_;
  const bool is_spring = uses_spring(reference_.mode);
  if (is_spring) {
    const Estimate deflection = reference_.mode == JointMode::deflection
                                    ? Estimate{.value = accepted_Nm_ / joint_.stiffness_Nm_rad}
                                    : wanted_rad;
    // All or nothing: one lost angle fades the whole current, as in the cascade.
    const bool is_measured = std::isfinite(state_.angle_rad);
    output.torque = torque_.step(deflection, is_measured ? sample : JointSample{});
    output.spring_deflection_rad = output.torque.wanted_deflection_rad;
    command = {.mode = acts_on_speed_ ? JointMode::velocity : JointMode::current,
               .velocity_rad_s = output.torque.speed_rad_s,
               .current_A = reference_.current_A + output.torque.current_A};
  }
  output.cascade = cascade_.step(command, state_);
  output.current_A = output.cascade.current_A;
  output.limit = limit_of(output);
  output.is_limited = output.limit != JointCascade::Limit::none || output.torque.is_limited;
  output.fault = is_number_ ? output.cascade.fault : Fault::input_not_finite;
  transfer_A_ = output.cascade.transfer_A;
  if (is_spring && output.cascade.fault == Fault::none) {
    torque_.set_motor_current(output.current_A);
    if (output.limit != JointCascade::Limit::none) track_spring_loop(output.current_A);
  }
  return output;
}

// Through the velocity loop a limit cuts the wanted speed, and the current follows.
JointCascade::Limit JointControllerCore::limit_of(const Output& output) const noexcept {
  const double applied_rad_s = output.cascade.wanted_velocity_rad_s;
  const bool is_slowed = acts_on_speed_ && uses_spring(reference_.mode) &&
                         output.cascade.fault == Fault::none &&
                         applied_rad_s != output.torque.speed_rad_s;
  if (!is_slowed || output.cascade.limit != JointCascade::Limit::none) return output.cascade.limit;
  return std::abs(applied_rad_s) < cascade_.soft_speed() ? JointCascade::Limit::position
                                                         : JointCascade::Limit::speed;
}

void JointControllerCore::track_spring_loop(double applied_A) noexcept {
  torque_.track(acts_on_speed_ ? state_.speed_rad_s
                               : applied_A - transfer_A_ - reference_.current_A);
}

void JointControllerCore::track(double applied_A) noexcept {
  cascade_.track(applied_A);
  if (!uses_spring(reference_.mode)) return;
  torque_.set_motor_current(applied_A);
  track_spring_loop(applied_A);
}

}  // namespace torsio
