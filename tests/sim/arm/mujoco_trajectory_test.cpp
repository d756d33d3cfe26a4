// The motion of an arm with plain springs, 12 degrees of freedom, against MuJoCo 2.2.2, where it is installed.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include "sim/arm/arm_plant.hpp"
#include "support/arm_drives.hpp"
#include "support/mujoco_model.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;
constexpr double kDuration_s = 5.0;

/// Motor and spring alone: no friction, play, ripple nor lag.
PlantParameters plain(const PlantParameters& full) {
  PlantParameters drive = full;
  drive.motor.ripple = 0.0;
  drive.motor.current_time_constant_s = 1e-9;
  drive.motor.peak_current_A = 1e6;
  drive.motor.supply_V = 1e6;
  drive.rotor_friction = {};
  drive.middle_friction = {};
  drive.bearing = {};
  drive.joint_viscous_Nms_rad = 0.0;
  auto& spring = std::get<Spring::Parameters>(drive.second);
  spring = {.elastic = {.stiffness_Nm_rad = spring.elastic.stiffness_Nm_rad},
            .friction = MaxwellSlip<4>::Parameters{.share = {0.25, 0.25, 0.25, 0.25},
                                                   .break_away_rad = {1.0, 1.0, 1.0, 1.0}}};
  return drive;
}

double stiffness(const PlantParameters& drive) {
  return std::get<Spring::Parameters>(drive.second).elastic.stiffness_Nm_rad;
}

std::string model_text(const ArmModel& arm, const std::vector<PlantParameters>& drives) {
  std::string text = test::mujoco_begin(arm);
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const ArmJoint& joint = arm.joints[j];
    const double ratio = total_ratio(drives[j]);
    text += fmt::format(
        "<body pos='{}'><inertial pos='0 0 0' mass='1e-9' diaginertia='1e-12 1e-12 1e-12'/>"
        "<joint type='hinge' axis='{}' armature='{}'/>"
        "<body>{}"
        "<joint type='hinge' axis='{}' stiffness='{}'/>",
        fmt::join(joint.origin.position_m, " "), fmt::join(joint.axis, " "),
        drives[j].rotor_inertia_kg_m2 * ratio * ratio + drives[j].middle_inertia_kg_m2,
        test::mujoco_inertial(test::loaded_link(arm, j)), fmt::join(joint.axis, " "),
        stiffness(drives[j]));
  }
  for (std::size_t j = 0; j < 2 * arm.joints.size(); ++j) text += "</body>";
  return text + "</worldbody></mujoco>";
}

/// The torque of a motor that follows a sine, from its own angle and speed at the joint side.
double motor_torque(const PlantParameters& drive, std::size_t joint, double time_s,
                    double angle_rad, double speed_rad_s) {
  const double wanted_rad = 0.3 * std::sin((2.5 + 0.4 * static_cast<double>(joint)) * time_s);
  return stiffness(drive) * (2.0 * (wanted_rad - angle_rad) - 0.15 * speed_rad_s);
}

TEST(MujocoOracle, TrajectoriesOfTwelveDegreesOfFreedomAgree) {
  const ArmModel arm = test::arm6_with_8_kg();
  std::vector<PlantParameters> drives;
  for (const PlantParameters& drive : test::arm6_drives()) drives.push_back(plain(drive));
  ArmPlant plant(arm, drives, FirstStageForm::rigid, kStep_s);
  std::vector<PlantState> start(drives.size());
  ASSERT_EQ(plant.reset(start), Fault::none);

  const test::MujocoModel oracle(model_text(arm, drives));
  mjData* const data = oracle.data.get();
  double worst_rad = 0.0;
  double moved_rad = 0.0;
  std::vector<PlantCommand> commands(drives.size());
  const auto steps = static_cast<std::size_t>(kDuration_s / kStep_s);
  for (std::size_t n = 0; n < steps; ++n) {
    const double time_s = static_cast<double>(n) * kStep_s;
    for (std::size_t j = 0; j < drives.size(); ++j) {
      const double ratio = total_ratio(drives[j]);
      const PlantState& state = plant.state(j);
      commands[j].current_A =
          motor_torque(drives[j], j, time_s, state.middle_angle_rad, state.middle_speed_rad_s) /
          (ratio * drives[j].motor.torque_constant_Nm_A);
      data->qfrc_applied[2 * j] =
          motor_torque(drives[j], j, time_s, data->qpos[2 * j], data->qvel[2 * j]);
    }
    ASSERT_EQ(plant.step(commands, {}, kStep_s), Fault::none);
    mj_step(oracle.model.get(), data);
    for (std::size_t j = 0; j < drives.size(); ++j) {
      const double angle_rad = data->qpos[2 * j] + data->qpos[2 * j + 1];
      worst_rad = std::max(worst_rad, std::abs(plant.state(j).joint_angle_rad - angle_rad));
      moved_rad = std::max(moved_rad, std::abs(angle_rad));
    }
  }
  RecordProperty("worst_rad", fmt::format("{:.3g}", worst_rad));
  EXPECT_LT(worst_rad, 1e-3);
  EXPECT_GT(moved_rad, 0.2);
}

}  // namespace
}  // namespace torsio
