// Calls that no user means, and recordings that do not belong together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "identify/drive/drive_logs.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {
namespace {

using test::error_message;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string drive_refusal(const std::string& keys) {
  return error_message([&] { (void)parse_drive_sheet("drive: {" + keys + "}", "d.yaml"); });
}

const IdentifyOptions kShortSearch{.terms = drive_terms({DriveTerm::base}),
                                   .starts = 1,
                                   .has_standard_errors = false,
                                   .has_nested_score = false};

LoadSheet hanging_load() {
  return parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}", "load.yaml");
}

TEST(DriveRefusals, NameTheRangeOfANumber) {
  EXPECT_THAT(drive_refusal("law: position, supply: 1e300V"), HasSubstr("at most 100000V"));
  EXPECT_THAT(drive_refusal("law: pd, kp: -5Nm_rad"), HasSubstr("line 1 (drive.kp)"));
  EXPECT_THAT(drive_refusal("law: pd, kp: 1e300Nm_rad"), HasSubstr("a gain above 0Nm/rad"));
}

TEST(DriveRefusals, NameTheUnitOfAChannel) {
  EXPECT_THAT(drive_refusal("law: position, supply: 7V, angle: duty_1"),
              AllOf(HasSubstr("drive.angle"), HasSubstr("ends in _rad, found 'duty_1'")));
  EXPECT_THAT(drive_refusal("law: voltage, supply: 7V, command: goal_angle_rad"),
              HasSubstr("ends in _V or _1"));
  EXPECT_THAT(drive_refusal("law: current, command: nosuch"), HasSubstr("ends in _A"));
  EXPECT_EQ(parse_drive_sheet("drive: {law: torque, command: wanted_torque_Nm}", "d.yaml").command,
            "wanted_torque_Nm");
}

TEST(DriveRefusals, NameTheMotorsThatWereMixed) {
  std::vector<Recording> recordings = testing::servo_recordings({});
  for (Recording& recording : recordings) recording.labels = {{"motor", "xl330"}};
  recordings.back().labels = {{"motor", "sts3250"}};
  EXPECT_THAT(error_message([&] {
                (void)identify_drive(recordings, hanging_load(),
                                     assumed_drive_sheet(recordings.front()), kShortSearch);
              }),
              AllOf(HasSubstr("different motors: sts3250 in gain 400 run 6, xl330 in"),
                    HasSubstr("Identify each drive from its own recordings")));
}

TEST(DriveRefusals, NameWhatRecordingsCanBeGroupedBy) {
  std::vector<Recording> recordings = testing::servo_recordings({});
  for (Recording& recording : recordings) recording.labels = {{"motor", "xl330"}};
  EXPECT_THAT(error_message([&] { (void)drive_groups(recordings, "gain"); }),
              HasSubstr("found recordings with kp_1, supply_V, motor"));
}

TEST(DriveRefusals, NameAnglesThatAreRatherDegrees) {
  const Recording right = testing::servo_recording({}, 200.0, 0.7, 0.3, false, 1);
  Recording degrees("in degrees", 200.0);
  for (Channel channel : right.channels()) {
    if (channel.name.ends_with("angle_rad"))
      for (double& value : channel.values) value *= 57.3;
    degrees.add(std::move(channel));
  }
  EXPECT_THAT(error_message([&] {
                (void)identify_drive({degrees}, hanging_load(), assumed_drive_sheet(degrees),
                                     kShortSearch);
              }),
              HasSubstr("If the log is in degrees"));
}

}  // namespace
}  // namespace torsio
