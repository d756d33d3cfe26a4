#include "torsio/identify/exciting_program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TEST(ExcitingProgram, IsRepeatableWithinTheLimitsAndRead) {
  const ArmSetup setup = arm6_setup();
  const ExcitationSpec spec{.moves = 6, .candidates = 8, .seed = 3};
  const ExcitingProgram planned = exciting_program(setup, spec);
  const std::string text = program_yaml(planned.program);
  EXPECT_EQ(text, program_yaml(exciting_program(setup, spec).program));
  ASSERT_EQ(planned.program.steps.size(), 6U);
  EXPECT_EQ(planned.program.steps.back().to_rad, planned.program.start_rad);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_LE(planned.largest_torque_Nm[j], 0.9 * setup.joints[j].sheet.rating.torque_Nm.value);
  TemporaryFolder folder;
  folder.file("moves.yaml", text);
  const ArmProgram read = read_arm_program(folder.path("moves.yaml"), setup);
  ASSERT_EQ(read.steps.size(), 6U);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(read.steps[2].to_rad[j], planned.program.steps[2].to_rad[j], 1e-12);
}

TEST(ExcitingProgram, GivesMoreInformationPerSecondThanRandomMoves) {
  const ArmSetup setup = arm6_setup();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const ExcitingProgram random =
        exciting_program(setup, {.moves = 6, .candidates = 1, .seed = seed});
    const ExcitingProgram chosen =
        exciting_program(setup, {.moves = 6, .candidates = 15, .seed = seed});
    EXPECT_GT(chosen.information / chosen.duration_s, random.information / random.duration_s)
        << seed;
  }
}

TEST(ExcitingProgram, RefusesLimitsThatNoPoseKeeps) {
  const ArmSetup setup = arm6_setup();
  EXPECT_THAT(test::error_message([&] {
                (void)exciting_program(setup, {.candidates = 2, .lowest_height_m = 1.5});
              }),
              HasSubstr("no pose for move 1"));
  EXPECT_THAT(test::error_message([&] { (void)exciting_program(setup, {.moves = 2}); }),
              HasSubstr("moves: expected 3 to"));
  EXPECT_THAT(test::error_message([&] { (void)exciting_program(setup, {.range_share = 0.0}); }),
              HasSubstr("range"));
  ArmProgram program{.start_rad = {0.0}, .steps = {{.task = ArmTask::guide, .duration_s = 1.0}}};
  EXPECT_THAT(test::error_message([&] { (void)program_yaml(program); }),
              HasSubstr("moves and holds"));
}

}  // namespace
}  // namespace torsio
