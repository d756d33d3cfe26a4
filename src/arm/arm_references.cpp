// References of the joints in the modes of an `ArmController`.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/all_finite.hpp"
#include "torsio/arm/arm_controller.hpp"

namespace torsio {
namespace {

constexpr double kGuidingWidth_rad = 0.01;  // width of the friction that holds a guided arm

bool is_finite(const ArmFrame& frame) noexcept {
  return all_finite(frame.position_m) && all_finite(frame.rotation);
}

}  // namespace

bool ArmController::is_usable(const ArmReference& reference) const noexcept {
  switch (reference.mode) {
    case ArmMode::joints:
      return std::ranges::all_of(std::span(reference.joints).first(joints_.size()),
                                 [](const JointReference& of) { return torsio::is_finite(of); });
    case ArmMode::position:
    case ArmMode::impedance:
      return all_finite(reference.position_rad) && all_finite(reference.velocity_rad_s) &&
             all_finite(reference.acceleration_rad_s2) && all_finite(reference.stiffness_Nm_rad) &&
             all_finite(reference.damping_Nms_rad);
    case ArmMode::cartesian:
      return cartesian_ && is_finite(reference.flange) && all_finite(reference.position_rad);
    case ArmMode::guiding: return true;
  }
  return false;
}

bool ArmController::is_near(const ArmReference& reference) const noexcept {
  if (reference.mode != ArmMode::position || is_following_) return true;
  for (std::size_t j = 0; j < joints_.size(); ++j)
    if (!(std::abs(reference.position_rad[j] - angle_rad_[j]) <= settings_.largest_start_error_rad))
      return false;
  return true;
}

void ArmController::hold() noexcept {
  holding_ = {.mode = ArmMode::position, .position_rad = angle_rad_};
  for (Axis& axis : joints_) axis.correction_rad = 0.0;
}

void ArmController::references(const ArmReference& reference) noexcept {
  output_.manipulability = 1.0;
  output_.is_singular = false;
  ArmDynamics::PerJoint torque_Nm = {};
  is_guided_ = is_guided_ && reference.mode == ArmMode::guiding;
  switch (reference.mode) {
    case ArmMode::joints:
      std::ranges::copy_n(reference.joints.begin(), static_cast<std::ptrdiff_t>(joints_.size()),
                          references_.begin());
      for (std::size_t j = 0; j < joints_.size(); ++j)
        output_.joints[j].wanted_Nm = references_[j].torque_Nm;
      return;
    case ArmMode::position: follow_position(reference); return;
    case ArmMode::impedance: dynamics_.gravity_torque(angle_rad_, torque_Nm); break;
    case ArmMode::cartesian: {
      const auto task =
          cartesian_->step(dynamics_, angle_rad_, speed_rad_s_,
                           {.flange = reference.flange, .posture_rad = reference.position_rad});
      torque_Nm = task.torque_Nm;
      output_.manipulability = task.manipulability;
      output_.is_singular = task.is_singular;
      break;
    }
    case ArmMode::guiding: guide(torque_Nm); break;
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const double wanted_Nm =
        torque_Nm[j] + settings_.friction_share * bearing_torque(joints_[j], speed_rad_s_[j]);
    output_.joints[j].wanted_Nm = wanted_Nm;
    references_[j] = {.mode = JointMode::torque, .torque_Nm = wanted_Nm};
    if (reference.mode != ArmMode::impedance) continue;
    references_[j] = {
        .mode = JointMode::impedance,
        .position_rad = reference.position_rad[j] + torque_Nm[j] / joints_[j].stiffness_Nm_rad,
        .velocity_rad_s = reference.velocity_rad_s[j],
        .torque_Nm = wanted_Nm,
        .stiffness_Nm_rad = reference.stiffness_Nm_rad[j],
        .damping_Nms_rad = reference.damping_Nms_rad[j]};
  }
}

void ArmController::follow_position(const ArmReference& reference) noexcept {
  ArmDynamics::PerJoint torque_Nm = {};
  dynamics_.inverse(reference.position_rad, reference.velocity_rad_s, reference.acceleration_rad_s2,
                    torque_Nm);
  ArmDynamics::PerJoint damping_s = {};
  ArmDynamics::PerJoint acceleration_rad_s2 = {};
  find_swing(damping_s, acceleration_rad_s2);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    const double speed_rad_s = reference.velocity_rad_s[j];
    const double spring_Nm = torque_Nm[j] + bearing_torque(axis, speed_rad_s);
    const double drive_Nm =
        axis.drive.coulomb_Nm * std::tanh(speed_rad_s / settings_.friction_speed_rad_s) +
        axis.drive.viscous_Nms_rad * speed_rad_s;
    axis.correction_rad =
        std::clamp(axis.correction_rad + settings_.link_correction_1_s * period_s_ *
                                             (reference.position_rad[j] - angle_rad_[j]),
                   -settings_.largest_correction_rad, settings_.largest_correction_rad);
    output_.joints[j].wanted_Nm = spring_Nm;
    references_[j] = {
        .mode = JointMode::position,
        .position_rad = reference.position_rad[j] + spring_Nm / axis.stiffness_Nm_rad +
                        axis.correction_rad + damping_s[j] * (speed_rad_s - speed_rad_s_[j]),
        .velocity_rad_s = speed_rad_s + damping_s[j] * (reference.acceleration_rad_s2[j] -
                                                        acceleration_rad_s2[j]),
        .acceleration_rad_s2 = reference.acceleration_rad_s2[j],
        .torque_Nm = spring_Nm + settings_.friction_share * drive_Nm};
  }
}

void ArmController::guide(ArmDynamics::PerJoint& torque_Nm) noexcept {
  ArmDynamics::JointMatrix mass_kg_m2;
  dynamics_.equation(angle_rad_, speed_rad_s_, mass_kg_m2, torque_Nm);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Axis& axis = joints_[j];
    const double moved_rad = is_guided_ ? angle_rad_[j] - last_angle_rad_[j] : -axis.guided_rad;
    axis.guided_rad =
        std::clamp(axis.guided_rad + moved_rad, -kGuidingWidth_rad, kGuidingWidth_rad);
    torque_Nm[j] -=
        mass_kg_m2[j * (joints_.size() + 1)] * speed_rad_s_[j] / settings_.guiding_decay_s +
        axis.guiding_friction_Nm * axis.guided_rad / kGuidingWidth_rad;
  }
  last_angle_rad_ = angle_rad_;
  is_guided_ = true;
}

// T and q̈ of the links as they are.
void ArmController::find_swing(ArmDynamics::PerJoint& damping_s,
                               ArmDynamics::PerJoint& acceleration_rad_s2) const noexcept {
  const std::size_t n = joints_.size();
  ArmDynamics::JointMatrix mass_kg_m2;
  ArmDynamics::PerJoint bias_Nm = {};
  dynamics_.equation(angle_rad_, speed_rad_s_, mass_kg_m2, bias_Nm);
  for (std::size_t j = 0; j < n; ++j) {
    const double swing_rad_s = std::sqrt(joints_[j].stiffness_Nm_rad / mass_kg_m2[j * n + j]);
    const double ratio = swing_rad_s / settings_.fastest_swing_rad_s;
    damping_s[j] =
        2.0 * settings_.link_damping / swing_rad_s / (1.0 + ratio * ratio * ratio * ratio);
    acceleration_rad_s2[j] = output_.joints[j].link_Nm + output_.joints[j].external_Nm - bias_Nm[j];
  }
  solve_positive(std::span(mass_kg_m2).first(n * n), std::span(acceleration_rad_s2).first(n));
}

}  // namespace torsio
