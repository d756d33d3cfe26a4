#include "torsio/arm/arm_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kControllerPlace = "arm controller";
constexpr double kExchange_s = 0.1;  // decay of the difference between two models

bool is_finite(const JointSample& sample) noexcept {
  return std::isfinite(sample.motor_angle_rad + sample.gear_angle_rad + sample.joint_angle_rad);
}

/// Feeds a monitor with the channels that a `JointSample` has.
detail::JointInputs inputs_of(const MonitoredTorque& monitored) {
  try {
    return {monitored.raw_inputs(), "torque_Nm"};
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.advice = "Calibrate the monitor with these channels only.";
    throw Error(std::move(report));
  }
}

}  // namespace

ArmController::Axis::Axis(Joint&& from, double sample_rate_Hz, double speed_cutoff_Hz)
    : controller(ExchangeableInverse(std::move(from.inverse), kExchange_s, sample_rate_Hz),
                 from.control, sample_rate_Hz),
      stop(from.stop, sample_rate_Hz),
      estimator(std::move(from.estimator)),
      transfer(kExchange_s, sample_rate_Hz),
      monitored(std::move(from.monitored)),
      speed(sample_rate_Hz, speed_cutoff_Hz),
      raw_speed(sample_rate_Hz),
      motor_speed(sample_rate_Hz, from.control.speed_cutoff_Hz),
      drive(from.control.torque.deflection.joint.drive),
      stiffness_Nm_rad(from.control.torque.deflection.joint.stiffness_Nm_rad),
      speed_limit_rad_s(from.control.limits.speed_rad_s),
      bearing_Nm(from.bearing_Nm),
      viscous_Nms_rad(from.viscous_Nms_rad),
      largest_external_Nm(from.largest_external_Nm),
      guiding_friction_Nm(from.guiding_friction_Nm) {
  require_not_negative(kControllerPlace, "the friction of hand guiding", guiding_friction_Nm);
  require_not_negative(kControllerPlace, "the friction of the bearing", bearing_Nm);
  require_not_negative(kControllerPlace, "the viscous friction of the bearing", viscous_Nms_rad);
  require_positive(kControllerPlace, "the largest external torque", largest_external_Nm);
  if (!monitored) return;
  monitor_inputs.emplace(inputs_of(*monitored));
  monitor_samples.resize(monitored->raw_inputs().size());
}

ArmController::ArmController(Settings settings, double sample_rate_Hz)
    : settings_(std::move(settings)),
      period_s_(1.0 / sample_rate_Hz),
      dynamics_(settings_.arm),
      observer_(settings_.arm.joints.size(), settings_.observer, sample_rate_Hz),
      reaction_(settings_.reaction_motion, sample_rate_Hz) {
  require(settings_.joints.size() == dynamics_.size(), kControllerPlace,
          fmt::format("{} joints, as in the arm", dynamics_.size()),
          fmt::format("{}", settings_.joints.size()));
  require_positive(kControllerPlace, "the speed of friction", settings_.friction_speed_rad_s);
  require_parameter(settings_.friction_share >= 0.0 && settings_.friction_share <= 1.0,
                    kControllerPlace, "a share of friction from 0 to 1", settings_.friction_share);
  require_not_negative(kControllerPlace, "the correction of the links",
                       settings_.link_correction_1_s);
  require_not_negative(kControllerPlace, "the damping of the links", settings_.link_damping);
  require_positive(kControllerPlace, "the fastest swing", settings_.fastest_swing_rad_s);
  require_positive(kControllerPlace, "the decay of a guided motion", settings_.guiding_decay_s);
  require_not_negative(kControllerPlace, "the largest correction",
                       settings_.largest_correction_rad);
  require_positive(kControllerPlace, "the longest overload", settings_.longest_overload_s);
  if (settings_.cartesian) cartesian_.emplace(*settings_.cartesian);
  if (settings_.contacts) {
    require(settings_.contacts->joints.size() == dynamics_.size(), kControllerPlace,
            fmt::format("thresholds of contacts for {} joints, as in the arm", dynamics_.size()),
            fmt::format("{}", settings_.contacts->joints.size()));
    contacts_.emplace(*settings_.contacts, sample_rate_Hz);
  }
  joints_.reserve(dynamics_.size());
  for (std::size_t j = 0; j < dynamics_.size(); ++j) {
    try {
      joints_.emplace_back(std::move(settings_.joints[j]), sample_rate_Hz,
                           settings_.speed_cutoff_Hz);
    } catch (const Error& error) {
      ErrorReport report = error.report();
      report.place = fmt::format("joint '{}': {}", settings_.arm.joints[j].name, report.place);
      throw Error(std::move(report));
    }
  }
  settings_.joints.clear();
  reset();
}

void ArmController::reset() noexcept {
  for (Axis& axis : joints_) {
    axis.controller.reset();
    axis.stop.trigger(StopCategory::power_off);
    if (axis.estimator) axis.estimator->reset();
    if (axis.monitored) axis.monitored->reset();
    axis.speed.reset();
    axis.raw_speed.reset();
    axis.motor_speed.reset();
    axis.transfer.reset();
    axis.is_exchanged = false;
    axis.spring_Nm = 0.0;
    axis.correction_rad = 0.0;
    axis.measured = {};
    axis.lost = 0;
    axis.overloaded_s = 0.0;
  }
  observer_.reset();
  end_reaction();
  output_ = {.cause = ArmStopCause::requested};
  is_started_ = false;
  is_holding_ = false;
  is_following_ = false;
}

void ArmController::stop(StopCategory category) noexcept {
  for (Axis& axis : joints_) axis.stop.trigger(category);
  if (output_.cause == ArmStopCause::none) output_.cause = ArmStopCause::requested;
}

void ArmController::find(ArmStopCause cause, std::size_t joint) noexcept {
  if (output_.cause == ArmStopCause::none) {
    output_.cause = cause;
    output_.joint = joint;
  }
  for (Axis& axis : joints_) axis.stop.trigger(settings_.stop_category);
}

bool ArmController::release() noexcept {
  if (!output_.is_at_rest) return false;
  for (Axis& axis : joints_)
    if (axis.lost > 0 || (axis.stop.phase() != JointStop::Phase::running && !axis.stop.release()))
      return false;
  output_.cause = ArmStopCause::none;
  for (Axis& axis : joints_)
    if (axis.monitored) axis.monitored->monitor().reset(axis.t_s);
  proof_s_ = 0.0;
  end_reaction();
  hold();
  return true;
}

bool ArmController::exchange_model(std::size_t joint, ArmJointModel& model) noexcept {
  Axis& axis = joints_[joint];
  if (axis.monitored) return false;
  axis.estimator.swap(model.estimator);
  axis.controller.inverse().exchange(model.inverse);
  std::swap(axis.bearing_Nm, model.bearing_Nm);
  std::swap(axis.viscous_Nms_rad, model.viscous_Nms_rad);
  axis.is_exchanged = true;
  return true;
}

double ArmController::bearing_torque(const Axis& axis, double speed_rad_s) const noexcept {
  return axis.bearing_Nm * std::tanh(speed_rad_s / settings_.friction_speed_rad_s) +
         axis.viscous_Nms_rad * speed_rad_s;
}

const ArmController::Output& ArmController::step(const ArmReference& reference,
                                                 std::span<const JointSample> samples) noexcept {
  if (samples.size() != joints_.size()) {
    find(ArmStopCause::measurement, 0);
    samples = {};
  }
  const bool is_complete = sense(samples);
  estimate(samples);
  supervise(samples);
  if (is_complete && !is_started_) {
    hold();
    is_started_ = true;
  }
  prove();
  find_contact(reference, samples);
  const ArmReference& wanted = is_reacting_ ? reaction_reference() : reference;
  const bool is_stopped = output_.cause != ArmStopCause::none;
  output_.is_reference_refused = !is_reacting_ && (!is_usable(reference) || !is_near(reference));
  const bool is_held = output_.is_reference_refused || (!output_.is_ready && !is_stopped);
  is_following_ = !is_held && !is_stopped && wanted.mode == ArmMode::position;
  if (output_.is_reference_refused && !is_holding_) hold();
  is_holding_ = output_.is_reference_refused;
  references(is_held ? holding_ : wanted);

  output_.is_at_rest = true;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    JointOutput& out = output_.joints[j];
    const JointSample sample = samples.empty() ? JointSample{} : samples[j];
    const JointReference allowed = axis.stop.reference(references_[j], axis.measured);
    const auto controlled = axis.controller.step(allowed, sample);
    // A sample that is missing for a tick or two fades the current, and is not yet a fault of the stop.
    const bool is_tolerated = axis.lost > 0 && axis.lost <= settings_.tolerated_losses;
    const auto command = axis.stop.step(controlled.current_A, axis.measured,
                                        is_tolerated ? Fault::none : controlled.fault);
    if (command.is_current_cut) axis.controller.track(command.current_A);
    out.current_A = command.current_A;
    out.is_powered = command.is_powered;
    out.is_brake_open = command.is_brake_open;
    out.phase = command.phase;
    out.thermal_load = controlled.cascade.thermal_load;
    out.limit = controlled.limit;
    out.fault = controlled.fault;
    output_.is_at_rest = output_.is_at_rest && command.is_drive_at_rest;
  }
  return output_;
}

// Angles and speeds; those of a joint without a sample stay.
bool ArmController::sense(std::span<const JointSample> samples) noexcept {
  bool is_complete = !samples.empty();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    sense_motor_side(axis, samples.empty() ? JointSample{} : samples[j]);
    if (samples.empty() || !is_finite(samples[j])) {
      axis.lost = std::min(axis.lost + 1, settings_.tolerated_losses + 1);
      axis.speed.skip();
      axis.raw_speed.skip();
      is_complete = false;
      continue;
    }
    axis.lost = 0;
    axis.t_s = samples[j].t_s;
    angle_rad_[j] = samples[j].joint_angle_rad;
    speed_rad_s_[j] = axis.speed.step(angle_rad_[j]);
    raw_speed_rad_s_[j] = axis.raw_speed.step(angle_rad_[j]);
    output_.joints[j].speed_rad_s = speed_rad_s_[j];
  }
  return is_complete;
}

// For the stop, which can watch the drive even if the link's encoder has failed. Over a tick or two without a
// sample the last state stays.
void ArmController::sense_motor_side(Axis& axis, const JointSample& sample) const noexcept {
  if (std::isfinite(sample.motor_angle_rad)) {
    const double angle_rad = sample.motor_angle_rad / axis.drive.ratio;
    axis.measured.angle_rad = angle_rad;
    axis.measured.speed_rad_s = axis.motor_speed.step(angle_rad);
  } else {
    axis.motor_speed.skip();
    if (axis.lost >= settings_.tolerated_losses) axis.measured = {};
  }
  const double spring_Nm = axis.stiffness_Nm_rad * sample.spring_deflection_rad();
  if (std::isfinite(spring_Nm)) axis.measured.torque_Nm = spring_Nm;
}

void ArmController::estimate(std::span<const JointSample> samples) noexcept {
  ArmDynamics::PerJoint on_links_Nm = {};
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    const JointSample sample = samples.empty() ? JointSample{} : samples[j];
    Estimate torque;
    if (axis.monitored) {
      std::ranges::transform(axis.monitor_inputs->from(sample), axis.monitor_samples.begin(),
                             [](double value) { return SignalSample{.value = value}; });
      const FusedTorque fused = axis.monitored->step(sample.t_s, axis.monitor_samples);
      torque = {.value = fused.value_Nm, .std_dev = fused.std_dev_Nm, .fault = fused.fault};
    } else if (axis.estimator) {
      torque = axis.estimator->step(sample);
    } else {
      torque.value = axis.stiffness_Nm_rad * sample.spring_deflection_rad();
      if (!std::isfinite(torque.value))
        torque = {.value = axis.spring_Nm, .fault = Fault::input_not_finite};
      axis.spring_Nm = torque.value;
    }
    torque.value -= axis.torque_zero_Nm;
    if (std::exchange(axis.is_exchanged, false)) {
      axis.transfer.reset();
      axis.transfer.add(output_.joints[j].torque.value - torque.value);
    }
    torque.value += axis.transfer.step();
    output_.joints[j].torque = torque;
    on_links_Nm[j] = torque.value - bearing_torque(axis, speed_rad_s_[j]);
    output_.joints[j].link_Nm = on_links_Nm[j];
  }
  (void)observer_.step(dynamics_, angle_rad_, raw_speed_rad_s_, on_links_Nm);
  const auto external_Nm = observer_.external_torque_Nm();
  for (std::size_t j = 0; j < joints_.size(); ++j) output_.joints[j].external_Nm = external_Nm[j];
}

void ArmController::supervise(std::span<const JointSample> samples) noexcept {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    if (axis.lost > settings_.tolerated_losses || samples.empty())
      find(ArmStopCause::measurement, j);
    if (axis.monitored && axis.monitored->monitor().state() == Monitor::State::stopped)
      find(ArmStopCause::monitor, j);
    const bool is_overloaded = std::abs(output_.joints[j].external_Nm) > axis.largest_external_Nm;
    // A retreat from a contact is not stopped by the contact's force: the arm would stay clamped.
    axis.overloaded_s = is_overloaded && !is_yielding() ? axis.overloaded_s + period_s_ : 0.0;
    if (axis.overloaded_s > settings_.longest_overload_s) find(ArmStopCause::overload, j);
  }
}

// The phases are those after the last step.
void ArmController::prove() noexcept {
  output_.is_ready = false;
  if (output_.cause != ArmStopCause::none) return;
  for (const Axis& axis : joints_)
    if (axis.stop.phase() != JointStop::Phase::running) return;
  proof_s_ += period_s_;
  output_.is_ready = true;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    if (!axis.monitored) continue;
    Monitor& monitor = axis.monitored->monitor();
    if (monitor.state() == Monitor::State::ready) monitor.arm(axis.t_s);
    if (monitor.is_watching()) continue;
    output_.is_ready = false;
    if (proof_s_ > settings_.longest_proof_s) find(ArmStopCause::monitor, j);
  }
}

}  // namespace torsio
