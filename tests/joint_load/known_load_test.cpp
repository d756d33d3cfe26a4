#include "torsio/joint_load/known_load.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::HasSubstr;

Recording recording_with(const std::string& condition = {}, double value = 0.0) {
  Recording recording("sweep", 1000.0);
  recording.add({"joint_angle_rad", std::vector<double>(10, 0.1)});
  if (!condition.empty()) recording.add_condition(condition, value);
  return recording;
}

KnownLoad load_from(const std::string& text, const Recording& recording = recording_with()) {
  return known_load(parse_load_sheet(text, "load.yaml"), recording);
}

std::string refusal_of_sheet(const std::string& text) {
  return error_message([&] { (void)parse_load_sheet(text, "load.yaml"); });
}

const LoadError* error_of(const KnownLoad& load, const std::string& fact) {
  for (const LoadError& error : load.errors)
    if (error.fact == fact) return &error;
  return nullptr;
}

TEST(KnownLoad, OfAPendulumFollowsFromMassLengthArmAndInclination) {
  const KnownLoad known = load_from(
      "load: {pendulum: {mass: 2kg, length: 30cm, arm_mass: 600g, inclination: 60deg}, "
      "joint_inertia: 0.15kg_m2, zero: 3deg}");
  EXPECT_NEAR(known.load.gravity_Nm, (2.0 + 0.3) * 9.81 * 0.3 * 0.5, 1e-12);
  EXPECT_NEAR(known.load.inertia_kg_m2, 2.0 * 0.09 + 0.6 * 0.09 / 3.0 + 0.15, 1e-12);
  EXPECT_NEAR(known.load.zero_rad, rad_from_deg(3.0), 1e-15);
  EXPECT_TRUE(known.errors.empty());
}

TEST(KnownLoad, TakesAFactFromTheConditionsOfEachRecording) {
  const std::string text = "load: {pendulum: {mass: 9kg, length: lever_mm}}";
  EXPECT_NEAR(load_from(text, recording_with("lever_m", 0.17)).load.gravity_Nm, 9 * 9.81 * 0.17,
              1e-12);
  EXPECT_NEAR(load_from(text, recording_with("lever_m", 0.2)).load.inertia_kg_m2, 9 * 0.04, 1e-12);
  EXPECT_THAT(error_message([&] { (void)load_from(text); }),
              AllOf(HasSubstr("sweep"), HasSubstr("lever_m, which load.yaml names as length"),
                    HasSubstr("conditions: {lever_m: ..}")));
  EXPECT_THAT(error_message([&] { (void)load_from(text, recording_with("lever_m", -0.1)); }),
              AllOf(HasSubstr("sweep: lever_m"), HasSubstr("-0.1")));
}

TEST(KnownLoad, RefusesAConditionThatChanges) {
  Recording recording("sweep", 1000.0);
  recording.add({"lever_m", {0.1, 0.2}});
  EXPECT_THAT(error_message([&] {
                (void)load_from("load: {pendulum: {mass: 9kg, length: lever_m}}", recording);
              }),
              HasSubstr("one number for the recording"));
}

TEST(KnownLoad, PropagatesTheErrorOfEachFact) {
  const KnownLoad known = load_from(
      "load: {pendulum: {mass: 2kg, length: 0.3m}, zero: 0deg}\n"
      "load_uncertainty: {mass: 1%, length: 1mm, zero: 0.5deg}");
  ASSERT_EQ(known.errors.size(), 3U);
  const LoadError* const mass = error_of(known, "mass");
  ASSERT_NE(mass, nullptr);
  EXPECT_NEAR(mass->change.gravity_Nm, 0.01 * known.load.gravity_Nm, 1e-12);
  EXPECT_NEAR(mass->change.inertia_kg_m2, 0.01 * known.load.inertia_kg_m2, 1e-12);
  const LoadError* const length = error_of(known, "length");
  ASSERT_NE(length, nullptr);
  EXPECT_NEAR(length->change.gravity_Nm, 2.0 * 9.81 * 0.001, 1e-12);
  EXPECT_NEAR(length->change.inertia_kg_m2, 2.0 * 2.0 * 0.3 * 0.001, 1e-12);
  const LoadError* const zero = error_of(known, "zero");
  ASSERT_NE(zero, nullptr);
  EXPECT_NEAR(zero->change.zero_rad, rad_from_deg(0.5), 1e-15);
  EXPECT_EQ(zero->change.gravity_Nm, 0.0);
}

TEST(KnownLoad, HasShareOfAConditionAsItsError) {
  const KnownLoad known =
      load_from("load: {pendulum: {mass: mass_kg, length: 0.5m}}\nload_uncertainty: {mass: 2%}",
                recording_with("mass_kg", 4.0));
  ASSERT_EQ(known.errors.size(), 1U);
  EXPECT_NEAR(known.errors.front().change.inertia_kg_m2, 0.02 * 4.0 * 0.25, 1e-12);
}

TEST(KnownLoad, KnowsWhatIsFitted) {
  const LoadSheet sheet = parse_load_sheet(
      "load: {pendulum: {mass: 2kg, length: 0.3m}, joint_inertia: fit, zero: fit}", "load.yaml");
  EXPECT_TRUE(sheet.fits_joint_inertia);
  EXPECT_TRUE(sheet.fits_zero);
  EXPECT_EQ(sheet.joint_inertia_kg_m2.value, 0.0);
}

/// A file of a load in the folder of `arm6.urdf`.
class UrdfLoads : public testing::Test {
 protected:
  KnownLoad of(const std::string& load) {
    (void)folder_.file("arm6.urdf",
                       test::file_bytes(std::string(TORSIO_SOURCE) + "/share/torsio/arm6.urdf"));
    return known_load(read_load_sheet(folder_.file("load.yaml", load)), recording_with());
  }
  TemporaryFolder folder_;
};

TEST_F(UrdfLoads, GiveTheTorqueOfTheArmsDynamicsAtEveryAngle) {
  const KnownLoad known =
      of("load: {urdf: arm6.urdf, joint: joint3, pose: {joint2: 20deg, joint5: -40deg}, "
         "payload: {link: flange, mass: 2kg, at: [0, 0, 0.05]}}\n"
         "load_uncertainty: {payload_mass: 10g}");
  ArmModel arm = test::arm6();
  arm.gravity_m_s2 = {0.0, 0.0, -9.81};
  arm.payload = {.mass_kg = 2.0, .com_m = {0.0, 0.0, 0.05}};
  const ArmDynamics dynamics(arm);
  std::vector<double> angle_rad = {0.0, rad_from_deg(20.0), 0.0, 0.0, rad_from_deg(-40.0), 0.0};
  const std::vector<double> rest(6, 0.0);
  std::vector<double> acceleration_rad_s2(6, 0.0);
  std::vector<double> torque_Nm(6);
  acceleration_rad_s2[2] = 1.5;
  for (const double angle : {-2.0, -0.3, 0.0, 0.9, 3.0}) {
    angle_rad[2] = angle;
    dynamics.inverse(angle_rad, rest, acceleration_rad_s2, torque_Nm);
    EXPECT_NEAR(known.load.gravity_Nm * std::sin(angle + known.load.zero_rad) +
                    known.load.inertia_kg_m2 * 1.5,
                torque_Nm[2], 1e-9)
        << angle;
  }
  ASSERT_EQ(known.errors.size(), 1U);
  EXPECT_GT(known.errors.front().change.inertia_kg_m2, 0.0);
}

TEST_F(UrdfLoads, AddAPayloadToAnyLinkThatTheJointMoves) {
  const auto inertia = [&](const std::string& payload) {
    return of("load: {urdf: arm6.urdf, joint: joint5" + payload + "}").load.inertia_kg_m2;
  };
  EXPECT_NEAR(inertia(", payload: {link: link5, mass: 2kg, at: [0.1, 0.2, 0]}") - inertia(""),
              2.0 * 0.01, 1e-9);
}

TEST_F(UrdfLoads, NameWhatTheArmDoesNotHave) {
  const auto refusal = [&](const std::string& load) {
    return error_message([&] { (void)of(load); });
  };
  EXPECT_THAT(refusal("load: {urdf: arm6.urdf, joint: joint33}"),
              AllOf(HasSubstr("load.joint"), HasSubstr("Did you mean 'joint3'")));
  EXPECT_THAT(refusal("load: {urdf: arm7.urdf, joint: joint3}"),
              HasSubstr("relative to the folder of"));
  EXPECT_THAT(refusal("load: {urdf: arm6.urdf, joint: joint3, payload: {link: hand, mass: 1kg, "
                      "at: [0, 0, 0]}}"),
              AllOf(HasSubstr("link6"), HasSubstr("flange"), HasSubstr("'hand'")));
  EXPECT_THAT(refusal("load: {urdf: arm6.urdf, joint: joint3, payload: {link: link2, mass: 1kg, "
                      "at: [0, 0, 0]}}"),
              HasSubstr("which is before it"));
  EXPECT_THAT(refusal("load: {urdf: arm6.urdf, joint: joint3, pose: {joint3: 10deg}}"),
              HasSubstr("joint3 moves in the recordings"));
}

TEST(LoadSheet, NamesTheLineOfWhatIsWrong) {
  EXPECT_THAT(refusal_of_sheet("load:\n  pendulum:\n    mass: 2\n    length: 0.3m"),
              AllOf(HasSubstr("load.yaml: line 3"), HasSubstr("a number with its unit")));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: 2kg, length: 3s}}"), HasSubstr("'3s'"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: 2kg, lenght: 3m}}"),
              HasSubstr("Did you mean 'length'"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: 2kg}}"), HasSubstr("'length' is missing"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: -2kg, length: 1m}}"),
              HasSubstr("a mass from 0kg to 1e6kg"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: 2kg, length: 1m, inclination: 91deg}}"),
              HasSubstr("-90deg to 90deg"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: 2kg, length: lever_kg}}"),
              HasSubstr("ends in _m"));
  EXPECT_THAT(refusal_of_sheet("load: {pendulum: {mass: nankg, length: 1m}}"),
              HasSubstr("'nankg'"));
  EXPECT_THAT(refusal_of_sheet("load: {joint_inertia: 1kg_m2}"), HasSubstr("'pendulum' or 'urdf'"));
  EXPECT_THAT(refusal_of_sheet("load: {urdf: a.urdf, joint: x, pendulum: {mass: 2kg, length: 1m}}"),
              HasSubstr("either"));
  EXPECT_THAT(refusal_of_sheet("load: 3"), HasSubstr("keys with values"));
  EXPECT_THAT(refusal_of_sheet("{"), HasSubstr("not YAML"));
}

TEST(LoadSheet, RefusesErrorsThatMeanNothing) {
  const std::string load = "load: {pendulum: {mass: 2kg, length: 0.3m}, joint_inertia: fit}\n";
  EXPECT_THAT(refusal_of_sheet(load + "load_uncertainty: {zero: 1%}"), HasSubstr("an angle"));
  EXPECT_THAT(refusal_of_sheet(load + "load_uncertainty: {mass: 100%}"), HasSubstr("below 100%"));
  EXPECT_THAT(refusal_of_sheet(load + "load_uncertainty: {mass: -1g}"), HasSubstr("not negative"));
  EXPECT_THAT(refusal_of_sheet(load + "load_uncertainty: {joint_inertia: 0.1kg_m2}"),
              HasSubstr("what is fitted"));
  EXPECT_THAT(refusal_of_sheet(load + "load_uncertainty: {payload_mass: 1%}"),
              HasSubstr("unknown key"));
}

TEST(KnownLoad, RefusesALoadThatNeedsNoTorque) {
  EXPECT_THAT(error_message([] { (void)load_from("load: {pendulum: {mass: 0kg, length: 1m}}"); }),
              HasSubstr("a load with gravity or inertia"));
}

}  // namespace
}  // namespace torsio
