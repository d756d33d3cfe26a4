#include "sim/arm/arm_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

std::vector<PlantParameters> drives_of(const ArmSetup& setup) {
  std::vector<PlantParameters> drives;
  for (const ArmJointSetup& joint : setup.joints) drives.push_back(plant_parameters(joint.sheet));
  return drives;
}

}  // namespace

ArmBench::Joint::Joint(const DataSheet& sheet, const FaultSchedule& schedule, std::uint64_t seed)
    : sensors(sheet, kBenchRate_Hz, seed),
      faults(schedule, sheet),
      has_faults(!schedule.faults.empty()),
      engage_s(brake_sheet(sheet).engage_s.value),
      release_s(brake_sheet(sheet).release_s.value) {}

ArmBench::ArmBench(const ArmSetup& setup, FirstStageForm form,
                   std::span<const FaultSchedule> faults, std::uint64_t seed,
                   std::span<const double> start_rad, double longest_step_s)
    : plant_(setup.arm, drives_of(setup), form,
             longest_step_s > 0.0
                 ? std::min(longest_step_s, ArmPlant::step_limit(setup.arm, drives_of(setup), form))
                 : 0.0),
      samples_(setup.joints.size()),
      commands_(setup.joints.size()) {
  if (const Fault fault = plant_.reset(start_rad); fault != Fault::none)
    throw Error({.place = setup.arm.name,
                 .problem = fmt::format("the arm refuses its start: {}", name(fault))});
  Random seeds(seed);
  joints_.reserve(setup.joints.size());
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    joints_.emplace_back(setup.joints[j].sheet, faults.empty() ? FaultSchedule{} : faults[j],
                         seeds.bits());
    joints_[j].sensors.reset(plant_.torques(j).joint_Nm);
  }
}

Vector3 ArmBench::flange_m() const {
  ArmDynamics::PerJoint angle_rad = {};
  for (std::size_t j = 0; j < plant_.size(); ++j) angle_rad[j] = plant_.state(j).joint_angle_rad;
  return plant_.dynamics().flange(angle_rad).position_m;
}

void ArmBench::use(ArmPlate plate) {
  if (plate.is_from_flange) plate.at_m = plate.at_m + flange_m();
  plant_.use(plate);
}

SensedPlant ArmBench::sensed(std::size_t joint) const noexcept {
  const PlantState& state = plant_.state(joint);
  return {.state = state,
          .second_twist_rad = state.middle_angle_rad - state.joint_angle_rad,
          .current_A = plant_.current(joint)};
}

void ArmBench::sense() {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    joint.measured = joint.sensors.step(sensed(j), plant_.torques(j).joint_Nm);
    if (joint.has_faults) joint.faults.apply(joint.measured, time_s());
    samples_[j] = {.t_s = static_cast<double>(tick_) / kBenchRate_Hz,
                   .motor_angle_rad = joint.measured.motor_angle_rad,
                   .gear_angle_rad = joint.measured.middle_angle_rad,
                   .joint_angle_rad = joint.measured.joint_angle_rad,
                   .motor_current_A = joint.measured.motor_current_A};
  }
}

void ArmBench::act(std::span<const Command> commands, const ArmLoad& load) {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    joint.since_s = commands[j].is_brake_open == joint.is_open ? joint.since_s + kArmTick_s : 0.0;
    joint.is_open = commands[j].is_brake_open;
    if (joint.since_s >= (joint.is_open ? joint.release_s : joint.engage_s))
      joint.is_held = !joint.is_open;
    commands_[j] = {.current_A = commands[j].current_A,
                    .is_motor_held = joint.is_held,
                    .is_powered = commands[j].is_powered};
    if (!joint.has_faults) continue;
    if (const Fault fault = plant_.set_condition(j, joint.faults.condition(time_s()));
        fault != Fault::none)
      throw Error({.place = fmt::format("joint {} at {} s", j + 1, time_s()),
                   .problem = fmt::format("the arm refuses its condition: {}", name(fault))});
  }
  if (const Fault fault = plant_.step(commands_, load, kArmTick_s); fault != Fault::none)
    throw Error({.place = fmt::format("arm at {} s", time_s()),
                 .problem = fmt::format("the arm refuses its commands or load: {}", name(fault))});
  ++tick_;
}

}  // namespace torsio
