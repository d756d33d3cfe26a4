#include "check/draft/mapping_draft.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

#include "check/draft/logger_styles.hpp"
#include "data/csv/csv_table.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

LogTable table_of(const std::string& text) {
  return parse_csv(text, "log.csv", {.rules = {.leaves_out_texts = true}});
}

MappingDraft draft_of(const std::string& text) {
  const LogTable table = table_of(text);
  MappingDraft draft = draft_mapping(table);
  try_draft(table, draft);
  return draft;
}

const ColumnGuess* guess_for(const MappingDraft& draft, const std::string& column) {
  const auto at = std::ranges::find(draft.columns, column,
                                    [](const ColumnGuess& guess) { return guess.summary.name; });
  return at == draft.columns.end() ? nullptr : &*at;
}

/// Whether the draft has for the column what a person would write.
bool is_right(const MappingDraft& draft, const test::StyledColumn& column) {
  const ColumnGuess* const guess = guess_for(draft, column.name);
  if (column.channel.empty()) return guess == nullptr || !guess->is_written();
  if (guess == nullptr || guess->channel != column.channel || guess->sign != column.sign ||
      guess->holds != column.holds)
    return false;
  const bool is_date = guess->summary.unit_origin == UnitOrigin::dates;
  if (column.unit.empty() && !is_date) return !guess->is_written();
  return guess->is_written() && (is_date || guess->unit == column.unit) &&
         guess->gear_ratio == column.gear_ratio;
}

std::string row_of(const test::LoggerStyle& style) {
  const MappingDraft draft = draft_of(style.text());
  std::size_t right = 0;
  std::string wrong;
  for (const test::StyledColumn& column : style.columns) {
    if (is_right(draft, column))
      ++right;
    else
      wrong += fmt::format("{}`{}`", wrong.empty() ? "" : ", ", column.name);
  }
  return fmt::format("| {} | {} of {} | {} |", style.name, right, style.columns.size(), wrong);
}

TEST(MappingDraft, HasTheColumnsOfEachLoggerAsThePageStates) {
  const std::string page = test::file_bytes(std::string(TORSIO_SOURCE) + "/docs/use/map.md");
  for (const test::LoggerStyle& style : test::logger_styles()) {
    EXPECT_THAT(page, HasSubstr(row_of(style))) << draft_of(style.text()).yaml();
    if (const char* const folder = std::getenv("TORSIO_LOGGER_STYLES"); folder != nullptr)
      std::ofstream(fmt::format("{}/{}.csv", folder, style.name)) << style.text();
  }
}

TEST(MappingDraft, OfEachLoggerIsAMappingThatReadsItsRecording) {
  for (const test::LoggerStyle& style : test::logger_styles()) {
    const MappingDraft draft = draft_of(style.text());
    EXPECT_EQ(draft.refusal, "") << style.name;
    EXPECT_NO_THROW((void)parse_mapping(draft.yaml(), "draft")) << draft.yaml();
  }
}

/// A joint of 80:1 with a sensor of the torque, in columns of these names.
std::string joint_log(const std::string& header, double torque_sign = 1.0) {
  std::string text = header + "\n";
  for (int row = 0; row < 800; ++row) {
    const test::JointState state = test::joint_at(row);
    text += fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}\n", state.t_s,
                        80.0 / test::kStyleRatio * state.motor_rad, state.joint_rad,
                        torque_sign * state.torque_Nm);
  }
  return text;
}

TEST(MappingDraft, EstimatesTheGearRatioWithTheSpringBetweenTheAngles) {
  const MappingDraft draft = draft_of(joint_log("t_s,motor_angle_rad,joint_angle_rad,torque_Nm"));
  ASSERT_NE(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("gear_angle_rad")->gear_ratio, 80.0);
  EXPECT_EQ(draft.of("gear_angle_rad")->certainty, Certainty::sure);
}

TEST(MappingDraft, TakesALetterAtTheEndForTheSideAndNotForMetres) {
  const MappingDraft draft = draft_of(joint_log("t,theta_m,q_l,tau_s"));
  ASSERT_NE(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("gear_angle_rad")->rule(),
            "gear_angle_rad: {from: theta_m, unit: rad, gear_ratio: 80}");
  ASSERT_NE(draft.of("torque_Nm"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("torque_Nm")->rule(), "torque_Nm: {from: tau_s, unit: Nm}");
}

TEST(MappingDraft, InvertsATorqueThatFallsWithTheDeflection) {
  const MappingDraft draft = draft_of(joint_log("t_s,motor_rad,joint_rad,torque_Nm", -1.0));
  ASSERT_NE(draft.of("torque_Nm"), nullptr);
  EXPECT_EQ(draft.of("torque_Nm")->sign, -1.0);
  EXPECT_THAT(draft.yaml(), HasSubstr("falls with the deflection"));
}

TEST(MappingDraft, WritesWhatTheDataDoNotShowAsAComment) {
  std::string text = "t_s,motor_rad,joint_rad,torque_Nm\n";
  for (int row = 0; row < 300; ++row)
    text += fmt::format("{:.3f},{:.5f},0.1,{:.5f}\n", 0.004 * row, std::sin(0.05 * row),
                        5.0 * std::sin(0.05 * row));
  const MappingDraft draft = draft_of(text);  // the joint is clamped
  EXPECT_EQ(draft.of("gear_angle_rad"), nullptr);
  EXPECT_THAT(draft.yaml(), HasSubstr("# gear_angle_rad: {from: motor_rad, unit: rad}  # not shown "
                                      "by the data: the gear ratio"));
}

TEST(MappingDraft, TakesNoMaskThatDoesNotMarkAChannel) {
  std::string text = "t_s,joint_rad,torque_Nm,new\n";
  for (int row = 0; row < 300; ++row)
    text += fmt::format("{:.3f},{:.5f},{:.5f},{}\n", 0.004 * row, std::sin(0.05 * row),
                        5.0 * std::cos(0.05 * row), row % 2);
  const MappingDraft draft = draft_of(text);
  EXPECT_EQ(draft.of("torque_fresh_1"), nullptr);
  EXPECT_THAT(draft.yaml(), HasSubstr("'new': which channel is new where it is 1"));
}

TEST(MappingDraft, HoldsAChannelWhoseCellsAreEmptyBetweenItsSamples) {
  std::string text = "t_s,joint_rad,torque_Nm\n";
  for (int row = 0; row < 400; ++row)
    text += fmt::format("{:.3f},{:.5f},{}\n", 0.004 * row, std::sin(0.05 * row),
                        row % 4 == 0 ? fmt::format("{:.4f}", 5.0 * std::cos(0.05 * row)) : "");
  EXPECT_THAT(draft_of(text).yaml(), HasSubstr("hold: [torque_Nm]"));
}

TEST(MappingDraft, SpreadsStampsThatAreTooCoarse) {
  std::string text = "time_ms,joint_rad,torque_Nm\n";
  for (int row = 0; row < 400; ++row)
    text += fmt::format("{},{:.5f},{:.5f}\n", 10 * (row * 4 / 10), std::sin(0.05 * row),
                        5.0 * std::cos(0.05 * row));
  const MappingDraft draft = draft_of(text);
  EXPECT_EQ(draft.clock, "{rebuild: true}");
  EXPECT_EQ(draft.refusal, "");
}

TEST(MappingDraft, TakesAnswersAndRefusesThoseWithoutUnit) {
  MappingDraft draft = draft_of(joint_log("t_s,a,b,c"));
  answer(draft, 3, "torque_mNm");
  ASSERT_NE(draft.of("torque_Nm"), nullptr);
  EXPECT_EQ(draft.of("torque_Nm")->rule(), "torque_Nm: {from: c, unit: mNm}");
  EXPECT_THROW(answer(draft, 2, "joint"), UsageError);
  EXPECT_THROW(answer(draft, 2, "torque_Nm"), UsageError);  // taken
  answer(draft, 3, "-");
  EXPECT_EQ(draft.of("torque_Nm"), nullptr);
}

TEST(MappingDraft, RefusesLogsWithoutMotion) {
  const auto refusal = [](const std::string& text) {
    return error_message([&] { (void)draft_of(text); });
  };
  EXPECT_THAT(refusal("t,q,tau\n0,1,2\n0.1,1,2\n0.2,1,2\n"),
              AllOf(HasSubstr("log.csv: all columns are constant"), HasSubstr("t, q, tau")));
  EXPECT_THAT(refusal("t\n0\n0.1\n0.2\n"), HasSubstr("the only column is a time or constant"));
  EXPECT_THAT(refusal("a,b\nx,y\nz,w\n"), HasSubstr("no column of numbers"));
  EXPECT_THAT(refusal(""), HasSubstr("the file is empty"));
}

TEST(MappingDraft, LeavesOutColumnsOfOneNameAndSaysWhich) {
  std::string text = "t_s,joint_rad,torque_Nm,torque_Nm\n";
  for (int row = 0; row < 300; ++row)
    text += fmt::format("{:.3f},{:.5f},{:.5f},1\n", 0.004 * row, std::sin(0.05 * row),
                        5.0 * std::cos(0.05 * row));
  EXPECT_THAT(draft_of(text).yaml(), HasSubstr("torque_Nm (column 4: column 3 has the same name)"));
}

TEST(MappingDraft, OfTenThousandColumnsNamesThoseThatItGuesses) {
  std::string text = "t_s,joint_rad,torque_Nm";
  for (int i = 0; i < 10000; ++i) text += fmt::format(",x{}", i);
  for (int row = 0; row < 20; ++row) {
    text += fmt::format("\n{:.3f},{:.5f},{:.5f}", 0.004 * row, std::sin(0.05 * row),
                        5.0 * std::cos(0.05 * row));
    for (int i = 0; i < 10000; ++i) text += fmt::format(",{}", (i + row) % 7);
  }
  const std::string yaml = draft_of(text + "\n").yaml();
  EXPECT_THAT(yaml,
              AllOf(HasSubstr("joint_angle_rad"), HasSubstr("more"), Not(HasSubstr("x9000"))));
}

}  // namespace
}  // namespace torsio
