#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "studies/arm_bench.hpp"
#include "studies/study.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;

/// Potential energy of the arm, its lowest position being 0 plus a constant.
double potential_J(const ArmAngles& angles_rad) {
  double height_m = 0.0;
  double absolute_rad = 0.0;
  double energy_J = 0.0;
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    absolute_rad += angles_rad[j];
    const double rise_m = -kArm[j].length_m * std::cos(absolute_rad);
    energy_J += kGravity_m_s2 * (kArm[j].link_kg * (height_m + 0.5 * rise_m) +
                                 kArm[j].tip_kg * (height_m + rise_m));
    height_m += rise_m;
  }
  return energy_J;
}

TEST(Arm, IsPulledByTheGradientOfItsPotentialEnergy) {
  const ArmAngles angles_rad{2.3, -0.7, 1.1};
  const ArmAngles torques_Nm = arm_gravity_torques(angles_rad);
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    constexpr double kStep_rad = 1e-5;
    ArmAngles above = angles_rad;
    ArmAngles below = angles_rad;
    above[j] += kStep_rad;
    below[j] -= kStep_rad;
    EXPECT_NEAR(torques_Nm[j], -(potential_J(above) - potential_J(below)) / (2.0 * kStep_rad), 1e-6)
        << kArm[j].joint;
  }
}

TEST(Arm, LoadsEachJointWithinItsRating) {
  const ArmAngles stretched_Nm = arm_gravity_torques({std::numbers::pi / 2.0, 0.0, 0.0});
  const ArmAngles inertias_kg_m2 = arm_inertias();
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    const double rated_Nm = data_sheet(kArm[j].actuator).rating.torque_Nm.value;
    EXPECT_LT(std::abs(stretched_Nm[j]), rated_Nm) << kArm[j].joint;
    EXPECT_GT(std::abs(stretched_Nm[j]), 0.3 * rated_Nm) << kArm[j].joint;
    EXPECT_GT(inertias_kg_m2[j], 0.0);
  }
}

/// The study, run once.
const Study& redundancy() {
  static const Study study =
      run_study(find_study("000-redundancy"), {.seed = 3, .repeats = 1, .is_quick = true});
  return study;
}

const QuantityRow& row(const std::string& joint, const std::string& quantity) {
  const auto& rows = std::get<QuantityTable>(redundancy().table).rows;
  const auto found = std::ranges::find_if(
      rows, [&](const auto& of) { return of.condition == joint && of.quantity == quantity; });
  if (found == rows.end()) throw Error({.problem = joint + " " + quantity});
  return *found;
}

TEST(RedundancyStudy, ShowsTheFigureOfTheFileBesideEachCoefficient) {
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

TEST(RedundancyStudy, HasTheSignsOfThePaperAndTheStiffnessOfItsSprings) {
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

TEST(RedundancyStudy, FindsTheLoadInTheDeflectionAloneAndTheMotorTorqueInTheSum) {
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

TEST(RedundancyStudy, DrawsPositionSpeedAndTorquesOfEachJoint) {
  EXPECT_TRUE(find_study("000-redundancy").has_figures);
  const std::vector<ReportFigure>& figures = redundancy().figures;
  ASSERT_EQ(figures.size(), 3 * kArmJoints);
  EXPECT_EQ(redundancy().figure_columns, 3U);
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
