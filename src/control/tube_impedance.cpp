#include "torsio/control/tube_impedance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "control/design/passive_sweep.hpp"
#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "tube impedance";

TubeImpedance::Settings checked(const TubeImpedance::Settings& settings) {
  settings.drive.check();
  require_positive(kPlace, "tube_ratio", settings.tube_ratio);
  require_positive(kPlace, "tube_Nm_rad", settings.tube_Nm_rad);
  require_not_negative(kPlace, "position gain", settings.gains.position);
  require_not_negative(kPlace, "damping gain", settings.gains.damping_s);
  require_not_negative(kPlace, "torque gain", settings.gains.torque_Nm_rad);
  require_positive(kPlace, "fault_decay_s", settings.fault_decay_s);
  require_positive(kPlace, "transfer_s", settings.transfer_s);
  return settings;
}

double gear_ratio_of(const TubeImpedance::Settings& settings) noexcept {
  return settings.drive.ratio / settings.tube_ratio;
}

double torque_per_twist_of(const TubeImpedance::Settings& settings, double torque_Nm_rad) noexcept {
  return gear_ratio_of(settings) * settings.tube_Nm_rad * torque_Nm_rad /
         (torque_Nm_rad + settings.tube_Nm_rad / settings.tube_ratio);
}

}  // namespace

TubeImpedance::Gains TubeImpedance::gains_for(const Settings& settings, double stiffness_Nm_rad,
                                              double damping_Nms_rad, double torque_Nm_rad) {
  require_positive(kPlace, "torque gain", torque_Nm_rad);
  require_not_negative(kPlace, "stiffness_Nm_rad", stiffness_Nm_rad);
  require_not_negative(kPlace, "damping_Nms_rad", damping_Nms_rad);
  const double per_Nm = 1.0 / torque_per_twist_of(settings, torque_Nm_rad);
  return {.position = stiffness_Nm_rad * per_Nm,
          .damping_s = damping_Nms_rad * per_Nm,
          .torque_Nm_rad = torque_Nm_rad};
}

SeriesElasticJoint TubeImpedance::joint_of(const Settings& settings) {
  const double gear_ratio = gear_ratio_of(settings);
  return {.drive = settings.drive,
          .stiffness_Nm_rad = settings.tube_Nm_rad * gear_ratio * gear_ratio,
          .joint_inertia_kg_m2 = settings.joint_inertia_kg_m2,
          .joint_viscous_Nms_rad = settings.joint_viscous_Nms_rad};
}

// At the joint the twist is θ_s / N_h.
JointFeedback TubeImpedance::feedback_of(const Settings& settings, double sample_rate_Hz) {
  const double per_rad = settings.gains.torque_Nm_rad / settings.drive.torque_constant_Nm_A;
  const LinearSystem reference = linear_pid({.proportional = per_rad * settings.gains.position,
                                             .derivative = per_rad * settings.gains.damping_s},
                                            settings.speed_cutoff_Hz, sample_rate_Hz);
  return {LinearSystem::gain(per_rad * gear_ratio_of(settings), sample_rate_Hz),
          LinearSystem::gain(0.0, sample_rate_Hz), reference};
}

TubeImpedance::TubeImpedance(const Settings& settings, double sample_rate_Hz)
    : settings_(checked(settings)),
      gear_ratio_(gear_ratio_of(settings)),
      fault_keep_(std::exp(-1.0 / (settings.fault_decay_s * sample_rate_Hz))),
      speed_(sample_rate_Hz, settings.speed_cutoff_Hz),
      transfer_(settings.transfer_s, sample_rate_Hz) {
  joint_of(settings_).check();
  if (settings_.relies_on_friction) return;
  const JointFeedback loop = feedback_of(settings_, sample_rate_Hz);
  for (const JointOutput output : {JointOutput::locked, JointOutput::free})
    require_stable(kPlace, open_loop(joint_of(settings_), loop, output), output);
}

void TubeImpedance::reset() noexcept {
  speed_.reset();
  transfer_.reset();
  has_reference_ = false;
  is_returning_ = false;
  wanted_rad_ = 0.0;
  wanted_rad_s_ = 0.0;
  wanted_Nm_ = 0.0;
  current_A_ = 0.0;
}

TubeImpedance::Output TubeImpedance::fade() noexcept {
  speed_.reset();
  transfer_.reset();
  is_returning_ = true;
  current_A_ *= fault_keep_;
  if (std::abs(current_A_) < 1e-9) current_A_ = 0.0;
  return {.current_A = current_A_, .fault = Fault::input_not_finite};
}

double TubeImpedance::torque_per_twist(const Settings& settings) noexcept {
  const double torque_Nm_rad = settings.gains.torque_Nm_rad;
  return torque_Nm_rad > 0.0 ? torque_per_twist_of(settings, torque_Nm_rad) : 0.0;
}

double TubeImpedance::stiffness() const noexcept {
  return torque_per_twist(settings_) * settings_.gains.position;
}

TubeImpedance::Output TubeImpedance::step(double wanted_rad, double wanted_rad_s,
                                          const Angles& measured, double wanted_Nm) noexcept {
  Output output;
  if (std::isfinite(wanted_rad + wanted_rad_s + wanted_Nm)) {
    wanted_rad_ = wanted_rad;
    wanted_rad_s_ = wanted_rad_s;
    wanted_Nm_ = wanted_Nm;
    has_reference_ = true;
  } else {
    output.fault = Fault::input_not_finite;
  }
  const Gains& gains = settings_.gains;
  const double position_error_rad =
      settings_.twist == Twist::tube ? measured.middle_rad : gear_ratio_ * measured.joint_rad;
  output.twist_rad = measured.rotor_rad / settings_.tube_ratio - position_error_rad;
  if (!has_reference_ || !std::isfinite(output.twist_rad + measured.joint_rad)) return fade();
  output.position_rad = gains.position * (wanted_rad_ - measured.joint_rad);
  output.damping_rad = gains.damping_s * (wanted_rad_s_ - speed_.step(measured.joint_rad));
  if (gains.torque_Nm_rad > 0.0) output.feed_forward_rad = wanted_Nm_ / torque_per_twist(settings_);
  output.motor_torque_Nm = gains.torque_Nm_rad * (output.position_rad + output.damping_rad +
                                                  output.feed_forward_rad - output.twist_rad);
  const double max_A = settings_.drive.peak_current_A;
  const double impedance_A = output.motor_torque_Nm / settings_.drive.torque_constant_Nm_A;
  if (is_returning_) transfer_.add(current_A_ - impedance_A);
  is_returning_ = false;
  output.transfer_A = transfer_.step();
  const double wanted_A = impedance_A + output.transfer_A;
  if (!std::isfinite(wanted_A)) return fade();
  current_A_ = std::clamp(wanted_A, -max_A, max_A);
  output.current_A = current_A_;
  output.is_limited = current_A_ != wanted_A;
  return output;
}

double passive_stiffness(const TubeImpedance::Settings& settings, double damping_Nms_rad,
                         double passive_to_rad_s, double sample_rate_Hz) {
  const SeriesElasticJoint joint = TubeImpedance::joint_of(settings);
  return highest_passive(joint, passive_to_rad_s, joint.stiffness_Nm_rad, [&](double stiffness) {
    TubeImpedance::Settings stiffer = settings;
    stiffer.gains = TubeImpedance::gains_for(settings, stiffness, damping_Nms_rad,
                                             settings.gains.torque_Nm_rad);
    return TubeImpedance::feedback_of(stiffer, sample_rate_Hz);
  });
}

}  // namespace torsio
