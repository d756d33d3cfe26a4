#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "rows.hpp"
#include "sim/arm/arm_plant.hpp"
#include "support/arm_drives.hpp"

namespace torsio::bench {
namespace {

constexpr double kStep_s = 1e-4;
constexpr std::size_t kJoints = 6;
constexpr std::size_t kSteps = 10'000;
using Commands = std::array<PlantCommand, kJoints>;

ArmPlant arm(FirstStageForm form) {
  return {test::arm6_with_8_kg(), test::arm6_drives(), form, kStep_s};
}

void expect(Fault fault) {
  if (fault != Fault::none) throw std::runtime_error("the arm refuses its input");
}

double spring_stiffness(const PlantParameters& drive) {
  return std::get<Spring::Parameters>(drive.second).elastic.stiffness_Nm_rad;
}
double gear_stiffness(const PlantParameters& drive) {
  return std::get<Gear::Parameters>(drive.first).stiffness_Nm_rad;
}
double torque_per_ampere(const PlantParameters& drive) {
  return total_ratio(drive) * drive.motor.torque_constant_Nm_A;
}

/// The output of a position loop on the rotor: each joint follows a sine of its own.
double loop_current(const ArmPlant& plant, std::size_t joint, double time_s) {
  const PlantParameters& drive = plant.drive(joint).parameters();
  const double frequency_Hz = 0.4 + 0.07 * static_cast<double>(joint);
  const double wanted_rad = 0.3 * std::sin(2.0 * std::numbers::pi * frequency_Hz * time_s);
  const double angle_rad = plant.state(joint).rotor_angle_rad / total_ratio(drive);
  const double speed_rad_s = plant.state(joint).rotor_speed_rad_s / total_ratio(drive);
  return spring_stiffness(drive) * (2.0 * (wanted_rad - angle_rad) - 0.15 * speed_rad_s) /
         torque_per_ampere(drive);
}

/// The motor currents of a second in which all joints move.
std::vector<Commands> commands_of_a_second(FirstStageForm form) {
  ArmPlant plant = arm(form);
  std::vector<Commands> commands(kSteps);
  for (std::size_t i = 0; i < kSteps; ++i) {
    for (std::size_t j = 0; j < kJoints; ++j)
      commands[i][j].current_A = loop_current(plant, j, static_cast<double>(i) * kStep_s);
    expect(plant.step(commands[i], {}, kStep_s));
  }
  return commands;
}

Row steps_per_second(FirstStageForm form) {
  const std::vector<Commands> commands = commands_of_a_second(form);
  ArmPlant plant = arm(form);
  const std::array<double, kJoints> start_rad{};
  const double seconds = best_seconds([&] {
    expect(plant.reset(start_rad));
    for (const Commands& now : commands) expect(plant.step(now, {}, kStep_s));
  });
  return {.value = static_cast<double>(kSteps) / seconds, .unit = "steps/s"};
}

/// A body of MuJoCo that turns about the axis of a joint of the arm, and remains open.
std::string body(const Vector3& position_m, const BodyInertia& inertia, const Vector3& axis,
                 const std::string& joint) {
  return fmt::format(
      "<body pos='{}'><inertial pos='{}' mass='{}' fullinertia='{}'/>"
      "<joint type='hinge' axis='{}' {}/>",
      fmt::join(position_m, " "), fmt::join(inertia.com_m, " "), inertia.mass_kg,
      fmt::join(inertia.inertia_kg_m2, " "), fmt::join(axis, " "), joint);
}

/// Rotor (an armature J N² on its joint), gear if it is elastic, spring and link of a joint.
std::string bodies(const ArmJoint& joint, const BodyInertia& link, const PlantParameters& drive,
                   std::size_t number, FirstStageForm form) {
  const double ratio = total_ratio(drive);
  const double middle_kg_m2 = drive.middle_inertia_kg_m2;
  const BodyInertia light{1e-3, {}, {1e-6, 1e-6, 1e-6}};
  const BodyInertia middle{1e-3, {}, {middle_kg_m2, middle_kg_m2, middle_kg_m2}};
  const bool is_rigid = form == FirstStageForm::rigid;
  std::string text = body(joint.origin.position_m, is_rigid ? middle : light, joint.axis,
                          fmt::format("name='rotor{}' armature='{}'", number,
                                      drive.rotor_inertia_kg_m2 * ratio * ratio));
  if (!is_rigid)
    text += body({}, middle, joint.axis, fmt::format("stiffness='{}'", gear_stiffness(drive)));
  return text + body({}, link, joint.axis, fmt::format("stiffness='{}'", spring_stiffness(drive)));
}

/// The same arm for MuJoCo, with plain springs and without any friction.
std::string mujoco_model(FirstStageForm form) {
  const ArmModel model = test::arm6_with_8_kg();
  const std::vector<PlantParameters> drives = test::arm6_drives();
  std::string text =
      "<mujoco><compiler angle='radian' inertiafromgeom='false' balanceinertia='true'/>"
      "<option timestep='1e-4' integrator='Euler' gravity='0 0 -9.81'>"
      "<flag contact='disable' constraint='disable'/></option><worldbody>";
  std::string motors;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ArmJoint& joint = model.joints[j];
    const bool is_last = j + 1 == kJoints;
    text += bodies(joint,
                   is_last ? together(joint.body, moved(model.payload, model.flange)) : joint.body,
                   drives[j], j, form);
    motors += fmt::format("<motor joint='rotor{}' gear='{}'/>", j, torque_per_ampere(drives[j]));
  }
  const std::size_t open = kJoints * (form == FirstStageForm::rigid ? 2 : 3);
  for (std::size_t i = 0; i < open; ++i) text += "</body>";
  return text + "</worldbody><actuator>" + motors + "</actuator></mujoco>";
}

void write_inputs(FirstStageForm form) {
  std::ofstream(scratch_folder() / "arm.xml") << mujoco_model(form);
  std::vector<double> currents_A;
  for (const Commands& now : commands_of_a_second(form))
    for (const PlantCommand& command : now) currents_A.push_back(command.current_A);
  write_doubles("arm_commands_A.f64", currents_A);
}

}  // namespace

Row arm_simulate() { return steps_per_second(FirstStageForm::rigid); }
Row arm_simulate_gears() { return steps_per_second(FirstStageForm::elastic); }
void write_arm_inputs() { write_inputs(FirstStageForm::rigid); }
void write_arm_gears_inputs() { write_inputs(FirstStageForm::elastic); }

}  // namespace torsio::bench
