#include "sim/joints/linked_joint.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/joints/linked_arm.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

/// A new model runs in parallel with the one in use until its filters and memory have settled.
constexpr std::uint32_t kTrialTicks = 500;

constexpr std::array<std::string_view, kJointChannels> kChannelNames = {"motor_angle_rad",
                                                                        "gear_angle_rad",
                                                                        "joint_angle_rad",
                                                                        "joint_speed_rad_s",
                                                                        "motor_current_A",
                                                                        "torque_Nm",
                                                                        "torque_std_dev_Nm",
                                                                        "wanted_torque_Nm",
                                                                        "external_torque_Nm",
                                                                        "thermal_load_1",
                                                                        "command_current_A",
                                                                        "reference_mode_1",
                                                                        "reference_angle_rad",
                                                                        "reference_speed_rad_s",
                                                                        "reference_torque_Nm",
                                                                        "phase_1",
                                                                        "limit_1",
                                                                        "fault_1",
                                                                        "is_ready_1",
                                                                        "truth_torque_Nm",
                                                                        "truth_external_torque_Nm"};

constexpr auto kSensors = std::to_array<JointFaults::Sensor>({
    {&Measurement::motor_angle_rad, &Measurement::is_motor_angle_fresh, true},
    {&Measurement::middle_angle_rad, &Measurement::is_middle_angle_fresh, true},
    {&Measurement::joint_angle_rad, &Measurement::is_joint_angle_fresh, true},
    {},
    {&Measurement::motor_current_A, &Measurement::is_motor_current_fresh},
});

/// A stop of the spring that a fault makes, over its stiffness.
constexpr double kStopTimes = 10.0;
/// Stiffness and damping of the impedance until a host sets them: shares of the spring's stiffness.
constexpr double kSoftShare = 0.2;
constexpr double kSoftDamping_s = 0.03;
constexpr double kLargestDamping_s = 0.1;

bool is_within(double value, double lowest, double highest) noexcept {
  return value >= lowest && value <= highest;
}

bool uses_position(JointMode mode) noexcept {
  return mode == JointMode::position || mode == JointMode::impedance;
}

}  // namespace

LinkedJoint::LinkedJoint(LinkedArm& arm, std::size_t index, const DataSheet& sheet,
                         const ArmJoint& joint, const ArmController::Joint& settings,
                         std::string model)
    : arm_(arm),
      index_(index),
      sheet_(sheet),
      actuator_(full_name(sheet)),
      serial_(sheet.serial ? std::to_string(*sheet.serial) : "nominal"),
      drive_(settings.control.torque.deflection.joint.drive),
      stiffness_Nm_rad_(settings.control.torque.deflection.joint.stiffness_Nm_rad),
      wound_rad_(joint.effort_Nm / stiffness_Nm_rad_),
      highest_damping_Nms_rad_(kLargestDamping_s * stiffness_Nm_rad_),
      limits_{.lowest_rad = joint.lowest_rad,
              .highest_rad = joint.highest_rad,
              .speed_rad_s = joint.speed_rad_s,
              .torque_Nm = joint.effort_Nm},
      largest_limits_(limits_),
      gains_(*settings.control.gains),
      faults_(kSensors,
              std::min(kStopTimes * stiffness_Nm_rad_, arm.bench().plant().stiffest_stop(index))),
      upload_(sheet) {
  impedance = {.stiffness_Nm_rad = kSoftShare * stiffness_Nm_rad_,
               .damping_Nms_rad = kSoftShare * kSoftDamping_s * stiffness_Nm_rad_};
  if (model.empty()) model = "linear spring of the data sheet";
  model_size_ = model.copy(model_.data(), model_.size());
  faults_.prepare(arm.bench().faults(index));
}

LinkJoint::Identity LinkedJoint::identity() const noexcept {
  return {.name = arm_.setup().arm.joints[index_].name,
          .version = kVersion,
          .serial = serial_,
          .actuator = actuator_};
}

// A first speed needs some samples.
bool LinkedJoint::is_initialised() const noexcept { return is_at_rest(); }
bool LinkedJoint::is_at_rest() const noexcept { return arm_.is_sensed() && arm_.is_at_rest(); }

LinkStateReason LinkedJoint::own_stop() const noexcept {
  return is_enabled_ ? arm_.stop_reason() : LinkStateReason::none;
}

const ArmController::JointOutput& LinkedJoint::output() const noexcept {
  return arm_.output().joints[index_];
}

LinkRefusal LinkedJoint::enable() noexcept {
  if (has_fault() || !arm_.may_enable()) return LinkRefusal::not_in_this_state;
  is_enabled_ = true;
  has_reference_ = false;
  arm_.enabled();
  return LinkRefusal::none;
}

void LinkedJoint::disable() noexcept {
  is_enabled_ = false;
  held_mode_ = JointMode::position;
  arm_.disabled();
}

void LinkedJoint::stop(StopCategory category) noexcept { arm_.stop(category); }

bool LinkedJoint::is_in_range(const JointReference& reference) const noexcept {
  const double torque_Nm = limits_.torque_Nm;
  if (uses_position(reference.mode) &&
      !is_within(reference.position_rad, limits_.lowest_rad, limits_.highest_rad))
    return false;
  return std::abs(reference.velocity_rad_s) <= limits_.speed_rad_s &&
         std::abs(reference.torque_Nm) <= torque_Nm &&
         std::abs(reference.current_A) <= drive_.peak_current_A &&
         std::abs(stiffness_Nm_rad_ * reference.deflection_rad) <= torque_Nm &&
         is_within(reference.stiffness_Nm_rad, 0.0, stiffness_Nm_rad_) &&
         is_within(reference.damping_Nms_rad, 0.0, highest_damping_Nms_rad_);
}

LinkRefusal LinkedJoint::apply(const JointReference& reference) noexcept {
  if (!is_enabled_ || !arm_.is_running()) return LinkRefusal::not_in_this_state;
  if (!is_finite(reference)) return LinkRefusal::not_finite;
  if (!is_in_range(reference)) return LinkRefusal::out_of_range;
  reference_ = reference;
  has_reference_ = true;
  return LinkRefusal::none;
}

// Before the joint runs only modes in which it holds its position.
LinkRefusal LinkedJoint::change_mode(JointMode mode) noexcept {
  if (!is_enabled_ || !arm_.output().is_ready) {
    if (!uses_position(mode)) return LinkRefusal::not_in_this_state;
    held_mode_ = mode;
    return LinkRefusal::none;
  }
  const std::optional<JointReference> held = present(mode);
  if (!held) return LinkRefusal::not_in_this_state;
  reference_ = *held;
  has_reference_ = true;
  return LinkRefusal::none;
}

/// A reference that changes neither motion nor torque; none without measurements.
std::optional<JointReference> LinkedJoint::present(JointMode mode) const noexcept {
  const JointSample& sample = arm_.sample(index_);
  const double deflection_rad = sample.spring_deflection_rad();
  const double angle_rad = sample.motor_angle_rad / drive_.ratio;
  JointReference held{.mode = mode};
  if (!std::isfinite(deflection_rad + angle_rad)) return std::nullopt;
  held.torque_Nm = mode == JointMode::current ? 0.0 : output().torque.value;
  held.current_A = mode == JointMode::current ? output().current_A : 0.0;
  held.deflection_rad = mode == JointMode::deflection ? deflection_rad : 0.0;
  if (!uses_position(mode)) return held;
  held.position_rad = angle_rad;
  if (mode == JointMode::impedance) {
    held.stiffness_Nm_rad = impedance.stiffness_Nm_rad;
    held.damping_Nms_rad = impedance.damping_Nms_rad;
  }
  return held;
}

JointReference LinkedJoint::reference(bool is_ready) noexcept {
  if (!is_enabled_ || !is_ready) {
    followed_ = present(held_mode_).value_or(followed_);
    return followed_;
  }
  if (has_reference_) followed_ = reference_;
  return followed_;
}

std::span<const std::string_view> LinkedJoint::channels() const noexcept { return kChannelNames; }

void LinkedJoint::measure(std::span<float> values) const noexcept {
  const JointSample& sample = arm_.sample(index_);
  const ArmController::JointOutput& out = output();
  const ArmPlant& plant = arm_.bench().plant();
  const std::array<double, kJointChannels> all = {sample.motor_angle_rad,
                                                  sample.gear_angle_rad,
                                                  sample.joint_angle_rad,
                                                  out.speed_rad_s,
                                                  sample.motor_current_A,
                                                  out.torque.value,
                                                  out.torque.std_dev,
                                                  out.wanted_Nm,
                                                  out.external_Nm,
                                                  out.thermal_load,
                                                  out.current_A,
                                                  static_cast<double>(followed_.mode),
                                                  followed_.position_rad,
                                                  followed_.velocity_rad_s,
                                                  followed_.torque_Nm,
                                                  static_cast<double>(out.phase),
                                                  static_cast<double>(out.limit),
                                                  static_cast<double>(out.fault),
                                                  arm_.output().is_ready ? 1.0 : 0.0,
                                                  plant.torques(index_).joint_Nm,
                                                  plant.external_torque(index_)};
  std::ranges::transform(std::span(all).first(std::min(values.size(), all.size())), values.begin(),
                         [](double value) { return static_cast<float>(value); });
}

JointSample LinkedJoint::zeroed(const JointSample& sample) noexcept {
  JointSample zeroed = sample;
  zeroed.motor_angle_rad -= zero_.motor_angle_rad;
  zeroed.gear_angle_rad -= zero_.gear_angle_rad;
  zeroed.joint_angle_rad -= zero_.joint_angle_rad;
  const bool is_measured = std::isfinite(zeroed.motor_angle_rad + zeroed.spring_deflection_rad());
  lost_ = is_measured ? 0 : lost_ + 1;
  return zeroed;
}

void LinkedJoint::end_fault(bool has_ended) noexcept {
  if (has_ended && lost_ == 0 && fault_ticks_ > 0) --fault_ticks_;
}

LinkRefusal LinkedJoint::zero(std::uint8_t channel, double value) noexcept {
  if (!arm_.may_enable()) return LinkRefusal::not_in_this_state;
  const JointSample& sample = arm_.sample(index_);
  double present = kNotMeasured;
  double* zero = nullptr;
  switch (static_cast<JointChannel>(channel)) {
    case JointChannel::motor_angle:
      present = sample.motor_angle_rad;
      zero = &zero_.motor_angle_rad;
      break;
    case JointChannel::gear_angle:
      present = sample.gear_angle_rad;
      zero = &zero_.gear_angle_rad;
      break;
    case JointChannel::joint_angle:
      present = sample.joint_angle_rad;
      zero = &zero_.joint_angle_rad;
      break;
    case JointChannel::torque:
      present = output().torque.value;
      zero = &torque_zero_Nm_;
      break;
    default: return LinkRefusal::not_supported;
  }
  if (!std::isfinite(present)) return LinkRefusal::not_in_this_state;
  *zero += present - value;
  arm_.controller().set_torque_zero(index_, torque_zero_Nm_);
  arm_.restart_filters();
  return LinkRefusal::none;
}

LinkRefusal LinkedJoint::inject_fault(const LinkInjectFault& fault) noexcept {
  return faults_.inject(arm_.bench().faults(index_), fault, arm_.bench().time_s());
}

std::span<std::uint8_t> LinkedJoint::begin_upload(std::size_t size,
                                                  std::string_view actuator) noexcept {
  if (arm_.controller().monitored(index_) != nullptr) return {};
  return upload_.begin(size, actuator);
}

LinkRefusal LinkedJoint::commit_upload(std::span<const std::uint8_t> file) noexcept {
  upload_result_.reset();
  tried_ticks_ = 0;
  upload_.commit(file.size());
  return LinkRefusal::none;
}

std::optional<LinkRefusal> LinkedJoint::poll_upload() noexcept {
  return std::exchange(upload_result_, std::nullopt);
}

void LinkedJoint::try_model() noexcept {
  if (upload_.is_rejected()) {
    upload_result_ = LinkRefusal::upload_rejected;
    upload_.end();
    return;
  }
  ArmJointModel* const model = upload_.checked();
  if (model == nullptr) return;
  const JointSample& sample = arm_.sample(index_);
  static_cast<void>(model->estimator->step(sample));
  static_cast<void>(model->inverse.step(output().torque.value, sample));
  if (++tried_ticks_ < kTrialTicks) return;
  const std::string_view description = upload_.description();
  const bool is_used = arm_.controller().exchange_model(index_, *model);
  if (is_used) model_size_ = description.copy(model_.data(), model_.size());
  upload_result_ = is_used ? LinkRefusal::none : LinkRefusal::upload_rejected;
  upload_.end();
}

LinkRefusal LinkedJoint::set_limits(const Limits& limits) noexcept {
  const double angle_rad = arm_.sample(index_).motor_angle_rad / drive_.ratio;
  if (!is_within(angle_rad, limits.lowest_rad, limits.highest_rad) ||
      !arm_.controller().set_limits(index_, limits.lowest_rad - wound_rad_,
                                    limits.highest_rad + wound_rad_, limits.speed_rad_s,
                                    limits.torque_Nm))
    return LinkRefusal::out_of_range;
  limits_ = limits;
  return LinkRefusal::none;
}

LinkRefusal LinkedJoint::set_gains(const JointCascade::Gains& gains) noexcept {
  if (!arm_.controller().set_gains(index_, gains)) return LinkRefusal::out_of_range;
  gains_ = gains;
  return LinkRefusal::none;
}

}  // namespace torsio
