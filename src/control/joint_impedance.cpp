#include "torsio/control/joint_impedance.hpp"

#include <algorithm>
#include <cmath>

#include "control/controller_listing.hpp"
#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "control/design/passive_sweep.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "joint impedance";

JointImpedance::Settings checked(const JointImpedance::Settings& settings, double sample_rate_Hz) {
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  require_not_negative(kPlace, "stiffness_Nm_rad", settings.gains.stiffness_Nm_rad);
  require_not_negative(kPlace, "damping_Nms_rad", settings.gains.damping_Nms_rad);
  require_parameter(settings.torque_Nm > 0.0, kPlace, "torque_Nm > 0", settings.torque_Nm);
  require_parameter(settings.torque_rate_Nm_s > 0.0, kPlace, "torque_rate_Nm_s > 0",
                    settings.torque_rate_Nm_s);
  require_positive(kPlace, "transfer_s", settings.transfer_s);
  require_positive(kPlace, "fault_decay_s", settings.fault_decay_s);
  return settings;
}

}  // namespace

JointImpedance::JointImpedance(const Settings& settings, double sample_rate_Hz)
    : gains_(checked(settings, sample_rate_Hz).gains),
      max_Nm_(settings.torque_Nm),
      step_Nm_(settings.torque_rate_Nm_s / sample_rate_Hz),
      fault_keep_(std::exp(-1.0 / (settings.fault_decay_s * sample_rate_Hz))),
      transfer_(settings.transfer_s, sample_rate_Hz) {}

void JointImpedance::reset() noexcept {
  transfer_.reset();
  wanted_ = {};
  position_error_rad_ = 0.0;
  speed_error_rad_s_ = 0.0;
  has_reference_ = false;
  is_returning_ = false;
  torque_Nm_ = 0.0;
}

bool JointImpedance::set_gains(const Gains& gains) noexcept {
  if (!(gains.stiffness_Nm_rad >= 0.0 && gains.damping_Nms_rad >= 0.0 &&
        std::isfinite(gains.stiffness_Nm_rad) && std::isfinite(gains.damping_Nms_rad)))
    return false;
  transfer_.add((gains_.stiffness_Nm_rad - gains.stiffness_Nm_rad) * position_error_rad_ +
                (gains_.damping_Nms_rad - gains.damping_Nms_rad) * speed_error_rad_s_);
  gains_ = gains;
  return true;
}

JointImpedance::Output JointImpedance::fade() noexcept {
  torque_Nm_ *= fault_keep_;
  if (std::abs(torque_Nm_) < 1e-9) torque_Nm_ = 0.0;
  is_returning_ = true;
  return {.torque_Nm = torque_Nm_, .fault = Fault::input_not_finite};
}

JointImpedance::Output JointImpedance::step(const Reference& wanted,
                                            const State& measured) noexcept {
  Output output;
  if (std::isfinite(wanted.angle_rad + wanted.speed_rad_s + wanted.torque_Nm)) {
    wanted_ = wanted;
    has_reference_ = true;
  } else {
    output.fault = Fault::input_not_finite;
  }
  const double position_error_rad = wanted_.angle_rad - measured.angle_rad;
  const double speed_error_rad_s = wanted_.speed_rad_s - measured.speed_rad_s;
  output.spring_Nm = gains_.stiffness_Nm_rad * position_error_rad;
  output.damper_Nm = gains_.damping_Nms_rad * speed_error_rad_s;
  output.feed_forward_Nm = wanted_.torque_Nm;
  const double terms_Nm = output.spring_Nm + output.damper_Nm + output.feed_forward_Nm;
  if (!std::isfinite(terms_Nm) || !has_reference_) return fade();
  if (is_returning_) {
    transfer_.reset();
    transfer_.add(torque_Nm_ - terms_Nm);
  }
  output.transfer_Nm = transfer_.step();
  const double all_Nm = terms_Nm + output.transfer_Nm;
  if (!std::isfinite(all_Nm)) return fade();
  is_returning_ = false;
  position_error_rad_ = position_error_rad;
  speed_error_rad_s_ = speed_error_rad_s;
  const double moved_Nm = std::clamp(all_Nm, torque_Nm_ - step_Nm_, torque_Nm_ + step_Nm_);
  torque_Nm_ = std::clamp(moved_Nm, -max_Nm_, max_Nm_);
  output.torque_Nm = torque_Nm_;
  output.is_limited = torque_Nm_ != all_Nm;
  return output;
}

void JointImpedance::list(ControllerListing& listing) const noexcept {
  listing.impedance_transfer_keep = transfer_.keep();
  listing.impedance_fault_keep = fault_keep_;
}

JointFeedback impedance_feedback(const DeflectionController& controller,
                                 const JointImpedance::Gains& gains, double speed_cutoff_Hz) {
  JointFeedback loop = controller.feedback();
  const double rate_Hz = loop.deflection.sample_rate_Hz();
  const auto gain = [&](double value) { return LinearSystem::gain(value, rate_Hz); };
  const double per_Nm = 1.0 / controller.settings().joint.stiffness_Nm_rad;
  LinearSystem reference = gain(gains.stiffness_Nm_rad * per_Nm);
  if (gains.damping_Nms_rad > 0.0)
    reference = reference + gain(gains.damping_Nms_rad * per_Nm) *
                                (LinearSystem::lowpass(speed_cutoff_Hz, rate_Hz) *
                                 LinearSystem::difference(rate_Hz));
  loop.joint = loop.joint + controller.reference_path() * reference;
  return loop;
}

double passive_stiffness(const DeflectionController& controller, double damping_Nms_rad,
                         double passive_to_rad_s, double speed_cutoff_Hz) {
  const SeriesElasticJoint& joint = controller.settings().joint;
  return highest_passive(joint, passive_to_rad_s, joint.stiffness_Nm_rad, [&](double stiffness) {
    return impedance_feedback(controller, {stiffness, damping_Nms_rad}, speed_cutoff_Hz);
  });
}

}  // namespace torsio
