#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "studies/arm_trajectory.hpp"
#include "studies/studies.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

namespace torsio {
namespace {

TEST(ArmConfigurations, AreWithinTheLimitsAndMoveEveryJoint) {
  const ArmSetup setup = arm6_setup();
  const auto configurations = arm_configurations(20, 5);
  ASSERT_EQ(configurations.size(), 21U);
  EXPECT_EQ(configurations, arm_configurations(20, 5));
  for (std::size_t k = 0; k < configurations.size(); ++k)
    for (std::size_t j = 0; j < setup.moves.size(); ++j) {
      EXPECT_GE(configurations[k][j], setup.moves[j].lowest_rad);
      EXPECT_LE(configurations[k][j], setup.moves[j].highest_rad);
    }
  for (std::size_t k = 1; k < configurations.size(); ++k)
    for (const ArmPart& part : kArm)
      EXPECT_GT(std::abs(configurations[k][part.index] - configurations[k - 1][part.index]), 0.39);
}

TEST(ArmConfigurations, AreOfTheJointsOfTheTable) {
  const ArmSetup setup = arm6_setup();
  for (const ArmPart& part : kArm) EXPECT_EQ(setup.joints[part.index].sheet.name, part.actuator);
}

/// The study, run once.
const Study& arm_study() {
  static const Study study =
      run_study(find_study("000-arm"), {.seed = 3, .repeats = 1, .is_quick = true});
  return study;
}

const QuantityRow& row(const std::string& joint, const std::string& quantity) {
  const auto& rows = std::get<QuantityTable>(arm_study().table).rows;
  const auto found = std::ranges::find_if(
      rows, [&](const auto& of) { return of.condition == joint && of.quantity == quantity; });
  if (found == rows.end()) throw Error({.problem = joint + " " + quantity});
  return *found;
}

TEST(ArmStudy, ShowsTheFigureOfTheFileBesideEachCoefficient) {
  const auto joints =
      read_torque_coefficients(std::string(TORSIO_SOURCE) + "/studies/paper_000_table_3.yaml");
  const auto text = [](const std::string& joint, const char* quantity) {
    return row(joint, quantity).published.value().value;
  };
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    const std::string joint(kArm[j].joint);
    const auto& of = joints.at(j).parameters;
    EXPECT_EQ(text(joint, "p0 spring"), of.spring.offset_Nm) << joint;
    EXPECT_NEAR(text(joint, "p1 spring"), rad_from_deg(of.spring.stiffness_Nm_rad), 1e-9) << joint;
    EXPECT_NEAR(text(joint, "p2 spring"), rad_from_deg(of.spring.viscous_Nms_rad), 1e-9) << joint;
    EXPECT_EQ(text(joint, "p3 spring"), of.spring.coulomb_Nm) << joint;
    EXPECT_EQ(text(joint, "p0 gear"), of.gear.offset_Nm) << joint;
    EXPECT_NEAR(text(joint, "p1 gear"), rad_from_deg(of.gear.stiffness_Nm_rad), 1e-9) << joint;
    EXPECT_NEAR(text(joint, "p2 gear"), rad_from_deg(of.gear.viscous_Nms_rad), 1e-9) << joint;
    EXPECT_EQ(text(joint, "p3 gear"), of.gear.coulomb_Nm) << joint;
    const DataSheet sheet = data_sheet(kArm[j].actuator);
    EXPECT_EQ(sheet.motor.torque_constant_Nm_A.value, of.torque_constant_Nm_A) << joint;
  }
}

TEST(ArmStudy, HasTheSignsOfThePaperAndTheStiffnessOfItsSprings) {
  for (const ArmPart& part : kArm) {
    const std::string joint(part.joint);
    EXPECT_LT(row(joint, "p1 gear").value, 0.0) << joint;
    EXPECT_GT(row(joint, "p3 spring").value, 0.0) << joint;
    EXPECT_GT(row(joint, "p3 gear").value, 0.0) << joint;
    EXPECT_GT(row(joint, "condition number of (16), spring").value, 1.0) << joint;
  }
  EXPECT_NEAR(row("joint 2 (300 Nm)", "p1 spring").value, -39.3, 4.0);
  EXPECT_NEAR(row("joint 3 (120 Nm)", "p1 spring").value, -19.8, 3.0);
  EXPECT_NEAR(row("joint 4 (28 Nm)", "p1 spring").value, -5.6, 0.6);
}

TEST(ArmStudy, FindsTheLoadInTheDeflectionAloneAndTheMotorTorqueInTheSum) {
  for (const ArmPart& part : kArm) {
    const std::string joint(part.joint);
    const double sum_Nm = row(joint, "RMSE of (19) spring to load cell").value;
    const double load_Nm = row(joint, "RMSE of p0 + p1 dq spring to load cell").value;
    EXPECT_LT(load_Nm, 0.6 * sum_Nm) << joint;
    EXPECT_LT(row(joint, "RMSE of (19) spring to motor current").value, sum_Nm) << joint;
    EXPECT_LT(row(joint, "RMSE of (18) gear to (19) spring").value, sum_Nm) << joint;
    // The printed coefficients have the encoder zeros of another arm.
    EXPECT_GT(row(joint, "RMSE of (18) as printed to motor current").value,
              2.0 * row(joint, "RMSE of (18) gear to motor current").value)
        << joint;
  }
  for (const char* joint : {"joint 2 (300 Nm)", "joint 3 (120 Nm)"})
    EXPECT_LT(row(joint, "RMSE of p0 + p1 dq spring to load cell").value,
              0.2 * row(joint, "RMSE of (19) spring to load cell").value)
        << joint;
}

TEST(ArmStudy, DrawsPositionSpeedAndTorquesOfEachJoint) {
  EXPECT_TRUE(find_study("000-arm").has_figures);
  const std::vector<ReportFigure>& figures = arm_study().figures;
  ASSERT_EQ(figures.size(), 3 * kArmJoints + 2);  // and the arm from two sides
  EXPECT_EQ(arm_study().figure_columns, 3U);
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    const auto& position = std::get<XyFigure>(figures[3 * j]);
    const auto& speed = std::get<XyFigure>(figures[3 * j + 1]);
    const auto& torque = std::get<XyFigure>(figures[3 * j + 2]);
    for (const XyFigure* figure : {&position, &speed, &torque})
      EXPECT_EQ(figure->title, kArm[j].joint);
    EXPECT_EQ(position.y.label, "position [deg]");
    EXPECT_EQ(speed.y.label, "speed [deg/s]");
    EXPECT_EQ(torque.y.label, "torque [Nm]");
    ASSERT_EQ(torque.series.size(), 4U);
    EXPECT_EQ(torque.series[0].label, "motor current (17)");
    EXPECT_EQ(torque.series[1].label, "gear deflection (18)");
    EXPECT_EQ(torque.series[2].label, "spring deflection (19)");
  }
}

}  // namespace
}  // namespace torsio
