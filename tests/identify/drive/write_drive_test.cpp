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
}

TEST(WriteDrive, RefusesANameThatIsNoIdentifierAndALawWithoutAnAngle) {
  const Identified servo = identified_servo();
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, servo.drive, servo.recordings, "my servo"),
               UsageError);
  EXPECT_THROW((void)drive_target("gazebo"), UsageError);
  DriveIdentification other = servo.drive;
  other.drive.law = DriveLaw::voltage;
  other.drive.command = "duty_1";
  EXPECT_THROW((void)write_drive(DriveTarget::bam, other, servo.recordings, "servo"), UsageError);
  EXPECT_THROW((void)write_drive(DriveTarget::mjcf, other, servo.recordings, "servo"), UsageError);
}

}  // namespace
}  // namespace torsio
