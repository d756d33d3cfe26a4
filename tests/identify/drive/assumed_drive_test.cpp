#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "torsio/core/error.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"

namespace torsio {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Names = std::initializer_list<const char*>;

Recording recording_of(Names channels, Names conditions) {
  Recording recording("r", 100.0);
  for (const char* const channel : channels) recording.add({channel, {0.0, 0.1}});
  for (const char* const condition : conditions) recording.add_condition(condition, 2.0);
  return recording;
}

std::string refusal(Names channels, Names conditions) {
  try {
    (void)assumed_drive_sheet(recording_of(channels, conditions));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(AssumedDrive, TakesTheGoalBeforeCurrentAndTorqueWhereItsLawIsStated) {
  const auto law_of = [](Names channels, Names conditions) {
    return assumed_drive_sheet(recording_of(channels, conditions)).law;
  };
  EXPECT_EQ(law_of({"goal_angle_rad", "motor_current_A", "command_torque_Nm"}, {"kp_Nm_rad"}),
            DriveLaw::pd);
  EXPECT_EQ(law_of({"goal_angle_rad", "duty_1", "motor_current_A"}, {"supply_V"}),
            DriveLaw::position);
  EXPECT_EQ(law_of({"motor_current_A", "command_torque_Nm"}, {}), DriveLaw::current);
  EXPECT_EQ(law_of({"command_torque_Nm"}, {}), DriveLaw::torque);
}

TEST(AssumedDrive, RefusesAGoalWithoutItsLawBesideAnotherCommand) {
  EXPECT_THAT(refusal({"goal_angle_rad", "duty_1", "motor_current_A"}, {}),
              AllOf(HasSubstr("the condition supply_V"), HasSubstr("{law: current}")));
  EXPECT_THAT(refusal({"goal_angle_rad", "command_torque_Nm"}, {}), HasSubstr("which one drives"));
  EXPECT_THAT(refusal({"goal_angle_rad"}, {}), HasSubstr("channels that state the drive's law"));
}

}  // namespace
}  // namespace torsio
