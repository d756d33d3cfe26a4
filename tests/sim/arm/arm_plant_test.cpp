#include "sim/arm/arm_plant.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "sim/plant/plant.hpp"
#include "support/arm_drives.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;
constexpr std::size_t kJoints = 6;
constexpr std::array kForms = {FirstStageForm::elastic, FirstStageForm::rigid};
using Angles = std::array<double, kJoints>;
using Commands = std::array<PlantCommand, kJoints>;

constexpr Angles kBent = {0.3, -0.5, 0.9, 0.4, -0.7, 0.2};

ArmPlant arm_with_8_kg(FirstStageForm form) {
  return {test::arm6_with_8_kg(), test::arm6_drives(), form};
}

/// A pendulum about the y axis: hangs at angle 0, with this inertia about its axis.
ArmModel pendulum(double inertia_kg_m2, double mass_kg, double length_m) {
  const double own_kg_m2 = inertia_kg_m2 - mass_kg * length_m * length_m;
  ArmModel arm{.name = "pendulum"};
  arm.joints.push_back({.name = "joint",
                        .link = "link",
                        .axis = {0.0, 1.0, 0.0},
                        .body = {mass_kg, {0.0, 0.0, -length_m}, {own_kg_m2, own_kg_m2, own_kg_m2}},
                        .lowest_rad = -1.0,
                        .highest_rad = 1.0,
                        .speed_rad_s = 1.0,
                        .effort_Nm = 1.0});
  return arm;
}

PlantCommand current_at(int step, double amplitude_A) {
  return {.current_A = amplitude_A * std::sin(2.0 * std::numbers::pi * 2.0 * kStep_s * step)};
}

TEST(ArmPlant, OneJointWithGravityIsAPlantWithALever) {
  PlantParameters drive = plant_parameters(data_sheet("dfki-120"));
  const Load load = lever(9.0, 0.3);
  Plant plant(drive, kStep_s);
  ArmPlant arm(pendulum(drive.joint_inertia_kg_m2 + load.inertia_kg_m2, 9.0, 0.3),
               std::span(&drive, 1), FirstStageForm::elastic, kStep_s);
  ASSERT_EQ(plant.reset(0.4, load), Fault::none);
  const double start_rad = 0.4;
  ASSERT_EQ(arm.reset(std::span(&start_rad, 1)), Fault::none);
  EXPECT_DOUBLE_EQ(arm.current(0), plant.current());
  for (int i = 0; i < 20000; ++i) {
    const PlantCommand command = current_at(i, 4.0);
    ASSERT_EQ(plant.step(command, load, kStep_s), Fault::none);
    ASSERT_EQ(arm.step(std::span(&command, 1), {}, kStep_s), Fault::none);
  }
  EXPECT_GT(std::abs(plant.state().joint_angle_rad - 0.4), 0.01) << "it has to move";
  EXPECT_NEAR(arm.state(0).joint_angle_rad, plant.state().joint_angle_rad, 1e-9);
  EXPECT_NEAR(arm.state(0).rotor_angle_rad, plant.state().rotor_angle_rad, 1e-9);
  EXPECT_NEAR(arm.torques(0).joint_Nm, plant.torques().joint_Nm, 1e-6);
}

TEST(ArmPlant, StaysAtRestWithGravityCarriedWhileTheMotorsAreHeld) {
  for (const FirstStageForm form : kForms) {
    ArmPlant arm = arm_with_8_kg(form);
    ASSERT_EQ(arm.reset(kBent), Fault::none);
    Commands commands;
    commands.fill({.is_motor_held = true});
    for (int i = 0; i < 10000; ++i) ASSERT_EQ(arm.step(commands, {}, kStep_s), Fault::none);
    for (std::size_t j = 0; j < kJoints; ++j)
      EXPECT_NEAR(arm.state(j).joint_angle_rad, kBent[j], 1e-9) << "joint " << j + 1;
    EXPECT_GT(std::abs(arm.torques(1).joint_Nm), 50.0) << "gravity";
  }
}

TEST(ArmPlant, StaysAtRestUnderTheCurrentsThatCarryGravityAndLoad) {
  std::vector<PlantParameters> drives = test::arm6_drives();
  for (PlantParameters& drive : drives) drive.motor.ripple = 0.0;
  ArmLoad load{.force_N = {20.0, -10.0, 30.0}, .moment_Nm = {1.0, 2.0, -0.5}};
  load.torque_Nm[2] = 5.0;
  for (const FirstStageForm form : kForms) {
    ArmPlant arm(test::arm6_with_8_kg(), drives, form);
    ASSERT_EQ(arm.reset(kBent, load), Fault::none);
    Commands commands;
    for (std::size_t j = 0; j < kJoints; ++j) commands[j].current_A = arm.current(j);
    for (int i = 0; i < 10000; ++i) ASSERT_EQ(arm.step(commands, load, kStep_s), Fault::none);
    for (std::size_t j = 0; j < kJoints; ++j)
      EXPECT_NEAR(arm.state(j).joint_angle_rad, kBent[j], 1e-9) << "joint " << j + 1;
  }
}

TEST(ArmPlant, ForceAndMomentAtTheFlangeWorkThroughItsJacobian) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::rigid);
  ASSERT_EQ(arm.reset(kBent), Fault::none);
  ArmLoad load{.force_N = {3.0, -4.0, 5.0}, .moment_Nm = {0.3, 0.2, -0.1}};
  load.torque_Nm[1] = 7.0;
  ASSERT_EQ(arm.step(Commands{}, load, kStep_s), Fault::none);
  ArmDynamics::Jacobian jacobian;
  arm.dynamics().jacobian(kBent, jacobian);
  for (std::size_t j = 0; j < kJoints; ++j) {
    double expected_Nm = load.torque_Nm[j];
    for (std::size_t row = 0; row < 3; ++row)
      expected_Nm += jacobian[row * kJoints + j] * load.force_N[row] +
                     jacobian[(row + 3) * kJoints + j] * load.moment_Nm[row];
    EXPECT_NEAR(arm.external_torque(j), expected_Nm, 1e-12);
  }
}

TEST(ArmPlant, AClampedJointStaysAndTheOthersMoveAsAnArmWithoutIt) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::elastic);
  ArmLoad load;
  load.is_locked[1] = load.is_locked[4] = true;
  ASSERT_EQ(arm.reset(kBent, load), Fault::none);
  EXPECT_EQ(arm.torques(1).joint_Nm, 0.0) << "the clamp carries it";
  Commands commands;
  for (PlantCommand& command : commands) command.current_A = 3.0;
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(arm.step(commands, load, kStep_s), Fault::none);
  EXPECT_EQ(arm.state(1).joint_angle_rad, kBent[1]);
  EXPECT_EQ(arm.state(4).joint_angle_rad, kBent[4]);
  EXPECT_GT(std::abs(arm.state(2).joint_angle_rad - kBent[2]), 1e-4);
}

TEST(ArmPlant, ClampsJointsByTheTorquesThatHoldThem) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::rigid);
  ArmLoad load;
  load.is_locked[0] = load.is_locked[3] = true;
  std::array<PlantState, kJoints> states{};
  for (std::size_t j = 0; j < kJoints; ++j) {
    states[j].joint_angle_rad = states[j].middle_angle_rad = kBent[j];
    if (!load.is_locked[j]) states[j].joint_speed_rad_s = 0.2;
  }
  ASSERT_EQ(arm.reset(states), Fault::none);
  ASSERT_EQ(arm.step(Commands{}, load, kStep_s), Fault::none);
  Angles speed;
  Angles acceleration;
  Angles torque_Nm;
  for (std::size_t j = 0; j < kJoints; ++j) {
    speed[j] = states[j].joint_speed_rad_s;
    acceleration[j] = (arm.state(j).joint_speed_rad_s - speed[j]) / kStep_s;
  }
  arm.dynamics().inverse(kBent, speed, acceleration, torque_Nm);
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (load.is_locked[j]) continue;
    const double viscous_Nm = arm.drive(j).parameters().joint_viscous_Nms_rad * speed[j];
    EXPECT_NEAR(torque_Nm[j], arm.torques(j).joint_Nm - viscous_Nm, 1e-7) << "joint " << j + 1;
  }
}

TEST(ArmPlant, InputThatIsNotFiniteIsAFaultAndNothingMoves) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::elastic);
  ASSERT_EQ(arm.reset(kBent), Fault::none);
  const double nan = std::nan("");
  Commands commands;
  EXPECT_EQ(arm.step(commands, {.force_N = {0.0, nan, 0.0}}, kStep_s), Fault::input_not_finite);
  EXPECT_EQ(arm.step(commands, {.moment_Nm = {0.0, nan, 0.0}}, kStep_s), Fault::input_not_finite);
  ArmLoad load;
  load.torque_Nm[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(arm.step(commands, load, kStep_s), Fault::input_not_finite);
  for (const double dt_s : {0.0, -1e-4, nan, 1e300})
    EXPECT_EQ(arm.step(commands, {}, dt_s), Fault::input_not_finite);
  EXPECT_EQ(arm.step(std::span(commands).first(5), {}, kStep_s), Fault::input_count_wrong);
  commands[5].current_A = nan;
  EXPECT_EQ(arm.step(commands, {}, kStep_s), Fault::input_not_finite);
  EXPECT_EQ(arm.reset(std::array{0.0, nan, 0.0, 0.0, 0.0, 0.0}), Fault::input_not_finite);
  EXPECT_EQ(arm.reset(std::span(kBent), load), Fault::input_not_finite);
  EXPECT_EQ(arm.reset(std::span(kBent).first(5)), Fault::input_count_wrong);
  std::array<PlantState, kJoints> states{};
  states[2].middle_speed_rad_s = nan;
  EXPECT_EQ(arm.reset(states), Fault::input_not_finite);
  EXPECT_EQ(arm.set_condition(3, {.friction_factor = -1.0}), Fault::input_not_finite);
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_EQ(arm.state(j).joint_angle_rad, kBent[j]);
}

TEST(ArmPlant, AStateThatIsNoLongerFiniteIsAFaultAndEndsAtRest) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::rigid);
  EXPECT_EQ(arm.step(Commands{}, {.force_N = {0.0, 0.0, 1e307}}, 1.0), Fault::model_not_finite);
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_EQ(arm.state(j).joint_angle_rad, 0.0);
  EXPECT_EQ(arm.step(Commands{}, {}, kStep_s), Fault::none);
}

TEST(ArmPlant, StaysFiniteUnderRandomCommandsAndLoads) {
  Random random(5);
  for (const FirstStageForm form : kForms) {
    ArmPlant arm = arm_with_8_kg(form);
    Commands commands;
    ArmLoad load;
    for (int i = 0; i < 20000; ++i) {
      for (std::size_t j = 0; j < kJoints; ++j) {
        commands[j] = {.current_A = 10.0 * random.normal(), .is_motor_held = random.below(20) == 0};
        load.torque_Nm[j] = 20.0 * random.normal();
        load.is_locked[j] = random.below(20) == 0;
      }
      for (std::size_t k = 0; k < 3; ++k) load.force_N[k] = 100.0 * random.normal();
      ASSERT_EQ(arm.step(commands, load, kStep_s), Fault::none);
    }
  }
}

TEST(ArmPlant, GivesTheSameBitsAgainAndAfterAReset) {
  ArmPlant first = arm_with_8_kg(FirstStageForm::elastic);
  ArmPlant second = arm_with_8_kg(FirstStageForm::elastic);
  const auto run = [](ArmPlant& arm) {
    EXPECT_EQ(arm.reset(kBent), Fault::none);
    for (int i = 0; i < 1000; ++i) {
      Commands commands;
      commands.fill(current_at(i, 3.0));
      EXPECT_EQ(arm.step(commands, {}, kStep_s), Fault::none);
    }
    return arm.state(5).joint_angle_rad;
  };
  const double expected_rad = run(first);
  EXPECT_EQ(run(second), expected_rad);
  EXPECT_EQ(run(first), expected_rad);
}

TEST(ArmPlant, DividesAStepThatIsLongerThanItsOwn) {
  ArmPlant once = arm_with_8_kg(FirstStageForm::rigid);
  ArmPlant ten_times = arm_with_8_kg(FirstStageForm::rigid);
  const Commands commands{PlantCommand{.current_A = 2.0}, {}, {}, {.current_A = 1.0}, {}, {}};
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(once.step(commands, {}, 1e-3), Fault::none);
    for (int k = 0; k < 10; ++k) EXPECT_EQ(ten_times.step(commands, {}, 1e-3 / 10.0), Fault::none);
  }
  EXPECT_EQ(once.state(3).rotor_angle_rad, ten_times.state(3).rotor_angle_rad);
}

TEST(ArmPlant, AWornDriveHasMoreFriction) {
  ArmPlant sound = arm_with_8_kg(FirstStageForm::rigid);
  ArmPlant worn = arm_with_8_kg(FirstStageForm::rigid);
  ASSERT_EQ(worn.set_condition(0, {.friction_factor = 3.0}), Fault::none);
  std::array<PlantState, kJoints> states{};
  states[0].middle_speed_rad_s = states[0].joint_speed_rad_s = 0.5;
  for (ArmPlant* arm : {&sound, &worn}) {
    ASSERT_EQ(arm->reset(states), Fault::none);
    ASSERT_EQ(arm->step(Commands{}, {}, kStep_s), Fault::none);
  }
  EXPECT_GT(sound.torques(0).rotor_friction_Nm, 0.0);
  EXPECT_DOUBLE_EQ(worn.torques(0).rotor_friction_Nm, 3.0 * sound.torques(0).rotor_friction_Nm);
}

TEST(ArmPlant, ItsBrakesHoldItWithoutCurrentAndItFallsWithoutThem) {
  for (const FirstStageForm form : kForms) {
    ArmPlant arm = arm_with_8_kg(form);
    const Brake::Parameters brakes[] = {brake_parameters(data_sheet("dfki-300")),
                                        brake_parameters(data_sheet("dfki-120")),
                                        brake_parameters(data_sheet("dfki-28"))};
    for (std::size_t j = 0; j < kJoints; ++j) arm.use(j, brakes[j < 2 ? 0 : j < 3 ? 1 : 2]);
    for (const bool is_closed : {true, false}) {
      ASSERT_EQ(arm.reset(kBent), Fault::none);
      Commands commands;
      commands.fill({.is_powered = false, .brake_V = is_closed ? 0.0 : 1e3});
      for (std::size_t j = 0; j < kJoints; ++j) arm.set_brake(j, is_closed);
      for (int i = 0; i < 5000; ++i) ASSERT_EQ(arm.step(commands, {}, kStep_s), Fault::none);
      const double moved_rad = std::abs(arm.state(1).joint_angle_rad - kBent[1]);
      if (is_closed) {
        EXPECT_LT(moved_rad, 0.02);
      } else {
        EXPECT_GT(moved_rad, 0.1);
      }
      EXPECT_EQ(arm.current(1), 0.0);
    }
  }
}

TEST(ArmPlant, TakesMotorsWithWindings) {
  ArmPlant arm = arm_with_8_kg(FirstStageForm::rigid);
  arm.use(2, electrical_parameters(data_sheet("dfki-120"), 1));
  ASSERT_EQ(arm.reset(kBent), Fault::none);
  Commands commands;
  for (std::size_t j = 0; j < kJoints; ++j) commands[j].current_A = arm.current(j);
  const double expected_A = arm.current(2);
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(arm.step(commands, {}, kStep_s), Fault::none);
  EXPECT_NEAR(arm.current(2), expected_A, 0.1 * std::abs(expected_A));
  EXPECT_GT(arm.drive(2).electrical()->energy().copper_J, 0.0);
}

TEST(ArmPlant, DividesItsStepWhereTheLastLinkHasLittleInertia) {
  const std::vector<PlantParameters> drives = test::arm6_drives();
  const double stiffest_Nm_rad =
      Spring(std::get<Spring::Parameters>(drives[5].second)).steepest(drives[5].rated_torque_Nm) +
      LuGreFriction(drives[5].bearing).steepest();
  const double last_kg_m2 = test::arm6().joints[5].body.inertia_kg_m2[0];
  const double expected_s = 0.25 / std::sqrt(stiffest_Nm_rad / last_kg_m2);
  for (const FirstStageForm form : kForms) {
    EXPECT_GE(ArmPlant::step_limit(test::arm6_with_8_kg(), drives, form), 1e-4);
    EXPECT_EQ(arm_with_8_kg(form).longest_step(), ArmPlant::kDefaultStep_s);
    // Joint 4, free to turn as well, makes it a little lighter.
    const double empty_s = ArmPlant::step_limit(test::arm6(), drives, form);
    EXPECT_LT(empty_s, expected_s);
    EXPECT_GT(empty_s, 0.9 * expected_s);
    EXPECT_EQ(ArmPlant(test::arm6(), drives, form).longest_step(), empty_s);
  }
}

TEST(ArmPlant, ItsStepLimitIsThatOfTheModeOfTwoBodies) {
  PlantParameters drive = plant_parameters(data_sheet("dfki-50"));
  drive.rotor_friction = drive.bearing = {};
  drive.joint_viscous_Nms_rad = 0.0;
  auto& spring = std::get<Spring::Parameters>(drive.second);
  spring.viscosity_Nms_rad = 0.0;
  const double ratio = total_ratio(drive);
  const double motor_kg_m2 = drive.rotor_inertia_kg_m2 * ratio * ratio + drive.middle_inertia_kg_m2;
  const double link_kg_m2 = 0.01;
  const double stiffest = Spring(spring).steepest(drive.rated_torque_Nm);
  EXPECT_NEAR(ArmPlant::step_limit(pendulum(link_kg_m2, 0.01, 0.1), std::span(&drive, 1),
                                   FirstStageForm::rigid),
              0.25 / std::sqrt(stiffest * (1.0 / motor_kg_m2 + 1.0 / link_kg_m2)), 1e-9);
}

std::string refusal_of(const ArmModel& arm, const std::vector<PlantParameters>& drives,
                       FirstStageForm form, double step_s) {
  try {
    ArmPlant(arm, drives, form, step_s);
  } catch (const Error& error) {
    return error.report().problem;
  }
  return "accepted";
}

TEST(ArmPlant, RefusesWhatItCannotSimulateAndNamesIt) {
  const std::vector<PlantParameters> drives = test::arm6_drives();
  const ArmModel arm = test::arm6();
  EXPECT_EQ(refusal_of(arm, drives, FirstStageForm::elastic, 1e-4),
            "the step does not suit the stiffest mode");
  EXPECT_EQ(refusal_of(arm, {drives[0]}, FirstStageForm::elastic, 0.0), "not one drive per joint");
  std::vector<PlantParameters> damped = drives;
  damped[5].joint_viscous_Nms_rad = 100.0;
  EXPECT_EQ(refusal_of(arm, damped, FirstStageForm::rigid, 1e-5),
            "the step does not suit the strongest damping");
  std::vector<PlantParameters> slipping = drives;
  slipping[0] = plant_parameters(data_sheet("rubber-clutch"));
  EXPECT_EQ(refusal_of(arm, slipping, FirstStageForm::rigid, 1e-5), "a slip clutch is not rigid");
  EXPECT_EQ(refusal_of(arm, drives, FirstStageForm::rigid, 1e-5), "accepted");
}

}  // namespace
}  // namespace torsio
