#include "sim/arm/arm_plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"
#include "sim/arm/arm_step_limits.hpp"
#include "sim/plant/plant_input.hpp"

namespace torsio {
namespace {

bool is_finite(const ArmLoad& load) noexcept {
  double sum = 0.0;
  for (const double torque_Nm : load.torque_Nm) sum += torque_Nm;
  for (std::size_t i = 0; i < 3; ++i) sum += load.force_N[i] + load.moment_Nm[i];
  return std::isfinite(sum);
}

bool is_zero(const Vector3& of) noexcept { return of[0] == 0.0 && of[1] == 0.0 && of[2] == 0.0; }

void require_one_drive_per_joint(std::size_t joints, std::size_t drives) {
  if (joints == drives) return;
  throw Error({.place = "arm",
               .problem = "not one drive per joint",
               .expected = fmt::format("{} drives", joints),
               .found = std::to_string(drives)});
}

/// @returns the longest step that is asked for, or the default one
double checked_step(double longest_step_s, const ArmStepLimits& limits) {
  const double limit_s = std::min(limits.stiffness_s, limits.damping_s);
  if (longest_step_s == 0.0) return std::min(limit_s, ArmPlant::kDefaultStep_s);
  if (longest_step_s > 0.0 && longest_step_s <= limit_s) return longest_step_s;
  const bool is_stiff = limits.stiffness_s <= limits.damping_s;
  throw Error({.place = "arm",
               .problem = is_stiff ? "the step does not suit the stiffest mode"
                                   : "the step does not suit the strongest damping",
               .expected = fmt::format("0 s < step <= {:.3g} s", limit_s),
               .found = fmt::format("{:.3g} s", longest_step_s),
               .advice = is_stiff ? "shorten the step, or give the last links more inertia"
                                  : "shorten the step, or lower the viscous terms"});
}

/// Removes the rows and columns of clamped joints: what is left of them is q̈ᵢ = 0.
void clamp(const std::array<bool, kMaxArmJoints>& is_locked, std::size_t size,
           ArmDynamics::JointMatrix& mass_kg_m2, ArmDynamics::PerJoint& torque_Nm) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    if (!is_locked[i]) continue;
    for (std::size_t j = 0; j < size; ++j)
      mass_kg_m2[i * size + j] = mass_kg_m2[j * size + i] = 0.0;
    mass_kg_m2[i * size + i] = 1.0;
    torque_Nm[i] = 0.0;
  }
}

}  // namespace

ArmPlant::ArmPlant(const ArmModel& arm, std::span<const PlantParameters> drives,
                   FirstStageForm form, double longest_step_s)
    : dynamics_(arm) {
  require_one_drive_per_joint(arm.joints.size(), drives.size());
  joints_.reserve(drives.size());
  for (const PlantParameters& drive : drives)
    joints_.push_back({.drive = DriveTrain(drive, form),
                       .viscous_Nms_rad = drive.joint_viscous_Nms_rad,
                       .stiffest_stop_Nm_rad = 0.0});
  const ArmStepLimits limits = arm_step_limits(arm, drives, form);
  longest_step_s_ = checked_step(longest_step_s, limits);
  for (std::size_t i = 0; i < joints_.size(); ++i)
    joints_[i].stiffest_stop_Nm_rad =
        joints_[i].drive.stiffest_stop(limits.joint_inertia_kg_m2[i], longest_step_s_);
  rest_at_zero();
}

double ArmPlant::step_limit(const ArmModel& arm, std::span<const PlantParameters> drives,
                            FirstStageForm form) {
  require_one_drive_per_joint(arm.joints.size(), drives.size());
  const ArmStepLimits limits = arm_step_limits(arm, drives, form);
  return std::min(limits.stiffness_s, limits.damping_s);
}

void ArmPlant::rest_at_zero() noexcept {
  const ArmDynamics::PerJoint zero{};
  reset(std::span(zero).first(size()));
}

void ArmPlant::find_external(std::span<const double> angle_rad, const ArmLoad& load,
                             ArmDynamics::PerJoint& external_Nm) const noexcept {
  external_Nm = load.torque_Nm;
  if (is_zero(load.force_N) && is_zero(load.moment_Nm)) return;
  ArmDynamics::Jacobian jacobian;
  dynamics_.jacobian(angle_rad, jacobian);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t i = 0; i < size(); ++i)
      external_Nm[i] += jacobian[row * size() + i] * load.force_N[row] +
                        jacobian[(3 + row) * size() + i] * load.moment_Nm[row];
}

Fault ArmPlant::reset(std::span<const double> joint_angle_rad, const ArmLoad& load) noexcept {
  if (joint_angle_rad.size() != size()) return Fault::input_count_wrong;
  if (!is_finite(load)) return Fault::input_not_finite;
  ArmDynamics::PerJoint torque_Nm{};
  ArmDynamics::PerJoint external_Nm;
  std::array<PlantState, kMaxArmJoints> rest{};
  dynamics_.gravity_torque(joint_angle_rad, torque_Nm);
  find_external(joint_angle_rad, load, external_Nm);
  for (std::size_t i = 0; i < size(); ++i) {
    torque_Nm[i] = load.is_locked[i] ? 0.0 : torque_Nm[i] - external_Nm[i];
    rest[i] = joints_[i].drive.rest(joint_angle_rad[i], torque_Nm[i]);
    if (!torsio::is_finite(rest[i])) return Fault::input_not_finite;
  }
  for (std::size_t i = 0; i < size(); ++i) {
    joints_[i].state = rest[i];
    joints_[i].torques = joints_[i].drive.reset_at_rest(joints_[i].state, torque_Nm[i]);
  }
  external_Nm_ = external_Nm;
  return Fault::none;
}

Fault ArmPlant::reset(std::span<const PlantState> states) noexcept {
  if (states.size() != size()) return Fault::input_count_wrong;
  for (const PlantState& state : states)
    if (!torsio::is_finite(state)) return Fault::input_not_finite;
  for (std::size_t i = 0; i < size(); ++i) {
    joints_[i].state = states[i];
    joints_[i].torques = {};
    joints_[i].drive.reset(joints_[i].state);
  }
  external_Nm_ = {};
  return Fault::none;
}

Fault ArmPlant::set_condition(std::size_t joint, const PlantCondition& condition) noexcept {
  return joints_[joint].drive.set_condition(condition, joints_[joint].stiffest_stop_Nm_rad);
}

void ArmPlant::use(const std::optional<ArmPlate>& plate) {
  plate_.reset();
  if (!plate) return;
  constexpr auto kPlatePlace = "plate";
  const double length = std::sqrt(dot(plate->normal, plate->normal));
  require_parameter(std::abs(length - 1.0) < 1e-6, kPlatePlace, "a normal of length 1", length);
  require_parameter(
      plate->stiffness_N_m > 0.0 && plate->stiffness_N_m <= PlateContact::kLargestStiffness_N_m,
      kPlatePlace, "a stiffness above 0 and at most 1e6 N/m", plate->stiffness_N_m);
  require_not_negative(kPlatePlace, "the damping", plate->damping_Ns_m);
  require_parameter(plate->mass_kg == 0.0 || plate->mass_kg >= PlateContact::kSmallestMass_kg,
                    kPlatePlace, "a mass of 0.5 kg or more, or 0 for a clamped one",
                    plate->mass_kg);
  plate_.emplace(*plate);
}

void ArmPlant::set_period(double dt_s) noexcept {
  asked_dt_s_ = dt_s;
  small_steps_ = small_steps(dt_s, longest_step_s_);
  dt_s_ = dt_s / static_cast<double>(small_steps_);
  for (Joint& joint : joints_) joint.drive.set_period(dt_s_);
}

Fault ArmPlant::step(std::span<const PlantCommand> commands, const ArmLoad& load,
                     double dt_s) noexcept {
  if (commands.size() != size()) return Fault::input_count_wrong;
  const bool are_finite = std::ranges::all_of(
      commands, [](const PlantCommand& command) { return std::isfinite(command.current_A); });
  if (!are_finite || !is_finite(load) || !is_usable(dt_s, longest_step_s_))
    return Fault::input_not_finite;
  if (dt_s != asked_dt_s_) set_period(dt_s);
  for (std::size_t i = 0; i < small_steps_; ++i) small_step(commands, load);
  const bool is_sound = std::ranges::all_of(
      joints_, [](const Joint& joint) { return torsio::is_finite(joint.state); });
  if (is_sound) return Fault::none;
  rest_at_zero();
  return Fault::model_not_finite;
}

void ArmPlant::small_step(std::span<const PlantCommand> commands, const ArmLoad& load) noexcept {
  for (std::size_t i = 0; i < size(); ++i)
    joints_[i].drive.find_torques(commands[i], joints_[i].state, joints_[i].torques);
  ArmDynamics::PerJoint acceleration_rad_s2;
  accelerate(load, acceleration_rad_s2);
  for (std::size_t i = 0; i < size(); ++i) {
    PlantState& state = joints_[i].state;
    joints_[i].drive.move(commands[i], joints_[i].torques, state);
    state.joint_speed_rad_s =
        load.is_locked[i] ? 0.0 : state.joint_speed_rad_s + dt_s_ * acceleration_rad_s2[i];
    state.joint_angle_rad += dt_s_ * state.joint_speed_rad_s;
  }
  if (plate_) plate_->move(dt_s_);
}

void ArmPlant::touch_plate(std::span<const double> angle_rad,
                           std::span<const double> speed_rad_s) noexcept {
  ArmDynamics::Jacobian jacobian;
  const ArmFrame flange = dynamics_.jacobian(angle_rad, jacobian);
  Vector3 velocity_m_s{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t i = 0; i < size(); ++i)
      velocity_m_s[row] += jacobian[row * size() + i] * speed_rad_s[i];
  const Vector3 force_N = plate_->find_force(flange.position_m, velocity_m_s) * plate_->normal();
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t i = 0; i < size(); ++i)
      external_Nm_[i] += jacobian[row * size() + i] * force_N[row];
}

void ArmPlant::accelerate(const ArmLoad& load,
                          ArmDynamics::PerJoint& acceleration_rad_s2) noexcept {
  ArmDynamics::PerJoint angle_rad;
  ArmDynamics::PerJoint speed_rad_s;
  ArmDynamics::JointMatrix mass_kg_m2;
  ArmDynamics::PerJoint bias_Nm;
  for (std::size_t i = 0; i < size(); ++i) {
    angle_rad[i] = joints_[i].state.joint_angle_rad;
    speed_rad_s[i] = joints_[i].state.joint_speed_rad_s;
  }
  find_external(angle_rad, load, external_Nm_);
  if (plate_) touch_plate(angle_rad, speed_rad_s);
  dynamics_.equation(angle_rad, speed_rad_s, mass_kg_m2, bias_Nm);
  for (std::size_t i = 0; i < size(); ++i)
    acceleration_rad_s2[i] = joints_[i].torques.joint_Nm -
                             joints_[i].viscous_Nms_rad * speed_rad_s[i] + external_Nm_[i] -
                             bias_Nm[i];
  clamp(load.is_locked, size(), mass_kg_m2, acceleration_rad_s2);
  // A mass matrix that is not positive definite, of a state that is not finite, leaves NaN.
  solve_positive(std::span(mass_kg_m2).first(size() * size()),
                 std::span(acceleration_rad_s2).first(size()));
}

std::array<WorkPort, ArmPlant::kWorkPorts> ArmPlant::work_ports() const noexcept {
  using enum WorkPort::Kind;
  std::array<WorkPort, kWorkPorts> ports{};
  WorkPort* at = ports.data();
  for (std::size_t i = 0; i < size(); ++i) {
    const Joint& joint = joints_[i];
    at = std::ranges::copy(joint.drive.work_ports(joint.state, joint.torques), at).out;
    const double speed_rad_s = joint.state.joint_speed_rad_s;
    *at++ = {input, external_Nm_[i], speed_rad_s};
    *at++ = {loss, 0.0, speed_rad_s, joint.viscous_Nms_rad};
  }
  return ports;
}

StoredEnergy ArmPlant::stored_energy() const noexcept {
  ArmDynamics::PerJoint angle_rad;
  ArmDynamics::PerJoint speed_rad_s;
  StoredEnergy stored;
  for (std::size_t i = 0; i < size(); ++i) {
    const Joint& joint = joints_[i];
    angle_rad[i] = joint.state.joint_angle_rad;
    speed_rad_s[i] = joint.state.joint_speed_rad_s;
    stored.all_J +=
        joint.drive.kinetic_energy(joint.state) + joint.drive.elastic_energy(joint.state);
  }
  for (const WorkPort& port : work_ports()) stored.hysteretic_J += port.stored_J;
  stored.all_J += dynamics_.kinetic_energy(angle_rad, speed_rad_s) +
                  dynamics_.potential_energy(angle_rad) + stored.hysteretic_J;
  return stored;
}

}  // namespace torsio
