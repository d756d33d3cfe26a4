#include "identify/drive/drive_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "identify/drive/drive_logs.hpp"
#include "servo_recordings.hpp"

namespace torsio {
namespace {

using testing::Servo;

struct FittedServo {
  std::vector<DriveLog> logs;
  DriveTerms terms = drive_terms({DriveTerm::base, DriveTerm::delay});
  DriveFitOptions options{.starts = 1};
  DriveValues values{};
};

/// The relative standard error of the mass is the only error of the load.
FittedServo fitted(const std::string& mass_error) {
  const Servo servo;
  FittedServo made;
  const std::vector<Recording> recordings = servo_recordings(servo);
  DriveSheet drive = assumed_drive_sheet(recordings.front());
  drive.error_gain_1_rad = servo.error_gain;
  made.logs = drive_logs(recordings,
                         parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}\n"
                                          "load_uncertainty: {mass: " +
                                              mass_error + "}",
                                          "load.yaml"),
                         drive);
  made.values = fit_drive(pointers_to(made.logs), made.terms, made.options).values;
  return made;
}

IdentifiedDriveParameter parameter_of(const FittedServo& servo, DriveParameter wanted,
                                      double relative_gain_error = 0.0) {
  for (const IdentifiedDriveParameter& parameter : parameters_with_errors(
           servo.logs, servo.terms, servo.values, true, relative_gain_error, servo.options, 2))
    if (parameter.parameter == wanted) return parameter;
  return {};
}

TEST(DriveErrors, OfTheLoadAreInProportionToIt) {
  const double small = parameter_of(fitted("0.5%"), DriveParameter::coulomb).from_load;
  const double large = parameter_of(fitted("5%"), DriveParameter::coulomb).from_load;
  EXPECT_NEAR(small, 0.1 * large, 0.02 * large);
  // Friction is proportional to the torque's scale, which the mass gives.
  EXPECT_NEAR(large, 0.05 * Servo().coulomb, 0.02 * Servo().coulomb);
}

TEST(DriveErrors, HaveTheErrorOfAMeasuredGainInThem) {
  const FittedServo servo = fitted("0.1%");
  const double exact = parameter_of(servo, DriveParameter::resistance).standard_error;
  const IdentifiedDriveParameter found =
      parameter_of(servo, DriveParameter::resistance, /*relative_gain_error=*/0.03);
  // The duty for an error is 3 % larger: so is the resistance that explains the same torque, as far as the duty is not
  // limited.
  const double from_gain = std::sqrt(found.standard_error * found.standard_error - exact * exact);
  EXPECT_GT(from_gain, 0.025 * found.value);
  EXPECT_LT(from_gain, 0.06 * found.value);
}

}  // namespace
}  // namespace torsio
