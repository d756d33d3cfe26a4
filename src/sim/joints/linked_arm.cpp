#include "sim/joints/linked_arm.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// After this time without power taken over by the motors, the arm stops.
constexpr std::uint32_t kLongestReleaseTicks = 2000;

/// Without the stiff stage of the gear longer steps suffice.
constexpr double kRigidStep_s = 5e-4;

std::vector<double> start_angles(const ArmModel& arm) {
  std::vector<double> start_rad;
  for (const ArmJoint& joint : arm.joints)
    start_rad.push_back(joint.lowest_rad < 0.0 && joint.highest_rad > 0.0
                            ? 0.0
                            : 0.5 * (joint.lowest_rad + joint.highest_rad));
  return start_rad;
}

FirstStageForm form_of(const ArmSetup& setup, bool has_gear_stage) {
  const bool slips = std::ranges::any_of(setup.joints, [](const ArmJointSetup& joint) {
    return std::holds_alternative<ClutchSheet>(joint.sheet.first);
  });
  return has_gear_stage || slips ? FirstStageForm::elastic : FirstStageForm::rigid;
}

bool is_fault(ArmStopCause cause) noexcept {
  return cause != ArmStopCause::none && cause != ArmStopCause::requested;
}

}  // namespace

LinkedArm::LinkedArm(ServedArm arm, bool has_gear_stage, std::uint64_t seed)
    : LinkedArm(arm, arm_controller_settings(arm.setup), form_of(arm.setup, has_gear_stage), seed) {
}

LinkedArm::LinkedArm(ServedArm& arm, const ArmController::Settings& settings, FirstStageForm form,
                     std::uint64_t seed)
    : arm_(std::move(arm)),
      bench_(arm_.setup, form, arm_.faults, seed, start_angles(arm_.setup.arm),
             form == FirstStageForm::rigid ? kRigidStep_s : 0.0),
      controller_(settings, kBenchRate_Hz),
      samples_(arm_.setup.joints.size()),
      commands_(arm_.setup.joints.size()) {
  for (std::size_t j = 0; j < arm_.setup.joints.size(); ++j)
    joints_.push_back(std::make_unique<LinkedJoint>(*this, j, arm_.setup.joints[j].sheet,
                                                    arm_.setup.arm.joints[j], settings.joints[j],
                                                    arm_.setup.joints[j].model));
}

void LinkedArm::sense() noexcept {
  if (is_broken_) {
    for (auto& joint : joints_) joint->found_fault();
    return;
  }
  bench_.sense();
  for (std::size_t j = 0; j < size(); ++j) samples_[j] = joints_[j]->zeroed(bench_.samples()[j]);
}

void LinkedArm::control() noexcept {
  if (is_broken_) return;
  if (is_release_wanted_) open_brakes();
  for (std::size_t j = 0; j < size() && is_sensed(); ++j)
    wanted_.joints[j] = joints_[j]->reference(output().is_ready);
  output_ = &controller_.step(wanted_, samples_);
  find_faults();
  end_stop();
  for (auto& joint : joints_) joint->try_model();
  act();
}

void LinkedArm::act() noexcept {
  for (std::size_t j = 0; j < size(); ++j) {
    const ArmController::JointOutput& out = output().joints[j];
    commands_[j] = {out.current_A, out.is_powered, out.is_brake_open};
  }
  // Only a simulation beyond all bounds ends here, and then the time of the cycle does not matter.
  try {
    bench_.act(commands_, {});
  } catch (const Error&) {
    is_broken_ = true;
    stop_reason_ = LinkStateReason::joint_fault;
  }
}

bool LinkedArm::is_off() const noexcept {
  return output().is_at_rest &&
         std::ranges::all_of(std::span(output().joints).first(size()), [](const auto& joint) {
           return joint.phase == JointStop::Phase::off;
         });
}

bool LinkedArm::may_enable() const noexcept {
  return is_sensed() && !is_broken_ && !is_started_ && stop_reason_ == LinkStateReason::none &&
         is_at_rest();
}

void LinkedArm::enabled() noexcept {
  if (!std::ranges::all_of(joints_, [](const auto& joint) { return joint->is_enabled(); })) return;
  is_started_ = true;
  is_release_wanted_ = true;
  release_ticks_ = 0;
}

void LinkedArm::open_brakes() noexcept {
  if (controller_.release()) {
    is_release_wanted_ = false;
    last_cause_ = ArmStopCause::none;
  } else if (++release_ticks_ > kLongestReleaseTicks) {
    stop(StopCategory::power_off);
    stop_reason_ = LinkStateReason::joint_fault;
  }
}

void LinkedArm::stop(StopCategory category) noexcept {
  controller_.stop(category);
  is_release_wanted_ = false;
  if (stop_reason_ == LinkStateReason::none) stop_reason_ = LinkStateReason::requested;
}

// In a fault the joints go to rest under power if they can, then the brakes close: the controller does this by itself.
void LinkedArm::disabled() noexcept {
  if (!is_started_) return;
  const bool is_stopping_by_itself =
      stop_reason_ == LinkStateReason::joint_fault && !output().is_at_rest;
  if (!is_stopping_by_itself) stop(StopCategory::power_off);
}

void LinkedArm::find_faults() noexcept {
  if (is_fault(output().cause) && last_cause_ == ArmStopCause::none) {
    joints_[output().joint]->found_fault();
    stop_reason_ = LinkStateReason::joint_fault;
  }
  last_cause_ = output().cause;
  for (auto& joint : joints_) {
    joint->end_fault(output().is_at_rest);
    if (!joint->is_lost()) continue;
    joint->found_fault();
    if (is_started_) stop_reason_ = LinkStateReason::joint_fault;
  }
}

// The stop is over when no joint is enabled any more: then all may be enabled again.
void LinkedArm::end_stop() noexcept {
  if (stop_reason_ == LinkStateReason::none || !output().is_at_rest) return;
  if (std::ranges::any_of(joints_, [](const auto& joint) { return joint->is_enabled(); })) return;
  stop_reason_ = LinkStateReason::none;
  is_started_ = false;
}

}  // namespace torsio
