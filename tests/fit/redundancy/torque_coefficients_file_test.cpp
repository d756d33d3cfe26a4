#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kPerDeg = 180.0 / std::numbers::pi;

const std::string kFile =
    "joints:\n"
    "  - name: elbow\n"
    "    torque_constant_Nm_A: 0.18\n"
    "    gear_ratio: 120\n"
    "    spring: {p0_Nm: -1.007, p1_Nm_deg: -16.12, p2_Nms_deg: 0.7507, p3_Nm: 8.9038}\n"
    "    gear: {p0_Nm: 36.4, p1_Nm_rad: -30000, p2_Nms_rad: 2.5, p3_Nm: 3.0109}\n";

std::string with(const std::string& from, const std::string& to) {
  std::string text = kFile;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  return test::error_message([&] { (void)parse_torque_coefficients(text, "arm.yaml"); });
}

TEST(TorqueCoefficientsFile, MayBePerDegreeOrPerRadian) {
  const auto joints = parse_torque_coefficients(kFile, "arm.yaml");
  ASSERT_EQ(joints.size(), 1U);
  EXPECT_EQ(joints[0].name, "elbow");
  const auto& parameters = joints[0].parameters;
  EXPECT_EQ(parameters.torque_constant_Nm_A, 0.18);
  EXPECT_EQ(parameters.gear_ratio, 120.0);
  EXPECT_EQ(parameters.spring.offset_Nm, -1.007);
  EXPECT_DOUBLE_EQ(parameters.spring.stiffness_Nm_rad, -16.12 * kPerDeg);
  EXPECT_DOUBLE_EQ(parameters.spring.viscous_Nms_rad, 0.7507 * kPerDeg);
  EXPECT_EQ(parameters.gear, (DeflectionTorque{36.4, -30000.0, 2.5, 3.0109}));
}

TEST(TorqueCoefficientsFile, OfTable3HasThePublishedJoints) {
  const auto joints =
      read_torque_coefficients(std::string(TORSIO_SOURCE) + "/studies/paper_000_table_3.yaml");
  ASSERT_EQ(joints.size(), 3U);
  EXPECT_EQ(joints[0].name, "Joint 2, 300 Nm");
  EXPECT_EQ(joints[2].name, "Joint 4, 28 Nm");
  // Specification 2: what follows from the printed numbers.
  constexpr double kStiffness_Nm_deg[] = {39.3, 19.8, 5.6};
  constexpr double kRatio[] = {0.771, 0.814, 1.118};
  constexpr double kCoulomb_Nm[] = {24.4, 14.0, 0.65};
  constexpr double kGear_Nm_rad[] = {50094.0, 30178.0, 1867.0};
  constexpr double kGearZero_deg[] = {0.170, -0.069, 0.082};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto& of = joints[j].parameters;
    EXPECT_NEAR(-of.spring.stiffness_Nm_rad / kPerDeg / kStiffness_Nm_deg[j], kRatio[j], 5e-4);
    EXPECT_NEAR(of.spring.coulomb_Nm * std::numbers::pi / 2.0, kCoulomb_Nm[j], 0.05);
    EXPECT_NEAR(-of.gear.stiffness_Nm_rad, kGear_Nm_rad[j], 0.5);
    EXPECT_NEAR(of.gear.offset_Nm / of.gear.stiffness_Nm_rad * kPerDeg, kGearZero_deg[j], 5e-4);
    (void)MotorReferencedTorques(of);
  }
}

TEST(TorqueCoefficientsFile, WrittenAndReadGivesTheSameBits) {
  std::vector<JointTorqueCoefficients> joints =
      read_torque_coefficients(std::string(TORSIO_SOURCE) + "/studies/paper_000_table_3.yaml");
  joints[1].name = "a \"quoted\": name, # with signs";
  joints[2].name = "28\x8c Nm in Latin-1";
  joints[1].parameters.spring.viscous_Nms_rad = 1.0 / 3.0;
  EXPECT_EQ(parse_torque_coefficients(torque_coefficients_yaml(joints), "again.yaml"), joints);
}

TEST(TorqueCoefficientsFile, WrittenCanBeReadHoweverLargeItWas) {
  const auto joints =
      parse_torque_coefficients(with("p1_Nm_deg: -16.12", "p1_Nm_deg: -1e10"), "large.yaml");
  EXPECT_EQ(parse_torque_coefficients(torque_coefficients_yaml(joints), "again.yaml"), joints);
  EXPECT_THAT(refusal(with("p1_Nm_deg: -16.12", "p1_Nm_deg: -2e10")), HasSubstr("at most 1e+10"));
}

TEST(TorqueCoefficientsFile, RefusesMissingAndUnknownKeysWithTheirLine) {
  EXPECT_THAT(refusal(with("p3_Nm: 8.9038", "p4_Nm: 8.9038")),
              AllOf(HasSubstr("arm.yaml: line 5"), HasSubstr("unknown key 'p4_Nm'")));
  EXPECT_THAT(refusal(with(", p3_Nm: 8.9038", "")),
              AllOf(HasSubstr("arm.yaml: line 5 (joints[0].spring)"), HasSubstr("'p3_Nm'")));
  EXPECT_THAT(refusal(with("    gear_ratio: 120\n", "")), HasSubstr("'gear_ratio' is missing"));
  EXPECT_THAT(refusal(with("p1_Nm_deg: -16.12, ", "")),
              AllOf(HasSubstr("either p1_Nm_deg or p1_Nm_rad"), HasSubstr("neither")));
  EXPECT_THAT(refusal(with("p1_Nm_deg: -16.12", "p1_Nm_deg: -16.12, p1_Nm_rad: -923")),
              AllOf(HasSubstr("either p1_Nm_deg or p1_Nm_rad"), HasSubstr("both")));
  EXPECT_THAT(refusal("{}"), HasSubstr("'joints' is missing"));
  EXPECT_THAT(refusal("joints: []"), HasSubstr("1 to 1000 joints"));
  EXPECT_THAT(refusal("joints: elbow"), HasSubstr("a list of joints"));
  EXPECT_THAT(refusal("joints: [1"), HasSubstr("this is not YAML"));
}

TEST(TorqueCoefficientsFile, RefusesNumbersThatNoJointHas) {
  EXPECT_THAT(refusal(with("p0_Nm: -1.007", "p0_Nm: -1.007Nm")),
              AllOf(HasSubstr("line 5 (joints[0].spring.p0_Nm)"), HasSubstr("without its unit"),
                    HasSubstr("'-1.007Nm'")));
  EXPECT_THAT(refusal(with("p0_Nm: -1.007", "p0_Nm: .nan")), HasSubstr("'.nan'"));
  EXPECT_THAT(refusal(with("p0_Nm: -1.007", "p0_Nm: 1e300")), HasSubstr("at most 1e+12"));
  EXPECT_THAT(refusal(with("gear_ratio: 120", "gear_ratio: 0")),
              AllOf(HasSubstr("line 4 (joints[0].gear_ratio)"), HasSubstr("above 0")));
  EXPECT_THAT(refusal(with("A: 0.18", "A: -0.18")), HasSubstr("above 0"));
  EXPECT_THAT(
      refusal(with("{p0_Nm: 36.4, p1_Nm_rad: -30000, p2_Nms_rad: 2.5, p3_Nm: 3.0109}", "36.4")),
      HasSubstr("'36.4'"));
}

TEST(TorqueCoefficientsFile, RefusesTwoJointsOfOneName) {
  EXPECT_THAT(refusal(kFile + kFile.substr(kFile.find("  - "))),
              AllOf(HasSubstr("line 7 (joints[1].name)"), HasSubstr("no joint before it")));
}

}  // namespace
}  // namespace torsio
