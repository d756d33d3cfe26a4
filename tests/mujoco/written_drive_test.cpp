// The file of an identified drive, run by MuJoCo itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "identify/drive/drive_logs.hpp"
#include "identify/drive/drive_search.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "support/mujoco_model.hpp"
#include "torsio/identify/drive/write_drive.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::test {
namespace {

/// Mean |error of the angle of the motor| of a free run in MuJoCo, from the command of a log.
double mujoco_mae_rad(const std::string& xml, const DriveLog& log) {
  const MujocoModel joint(xml);
  mjData* const data = joint.data.get();
  const auto steps = static_cast<int>(std::lround(log.sample_period_s / joint.model->opt.timestep));
  const DriveRun start = run_from(log, 0, log.size());
  data->qpos[0] = start.angle_rad;
  data->qvel[0] = start.speed_rad_s;
  double sum = 0.0;
  for (std::size_t n = 0; n < log.size(); ++n) {
    sum += std::abs(data->qpos[0] - log.angle_rad[n]) / static_cast<double>(log.size());
    for (int k = 0; k < steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      data->ctrl[0] = log.command[n] + share * (log.command_end[n] - log.command[n]);
      mj_step(joint.model.get(), data);
    }
  }
  EXPECT_EQ(data->warning[mjWARN_BADQACC].number, 0);
  return sum;
}

/// @param recordings of one gain and one load, which are those of the file
void expect_stated_error(const std::vector<Recording>& recordings, const std::string& load,
                         std::initializer_list<DriveTerm> terms) {
  const LoadSheet sheet = parse_load_sheet(load, "load.yaml");
  const DriveIdentification identified =
      identify_drive(recordings, sheet, assumed_drive_sheet(recordings.front()),
                     {.terms = drive_terms(terms), .starts = 1, .has_standard_errors = false});
  const WrittenDrive written =
      write_drive(DriveTarget::mjcf, identified, recordings, "servo", {.starts = 1});
  double mean_rad = 0.0;
  for (const Recording& recording : recordings)
    mean_rad += mujoco_mae_rad(written.text, drive_log(recording, sheet, identified.drive)) /
                static_cast<double>(recordings.size());
  // Below that, the order of MuJoCo's substeps decides: a twentieth of a count of a 12-bit encoder.
  constexpr double kLeast_rad = 6e-5;
  EXPECT_NEAR(mean_rad, written.mae_rad, std::max(0.1 * written.mae_rad, kLeast_rad));
}

TEST(WrittenDrive, HasTheErrorInMujocoThatItsFileStates) {
  ::torsio::testing::Servo servo;
  servo.load_friction = 0.12;
  std::vector<Recording> recordings;
  for (const double frequency_Hz : {0.3, 0.5, 0.8})
    recordings.push_back(::torsio::testing::servo_recording(
        servo, 200.0, 0.7, frequency_Hz, false, static_cast<unsigned>(recordings.size() + 1)));
  expect_stated_error(recordings, "load: {pendulum: {mass: 0.5kg, length: 0.1m}}",
                      {DriveTerm::load_friction, DriveTerm::delay});
}

TEST(WrittenDrive, WithASpringHasTheErrorInMujocoThatItsFileStates) {
  std::vector<Recording> recordings;
  for (const char* const experiment : {"air-chirp", "air-multisine"})
    recordings.push_back(simulate({.actuator = "dfki-50",
                                   .experiment = experiment,
                                   .duration_s = 8.0,
                                   .lever_m = 0.2,
                                   .mass_kg = 9.0}));
  expect_stated_error(
      recordings,
      "load: {pendulum: {mass: mass_kg, length: lever_m}, joint_inertia: 0.15kg_m2, zero: 0deg}",
      {DriveTerm::spring, DriveTerm::bearing, DriveTerm::load_friction});
}

}  // namespace
}  // namespace torsio::test
