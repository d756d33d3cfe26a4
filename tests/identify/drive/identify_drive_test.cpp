#include "torsio/identify/drive/identify_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "identify/drive/servo_recordings.hpp"
#include "numerics/student_t.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using ::testing::HasSubstr;
using testing::Servo;
using testing::servo_recording;
using testing::servo_recordings;

LoadSheet pendulum(const std::string& more = "") {
  return parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}\n" + more, "load.yaml");
}

double value_of(const DriveIdentification& identified, DriveParameter parameter) {
  return at(identified.values, parameter);
}

bool has_finding(const DriveIdentification& identified, const std::string& subject) {
  return std::ranges::any_of(
      identified.findings, [&](const DriveFinding& finding) { return finding.subject == subject; });
}

std::string message_of(const std::vector<Recording>& recordings, const DriveSheet& drive) {
  try {
    (void)identify_drive(recordings, pendulum(), drive,
                         {.has_standard_errors = false, .has_nested_score = false});
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

const DriveTerms kBaseAndDelay = drive_terms({DriveTerm::base, DriveTerm::delay});

TEST(IdentifyDrive, FindsTheParametersOfAServo) {
  const Servo servo;
  const std::vector<Recording> recordings = servo_recordings(servo);
  const DriveIdentification found = identify_drive(
      recordings, pendulum(), assumed_drive_sheet(recordings.front()), {.terms = kBaseAndDelay});
  EXPECT_NEAR(value_of(found, DriveParameter::torque_constant), servo.kt, 0.05 * servo.kt);
  EXPECT_NEAR(value_of(found, DriveParameter::resistance), servo.resistance,
              0.06 * servo.resistance);
  EXPECT_NEAR(value_of(found, DriveParameter::armature), servo.armature, 0.1 * servo.armature);
  EXPECT_NEAR(value_of(found, DriveParameter::zero), servo.zero, 0.003);
  EXPECT_NEAR(value_of(found, DriveParameter::coulomb), servo.coulomb, 0.15 * servo.coulomb);
  EXPECT_LT(found.held_out_mae_rad, 0.01);
  ASSERT_TRUE(found.error_gain.has_value());
  EXPECT_NEAR(found.error_gain->value_1_rad, servo.error_gain, 0.01 * servo.error_gain);
  for (const IdentifiedDriveParameter& parameter : found.parameters) {
    EXPECT_TRUE(std::isfinite(parameter.standard_error));
    EXPECT_LT(parameter.lowest, parameter.value);
    EXPECT_GT(parameter.highest, parameter.value);
  }
}

TEST(IdentifyDrive, KeepsFrictionThatGrowsWithTheLoadAndNoTermThatDoesNotGain) {
  Servo servo;
  servo.load_friction = 0.12;
  const std::vector<Recording> recordings = servo_recordings(servo);
  const DriveTerms largest =
      drive_terms({DriveTerm::base, DriveTerm::load_friction, DriveTerm::stribeck});
  const DriveIdentification found =
      identify_drive(recordings, pendulum(), assumed_drive_sheet(recordings.front()),
                     {.largest = largest, .has_standard_errors = false});
  EXPECT_TRUE(has(found.terms, DriveTerm::load_friction));
  EXPECT_FALSE(has(found.terms, DriveTerm::stribeck));
  EXPECT_NEAR(value_of(found, DriveParameter::load_friction), servo.load_friction,
              0.1 * servo.load_friction);
  EXPECT_LT(found.nested_mae_rad, 0.02);
}

TEST(IdentifyDrive, TakesAPayloadOnAJointOfAUrdfAsThePendulumThatItIs) {
  const TemporaryFolder folder;
  (void)folder.file("servo.urdf", R"(<robot name="servo">
  <link name="base"/>
  <joint name="servo" type="revolute">
    <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="10"/>
  </joint>
  <link name="rod">
    <inertial><mass value="1e-9"/><inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
</robot>)");
  const LoadSheet urdf =
      read_load_sheet(folder.file("load.yaml",
                                  "load: {urdf: servo.urdf, joint: servo, payload: {link: rod, "
                                  "mass: 0.5kg, at: [0, 0, -0.1]}}"));
  const std::vector<Recording> recordings = servo_recordings({});
  const DriveSheet drive = assumed_drive_sheet(recordings.front());
  const IdentifyOptions options{.terms = kBaseAndDelay, .starts = 1, .has_standard_errors = false};
  const DriveIdentification by_urdf = identify_drive(recordings, urdf, drive, options);
  const DriveIdentification by_pendulum = identify_drive(recordings, pendulum(), drive, options);
  for (const IdentifiedDriveParameter& parameter : by_pendulum.parameters) {
    const DriveParameterInfo& info = drive_parameter_info(parameter.parameter);
    if (!info.is_positive) continue;
    EXPECT_NEAR(value_of(by_urdf, parameter.parameter), parameter.value, 0.01 * parameter.value)
        << info.name;
  }
}

TEST(IdentifyDrive, DoesNotDependOnTheNumberOfThreads) {
  const std::vector<Recording> recordings = servo_recordings({});
  const DriveSheet drive = assumed_drive_sheet(recordings.front());
  const DriveIdentification one = identify_drive(
      recordings, pendulum(), drive, {.terms = kBaseAndDelay, .starts = 1, .threads = 1});
  const DriveIdentification three = identify_drive(
      recordings, pendulum(), drive, {.terms = kBaseAndDelay, .starts = 1, .threads = 3});
  EXPECT_EQ(one.values, three.values);
  EXPECT_EQ(one.parameters.back().standard_error, three.parameters.back().standard_error);
}

TEST(IdentifyDrive, AddsTheErrorOfTheLoadToTheStandardErrors) {
  const std::vector<Recording> recordings = servo_recordings({});
  const DriveIdentification found = identify_drive(
      recordings, pendulum("load_uncertainty: {mass: 3%}"), assumed_drive_sheet(recordings.front()),
      {.terms = kBaseAndDelay, .starts = 1});
  // All torques are in proportion to the mass: so is kt / R, and with it the torque of a duty.
  const IdentifiedDriveParameter& resistance = found.parameters[1];
  ASSERT_EQ(resistance.parameter, DriveParameter::resistance);
  EXPECT_NEAR(resistance.from_load / resistance.value, 0.03, 0.015);
  EXPECT_GE(resistance.standard_error, resistance.from_load);
}

TEST(IdentifyDrive, SimulatesARecordingFromItsCommandAlone) {
  const std::vector<Recording> recordings = servo_recordings({});
  const DriveIdentification found =
      identify_drive(recordings, pendulum(), assumed_drive_sheet(recordings.front()),
                     {.terms = kBaseAndDelay, .starts = 1, .has_standard_errors = false});
  const DriveTrace trace = simulate_drive(found, recordings.front());
  ASSERT_EQ(trace.angle_rad.size(), recordings.front().size());
  double sum = 0.0;
  for (std::size_t n = 0; n < trace.angle_rad.size(); ++n)
    sum += std::abs(trace.angle_rad[n] - trace.measured_rad[n]) /
           static_cast<double>(trace.angle_rad.size());
  EXPECT_NEAR(sum, found.recordings.front().mae_rad, 1e-12);
}

TEST(IdentifyDrive, RemarksOnWhatTheRecordingsLack) {
  const Servo servo;
  std::vector<Recording> recordings{servo_recording(servo, 200.0, 0.6, 0.3, false, 1),
                                    servo_recording(servo, 200.0, 0.6, 0.3, false, 2)};
  const DriveIdentification found =
      identify_drive(recordings, pendulum(), assumed_drive_sheet(recordings.front()),
                     {.terms = kBaseAndDelay, .starts = 1});
  EXPECT_TRUE(has_finding(found, "passive run"));
  EXPECT_TRUE(has_finding(found, "recordings"));
  EXPECT_FALSE(has_finding(found, "repeat"));
  EXPECT_TRUE(std::isnan(found.parameters.front().standard_error));
}

TEST(IdentifyDrive, AdvisesAReleaseWhereNoRecordingWasPassive) {
  const Servo servo;
  std::vector<Recording> recordings;
  for (unsigned seed = 1; seed < 4; ++seed)
    recordings.push_back(servo_recording(servo, 100.0 * seed, 0.6, 0.3, false, seed));
  const DriveIdentification found =
      identify_drive(recordings, pendulum(), assumed_drive_sheet(recordings.front()),
                     {.terms = kBaseAndDelay, .starts = 1, .has_standard_errors = false});
  const std::vector<DriveAdvice> advice = advise_drive(found, recordings);
  ASSERT_EQ(advice.size(), 4U);
  EXPECT_THAT(advice.front().recording, HasSubstr("released"));
  for (const DriveAdvice& row : advice) {
    EXPECT_GT(row.standard_error_ratio, 0.0);
    EXPECT_LT(row.standard_error_ratio, 1.0);
  }
  EXPECT_LT(advice.front().standard_error_ratio, 0.5 * advice.back().standard_error_ratio);
}

TEST(IdentifyDrive, RefusesWhatDoesNotDetermineTheTorque) {
  const std::vector<Recording> good = servo_recordings({});
  const DriveSheet drive = assumed_drive_sheet(good.front());

  Recording still("still", 200.0);
  still.add({.name = "goal_angle_rad", .values = std::vector<double>(800, 0.3)});
  still.add({.name = "joint_angle_rad", .values = std::vector<double>(800, 0.2)});
  still.add({.name = "duty_1", .values = std::vector<double>(800, 0.06)});
  still.add_condition("kp_1", 200.0);
  still.add_condition("supply_V", 7.4);
  EXPECT_THAT(message_of({still}, drive), HasSubstr("command"));

  Servo weak;
  weak.error_gain = 1.0;
  const std::vector<Recording> saturated{servo_recording(weak, 4000.0, 0.7, 0.8, false, 1)};
  DriveSheet stated = drive;
  stated.error_gain_1_rad = 1.0;
  EXPECT_THAT(message_of(saturated, stated), HasSubstr("limit"));

  DriveSheet torque;
  torque.law = DriveLaw::torque;
  EXPECT_THAT(message_of(good, torque), HasSubstr("command_torque_Nm"));
}

TEST(IdentifyDrive, AsksForTheErrorGainWhereNoDutyWasRecorded) {
  Recording recording("no duty", 200.0);
  const Recording with = servo_recording({}, 200.0, 0.7, 0.3, false, 1);
  for (const char* channel : {"goal_angle_rad", "joint_angle_rad"})
    recording.add(with.channel(channel));
  recording.add_condition("supply_V", 7.4);
  DriveSheet drive =
      parse_drive_sheet("drive: {law: position, gain: 200, supply: 7.4V}", "drive.yaml");
  EXPECT_THAT(message_of({recording}, drive), HasSubstr("error_gain"));
  drive.error_gain_1_rad = 0.003;
  EXPECT_EQ(message_of({recording}, drive), "no error");
}

TEST(IdentifyDrive, NamesTheSampleThatIsNotFinite) {
  std::vector<Recording> recordings = servo_recordings({});
  std::vector<double> angle = recordings.front().channel("joint_angle_rad").values;
  angle[100] = std::nan("");
  Recording broken("broken", 200.0);
  broken.add(
      {.name = "goal_angle_rad", .values = recordings.front().channel("goal_angle_rad").values});
  broken.add({.name = "joint_angle_rad", .values = angle});
  broken.add({.name = "duty_1", .values = recordings.front().channel("duty_1").values});
  broken.add_condition("kp_1", 100.0);
  broken.add_condition("supply_V", 7.4);
  EXPECT_THAT(message_of({broken}, assumed_drive_sheet(broken)), HasSubstr("t = 0.5 s"));
}

TEST(DriveSheets, ReadEachLaw) {
  const DriveSheet position = parse_drive_sheet(
      "drive: {law: position, gain: kp_1, error_gain: measured, supply: 12V, max_duty: 0.9, off: "
      "short}",
      "d.yaml");
  EXPECT_EQ(position.law, DriveLaw::position);
  EXPECT_EQ(position.gain.condition, "kp_1");
  EXPECT_FALSE(position.error_gain_1_rad.has_value());
  EXPECT_DOUBLE_EQ(position.supply_V.value, 12.0);
  EXPECT_DOUBLE_EQ(position.max_duty_1, 0.9);
  EXPECT_TRUE(position.brakes_when_off);
  const DriveSheet pd = parse_drive_sheet(
      "drive: {law: pd, kp: 300Nm_rad, kd: 12Nms_rad, filter: 40Hz, torque_limit: 28Nm}", "d.yaml");
  EXPECT_DOUBLE_EQ(pd.kp_Nm_rad.value, 300.0);
  EXPECT_DOUBLE_EQ(pd.speed_filter_Hz, 40.0);
  EXPECT_DOUBLE_EQ(pd.torque_limit_Nm.value, 28.0);
  EXPECT_EQ(parse_drive_sheet("law: current", "d.yaml").law, DriveLaw::current);
}

TEST(DriveSheets, RefuseAKeyOfAnotherLawAndANumberWithoutUnit) {
  const auto message = [](const char* text) {
    try {
      (void)parse_drive_sheet(text, "d.yaml");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message("drive: {law: current, supply: 7V}"), HasSubstr("supply"));
  EXPECT_THAT(message("drive: {law: position, supply: 7.4}"), HasSubstr("V"));
  EXPECT_THAT(message("drive: {law: positon, supply: 7.4V}"), HasSubstr("position, pd, voltage"));
  EXPECT_THAT(message("drive: {law: position, supply: 7.4V, max_duty: 3}"), HasSubstr("max_duty"));
  EXPECT_THAT(message("drive: {law: position, supply: 7.4V, off: loose}"),
              HasSubstr("open_circuit"));
  EXPECT_THAT(message("- 3"), HasSubstr("map"));
}

TEST(StudentT, HasTheTabulatedQuantiles) {
  EXPECT_NEAR(student_t(0.95, 1), 12.7062, 1e-4);
  EXPECT_NEAR(student_t(0.95, 2), 4.30265, 1e-5);
  EXPECT_NEAR(student_t(0.95, 7), 2.36462, 1e-5);
  EXPECT_NEAR(student_t(0.95, 15), 2.13145, 1e-5);
  EXPECT_NEAR(student_t(0.95, 1000), 1.96234, 1e-5);
}

}  // namespace
}  // namespace torsio
