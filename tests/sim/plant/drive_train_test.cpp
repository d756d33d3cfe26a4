#include "sim/plant/drive_train.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace torsio {
namespace {

constexpr double kDriveStep_s = 1e-4;

TEST(DriveTrain, RotorAndMiddleBodyOfARigidGearBothObeyTheirEquations) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-120"));
  const double ratio = total_ratio(parts);
  DriveTrain drive(parts, FirstStageForm::rigid);
  drive.set_period(kDriveStep_s);
  PlantState state{.middle_angle_rad = 0.01, .middle_speed_rad_s = 0.3};
  PlantTorques torques;
  drive.reset(state);
  EXPECT_DOUBLE_EQ(state.rotor_speed_rad_s, 0.3 * ratio);
  for (int i = 0; i < 50; ++i) {
    const PlantState before = state;
    drive.find_torques({.current_A = 4.0}, state, torques);
    drive.move({.current_A = 4.0}, torques, state);
    EXPECT_DOUBLE_EQ(state.rotor_angle_rad, ratio * state.middle_angle_rad);
    const double rotor_Nm = parts.rotor_inertia_kg_m2 *
                            (state.rotor_speed_rad_s - before.rotor_speed_rad_s) / kDriveStep_s;
    const double middle_Nm = parts.middle_inertia_kg_m2 *
                             (state.middle_speed_rad_s - before.middle_speed_rad_s) / kDriveStep_s;
    EXPECT_NEAR(rotor_Nm, torques.motor_Nm - torques.rotor_friction_Nm - torques.first_on_rotor_Nm,
                1e-9);
    EXPECT_NEAR(middle_Nm,
                torques.first_Nm - torques.middle_friction_Nm - torques.second_on_middle_Nm, 1e-9);
  }
}

TEST(DriveTrain, FrictionOfTheRotorGrowsWithTheTorqueThroughARigidGear) {
  PlantParameters parts = plant_parameters(data_sheet("dfki-120"));
  parts.rotor_friction.stribeck_rad_s = 1e-3;  // sliding friction
  DriveTrain drive(parts, FirstStageForm::rigid);
  drive.set_period(kDriveStep_s);
  PlantState state{.middle_angle_rad = 0.05, .middle_speed_rad_s = 1.0};
  PlantTorques torques;
  drive.reset(state);
  double through_Nm = 0.0;
  for (int i = 0; i < 20; ++i) {
    through_Nm = torques.first_Nm;
    drive.find_torques({}, state, torques);
    state.joint_angle_rad += kDriveStep_s * state.middle_speed_rad_s;  // the twist remains
    drive.move({}, torques, state);
  }
  EXPECT_GT(through_Nm, 10.0);
  const double level_Nm =
      parts.rotor_friction.coulomb_Nm + parts.rotor_friction.load_factor * through_Nm;
  EXPECT_NEAR(drive.rotor_friction().bristle_torque(), level_Nm, 0.01 * level_Nm);
}

TEST(DriveTrain, AHeldMotorHoldsTheMiddleBodyOfARigidGear) {
  DriveTrain drive(plant_parameters(data_sheet("dfki-28")), FirstStageForm::rigid);
  drive.set_period(kDriveStep_s);
  PlantState state{.middle_angle_rad = 0.02, .middle_speed_rad_s = 1.0};
  PlantTorques torques;
  drive.reset(state);
  for (int i = 0; i < 3; ++i) {
    drive.find_torques({.is_motor_held = true}, state, torques);
    drive.move({.is_motor_held = true}, torques, state);
  }
  EXPECT_EQ(state.middle_speed_rad_s, 0.0);
  EXPECT_EQ(state.middle_angle_rad, 0.02);
  EXPECT_DOUBLE_EQ(torques.first_Nm, torques.middle_friction_Nm + torques.second_on_middle_Nm);
}

TEST(DriveTrain, RestsWithTheCurrentOfItsTorqueOverARigidGear) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-28"));
  DriveTrain drive(parts, FirstStageForm::rigid);
  PlantState rest = drive.rest(0.5, 12.0);
  const PlantTorques torques = drive.reset_at_rest(rest, 12.0);
  EXPECT_GT(drive.second_twist(rest), 0.0);
  EXPECT_DOUBLE_EQ(rest.rotor_angle_rad, total_ratio(parts) * rest.middle_angle_rad);
  EXPECT_DOUBLE_EQ(drive.current(), 12.0 / (total_ratio(parts) * parts.motor.torque_constant_Nm_A));
  EXPECT_DOUBLE_EQ(torques.first_Nm, 12.0);
}

}  // namespace
}  // namespace torsio
