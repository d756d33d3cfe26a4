// The text and the figures of the report of an identified drive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "identify/drive/known_servo.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "report/identify.hpp"
#include "torsio/identify/drive/drive_file.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

DriveIdentification servo_without_errors() {
  DriveIdentification drive = testing::known_servo();
  drive.parameters = {
      {.parameter = DriveParameter::coulomb, .value = at(drive.values, DriveParameter::coulomb)}};
  drive.recordings = {{.recording = "run", .group = "run"}};
  drive.groups = 1;
  return drive;
}

TEST(IdentificationReport, HasNoVerdictOnParametersWithoutStandardErrors) {
  const DriveIdentification drive = servo_without_errors();
  const std::string unknown = "it is not known which parameters";
  EXPECT_THAT(identification_text(drive), HasSubstr(unknown));
  EXPECT_THAT(identification_json(drive, {}), HasSubstr("\"is_determined\": null"));
  const std::vector<Recording> recordings{testing::servo_recording({}, 200.0, 0.7, 0.3, false, 1)};
  EXPECT_THAT(identification_report(drive, recordings, {}).summary, Contains(HasSubstr(unknown)));

  DriveIdentification complete = drive;
  complete.parameters.front().standard_error = 0.001;
  complete.parameters.front().lowest = 0.9 * complete.parameters.front().value;
  complete.parameters.front().highest = 1.1 * complete.parameters.front().value;
  complete.parameters.front().is_determined = true;
  EXPECT_THAT(identification_text(complete), Not(HasSubstr(unknown)));
  EXPECT_THAT(identification_json(complete, {}), HasSubstr("\"is_determined\": true"));
}

TEST(IdentificationReport, DrawsFrictionUpToTheLargestLoadOfTheRecordings) {
  // The joint carries up to m g l sin q, and L has the torque of the motor and that of gravity in it.
  const std::vector<Recording> recordings{
      testing::servo_recording({}, 800.0, 0.7, 0.1, false, 1, 10.0)};
  const ReportDocument report = identification_report(servo_without_errors(), recordings, {});
  double largest_Nm = 0.0;
  for (const ReportSection& section : report.sections)
    if (section.heading == "Friction")
      for (const XySeries& curve : std::get<XyFigure>(section.figures.front()).series)
        largest_Nm =
            std::max(largest_Nm, std::stod(curve.label.substr(curve.label.find(" of ") + 4)));
  double highest_rad = 0.0;
  for (const double angle : recordings.front().channel("joint_angle_rad").values)
    highest_rad = std::max(highest_rad, std::abs(angle));
  const double load_Nm = 0.5 * 9.81 * 0.1 * std::sin(highest_rad);
  EXPECT_NEAR(largest_Nm, 2.0 * load_Nm, 0.4 * load_Nm);
}

}  // namespace
}  // namespace torsio
