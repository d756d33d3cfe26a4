#include <algorithm>
#include <array>
#include <cmath>

#include "torsio/arm/arm_controller.hpp"

// What `ArmController` does about contacts, and the words for its modes and stops.

namespace torsio {
namespace {

// Below the thresholds for this time, a contact is over: an error that is about as large as they are is one contact. A lower
// share of them would keep a contact for seconds where a factor is small: errors are often above half of it.
constexpr double kContactEnd_s = 0.5;
constexpr double kYielding_s = 0.3;  // time in which a reaction ends an overload

}  // namespace

void ArmController::end_reaction() noexcept {
  output_.contact = {};
  // The next reference of the position mode must be near the measured angles.
  is_following_ = is_following_ && !is_reacting_;
  is_reacting_ = false;
  no_contact_s_ = 0.0;
  if (contacts_) contacts_->reset();
}

void ArmController::find_contact(const ArmReference& reference,
                                 std::span<const JointSample> samples) noexcept {
  if (!contacts_) return;
  ArmDynamics::PerJoint external_Nm;
  bool is_running = output_.cause == ArmStopCause::none && is_started_;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    external_Nm[j] = output_.joints[j].external_Nm;
    is_running = is_running && joints_[j].stop.phase() == JointStop::Phase::running;
  }
  if (!is_running) contacts_->reset();
  // A reference that is followed has accelerations; elsewhere none is wanted.
  const ArmDynamics::PerJoint rest = {};
  const ContactDetector::Output& found = contacts_->step(
      dynamics_, angle_rad_, speed_rad_s_,
      is_following_ && !is_reacting_ ? reference.acceleration_rad_s2 : rest, external_Nm);
  for (std::size_t j = 0; j < joints_.size(); ++j)
    output_.joints[j].external_std_Nm = found.std_dev_Nm[j];
  if (!is_running || is_reacting_) return;
  no_contact_s_ = found.is_contact ? 0.0 : no_contact_s_ + period_s_;
  if (no_contact_s_ > kContactEnd_s) output_.contact.is_found = false;
  if (!found.is_contact || output_.contact.is_found) return;
  output_.contact = {.is_found = true,
                     .joint = found.joint,
                     .time_s = samples.empty() ? kNotMeasured : samples[found.joint].t_s};
  react();
}

void ArmController::react() noexcept {
  if (!is_following_ && !is_holding_) return;
  output_.contact.reaction = settings_.reaction;
  switch (settings_.reaction) {
    case ContactReaction::none: return;
    case ContactReaction::stop: find(ArmStopCause::contact, output_.contact.joint); return;
    case ContactReaction::floating: reacting_ = {.mode = ArmMode::guiding}; break;
    case ContactReaction::hold:
    case ContactReaction::retract: {
      ArmDynamics::PerJoint external_Nm = {};
      ArmDynamics::PerJoint rotor_kg_m2 = {};
      ArmDynamics::PerJoint limit_rad_s = {};
      ArmDynamics::PerJoint speed_rad_s = {};
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        external_Nm[j] = output_.joints[j].external_Nm;
        rotor_kg_m2[j] = joints_[j].drive.inertia();
        limit_rad_s[j] = joints_[j].speed_limit_rad_s;
        speed_rad_s[j] = is_following_ ? speed_rad_s_[j] : 0.0;
      }
      // From where the links are and as fast: the reference is ahead of them, inside of what they touch.
      reaction_.begin(dynamics_, angle_rad_, speed_rad_s, external_Nm, rotor_kg_m2, limit_rad_s,
                      settings_.reaction == ContactReaction::retract);
      reacting_ = {.mode = ArmMode::position};
      break;
    }
  }
  is_reacting_ = true;
  reacting_s_ = 0.0;
}

bool ArmController::is_yielding() const noexcept {
  return is_reacting_ && reacting_s_ < kYielding_s &&
         (settings_.reaction == ContactReaction::retract ||
          settings_.reaction == ContactReaction::floating);
}

const ArmReference& ArmController::reaction_reference() noexcept {
  reacting_s_ += period_s_;
  if (reacting_.mode != ArmMode::position) return reacting_;
  const ReactionMotion::Output& motion = reaction_.step();
  reacting_.position_rad = motion.position_rad;
  reacting_.velocity_rad_s = motion.velocity_rad_s;
  reacting_.acceleration_rad_s2 = motion.acceleration_rad_s2;
  return reacting_;
}

std::string_view name(ArmMode mode) noexcept {
  switch (mode) {
    case ArmMode::joints: return "joints";
    case ArmMode::position: return "position";
    case ArmMode::impedance: return "impedance";
    case ArmMode::cartesian: return "cartesian";
    case ArmMode::guiding: return "guiding";
  }
  return "unknown";
}

std::string_view name(ArmStopCause cause) noexcept {
  switch (cause) {
    case ArmStopCause::none: return "none";
    case ArmStopCause::requested: return "requested";
    case ArmStopCause::measurement: return "measurement";
    case ArmStopCause::monitor: return "monitor";
    case ArmStopCause::overload: return "overload";
    case ArmStopCause::contact: return "contact";
  }
  return "unknown";
}

}  // namespace torsio
