#include "torsio/identify/drive/write_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "identify/drive/servo_recordings.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using ::testing::HasSubstr;
using testing::servo_recordings;

struct Identified {
  std::vector<Recording> recordings;
  DriveIdentification drive;
};

Identified identified_servo() {
  testing::Servo servo;
  servo.load_friction = 0.1;
  Identified result{.recordings = servo_recordings(servo), .drive = {}};
  const LoadSheet load =
      parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}", "load.yaml");
  result.drive =
      identify_drive(result.recordings, load, assumed_drive_sheet(result.recordings.front()),
                     {.terms = drive_terms({DriveTerm::delay, DriveTerm::load_friction}),
                      .starts = 1,
                      .has_standard_errors = false});
  return result;
}

/// Mean |error| of BAM's equations with the numbers of its file, as IDENTIFY.md section 2.1 states them.
double bam_mae(const nlohmann::json& p, const Recording& recording, const DriveSheet& drive) {
  const auto value = [&](const char* key) { return p.value(key, 0.0); };
  const std::vector<double>& goal = recording.channel("goal_angle_rad").values;
  const std::vector<double>& measured = recording.channel("joint_angle_rad").values;
  const std::vector<double>& enabled = recording.channel("enabled_1").values;
  const double gain = recording.channel("kp_1").values.front() * drive.error_gain_1_rad.value();
  const double dt = 0.005;
  double q = measured.front();
  double v = 0.0;
  double sum = 0.0;
  for (std::size_t n = 0; n < goal.size(); ++n) {
    sum += std::abs(q - measured[n]) / static_cast<double>(goal.size());
    const double u = 7.4 * std::clamp(gain * (goal[n] - q), -1.0, 1.0);
    const double motor = enabled[n] != 0.0 ? value("kt") / value("R") * (u - value("kt") * v) : 0.0;
    const double external = -0.5 * 9.80665 * 0.1 * std::sin(q + value("q_offset"));
    const double inertia = 0.5 * 0.1 * 0.1 + value("armature");
    const bool has_stribeck = p.contains("dtheta_stribeck");
    const double s =
        has_stribeck ? std::exp(-std::pow(std::abs(v / value("dtheta_stribeck")), value("alpha")))
                     : 0.0;
    double bound = value("friction_base") + value("friction_viscous") * std::abs(v) +
                   s * value("friction_stribeck");
    bound += (value("load_friction_base") + s * value("load_friction_stribeck")) *
             std::abs(motor - external);
    bound +=
        std::abs(value("load_friction_motor") * motor - value("load_friction_external") * external);
    bound += s * std::abs(value("load_friction_motor_stribeck") * motor -
                          value("load_friction_external_stribeck") * external);
    if (motor * external < 0.0)
      bound += s * (std::abs(motor) > std::abs(external)
                        ? value("load_friction_external_quad") * external * external
                        : value("load_friction_motor_quad") * motor * motor);
    const double stop = inertia / dt * v + motor + external;
    const double a =
        (motor + external - std::copysign(std::min(std::abs(stop), bound), stop)) / inertia;
    v += a * dt;
    q += v * dt + 0.5 * a * dt * dt;
  }
  return sum;
}

TEST(WriteDrive, BamRunsInItsEquationsWithTheErrorThatIsPrinted) {
  const Identified servo = identified_servo();
  const WrittenDrive written =
      write_drive(DriveTarget::bam, servo.drive, servo.recordings, "servo", {.starts = 1});
  const nlohmann::json file = nlohmann::json::parse(written.text);
  EXPECT_EQ(file.at("actuator"), "servo");
  EXPECT_EQ(file.at("model"), written.model);
  double mean = 0.0;
  for (const Recording& recording : servo.recordings)
    mean +=
        bam_mae(file, recording, servo.drive.drive) / static_cast<double>(servo.recordings.size());
  EXPECT_NEAR(mean, written.mae_rad, 0.001);
  EXPECT_THAT(file.at("torsio_note").get<std::string>(), HasSubstr("not expressed: delay"));
}

TEST(WriteDrive, NamesWhatATargetDoesNotExpress) {
  const Identified servo = identified_servo();
  const WrittenDrive mjcf =
      write_drive(DriveTarget::mjcf, servo.drive, servo.recordings, "servo", {.starts = 1});
  EXPECT_THAT(mjcf.not_expressed, ::testing::Contains("load_friction"));
  EXPECT_THAT(mjcf.text, HasSubstr("<joint name=\"servo_joint\""));
  EXPECT_THAT(mjcf.text, HasSubstr("Not expressed: delay, load_friction"));
  EXPECT_GE(mjcf.mae_rad, mjcf.own_mae_rad);
  const WrittenDrive lab =
      write_drive(DriveTarget::isaaclab, servo.drive, servo.recordings, "servo", {.starts = 1});
  EXPECT_THAT(lab.text, HasSubstr("not run with Isaac Lab"));
  EXPECT_THAT(lab.text, HasSubstr("armature="));
  EXPECT_THAT(lab.not_expressed, ::testing::Contains(HasSubstr("open winding")));
  // Only DCMotorCfg of Isaac Lab has the supply's limit, and that one has no delay.
  const bool has_limit = lab.text.find("DCMotorCfg(") != std::string::npos;
  EXPECT_EQ(lab.text.find("the limit of the supply at speed") == std::string::npos, has_limit);
}

TEST(WriteDrive, RefusesANameThatIsNoIdentifierAndALawWithoutAnAngle) {
  const Identified servo = identified_servo();
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, servo.drive, servo.recordings, "my servo"),
               UsageError);
  try {
    (void)drive_target("gazebo");
    FAIL() << "no error";
  } catch (const UsageError& error) {  // Python's users read the same text.
    EXPECT_THAT(error.what(), ::testing::StartsWith("the target (--write): expected bam"));
  }
  DriveIdentification other = servo.drive;
  other.drive.law = DriveLaw::voltage;
  other.drive.command = "duty_1";
  EXPECT_THROW((void)write_drive(DriveTarget::bam, other, servo.recordings, "servo"), UsageError);
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, other, servo.recordings, "servo"), UsageError);
}

TEST(WriteDrive, RefusesOtherRecordingsThanThoseOfTheDrive) {
  const Identified servo = identified_servo();
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, servo.drive, {}, "servo"), UsageError);
  const std::vector<Recording> one{servo.recordings.back()};
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, servo.drive, one, "servo"), UsageError);
  EXPECT_THROW((void)compare_with_bam(servo.drive, {}), UsageError);
  const DriveIdentification evaluated = evaluate_drive(servo.drive, one);
  EXPECT_GT(write_drive(DriveTarget::mjcf, evaluated, one, "servo", {.starts = 1}).mae_rad, 0.0);
  std::vector<Recording> more = servo.recordings;
  more.push_back(more.front());
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, servo.drive, more, "servo"), UsageError);
}

TEST(WriteDrive, HasNoTwoHyphensInACommentOfXml) {
  const Identified servo = identified_servo();
  std::vector<Recording> one{Recording("a--b ---> c", servo.recordings.front().sample_rate_Hz())};
  for (const Channel& channel : servo.recordings.front().channels()) one.front().add(channel);
  const DriveIdentification evaluated = evaluate_drive(servo.drive, one);
  const std::string text =
      write_drive(DriveTarget::mjcf, evaluated, one, "servo", {.starts = 1}).text;
  const std::size_t end = text.find("-->");
  EXPECT_EQ(text.find("--", 4), end);
  EXPECT_EQ(text.compare(end, 12, "-->\n<mujoco "), 0);
}

/// A drive with the law of torque on a sine, as a servo follows it.
Identified identified_pd(const DriveTerms& terms, double delay_s) {
  Identified result;
  DriveIdentification& drive = result.drive;
  result.recordings = {servo_recordings({}).front()};
  drive.load = parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}", "load.yaml");
  drive.drive = parse_drive_sheet("drive: {law: pd, kp: 2Nm_rad, kd: 0.1Nms_rad}", "drive.yaml");
  drive.terms = terms;
  drive.values = neutral_drive_values();
  at(drive.values, DriveParameter::armature) = 0.002;
  at(drive.values, DriveParameter::coulomb) = 0.01;
  at(drive.values, DriveParameter::delay) = delay_s;
  drive.step_s = 0.0025;
  // What it gives itself is what it is fitted to.
  const DriveTrace trace = simulate_drive(drive, result.recordings.front());
  Recording moved(result.recordings.front().name(), trace.sample_rate_Hz);
  moved.add({.name = "goal_angle_rad",
             .values = result.recordings.front().channel("goal_angle_rad").values});
  moved.add({.name = "joint_angle_rad", .values = trace.angle_rad});
  result.recordings = {moved};
  drive = evaluate_drive(drive, result.recordings);
  return result;
}

TEST(WriteDrive, GivesIsaacLabAnActuatorThatItsLawHas) {
  const Identified plain = identified_pd(drive_terms({DriveTerm::base}), 0.0);
  const WrittenDrive without =
      write_drive(DriveTarget::isaaclab, plain.drive, plain.recordings, "servo", {.starts = 1});
  EXPECT_THAT(without.text, HasSubstr("IdealPDActuatorCfg("));
  // DCMotorCfg would need both, and the sheet has no limit.
  EXPECT_THAT(without.text, ::testing::Not(HasSubstr("saturation_effort")));
  EXPECT_THAT(without.text, ::testing::Not(HasSubstr("effort_limit")));

  const Identified late = identified_pd(drive_terms({DriveTerm::base, DriveTerm::delay}), 0.02);
  const WrittenDrive delayed =
      write_drive(DriveTarget::isaaclab, late.drive, late.recordings, "servo", {.starts = 1});
  EXPECT_THAT(delayed.text, HasSubstr("DelayedPDActuatorCfg("));
  EXPECT_THAT(delayed.text, HasSubstr("max_delay=4,"));
}

}  // namespace
}  // namespace torsio
