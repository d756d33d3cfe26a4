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
#include <vector>

#include "check/draft/column_relations.hpp"
#include "check/draft/logger_styles.hpp"
#include "check/draft/name_reading.hpp"
#include "data/csv/csv_table.hpp"
#include "data/log_summary.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
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

/// A link that is held by a load of 300 Nm/rad on a spring of 350 Nm/rad with friction, and a torque of the other sign.
std::string elastic_log(const std::string& header) {
  std::string text = header + "\n";
  for (int row = 0; row < 2000; ++row) {
    const double t = 0.004 * row;
    const double torque = 25.0 * std::sin(1.9 * t) + 6.0 * std::sin(4.1 * t);
    const double rate = 25.0 * 1.9 * std::cos(1.9 * t) + 6.0 * 4.1 * std::cos(4.1 * t);
    const double joint = torque / 300.0;
    const double motor = 80.0 * (joint + torque / 350.0 + 0.004 * std::tanh(0.2 * rate));
    text += fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}\n", t, motor, joint, -torque);
  }
  return text;
}

constexpr const char* kJointHeader = "t_s,motor_angle_rad,joint_angle_rad,torque_Nm";

TEST(MappingDraft, AssertsNoRatioWhereJointAndTorqueMoveTogether) {
  const MappingDraft draft = draft_of(elastic_log(kJointHeader));
  EXPECT_EQ(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_THAT(
      draft.yaml(),
      AllOf(HasSubstr("# gear_angle_rad: {from: motor_angle_rad, unit: rad, gear_ratio: N}"),
            HasSubstr("move together (correlation -1.00)"),
            HasSubstr("moves without load through 1 rad or more"),
            HasSubstr("complete the line of gear_angle_rad below")));
  ASSERT_NE(draft.of("torque_Nm"), nullptr);
  EXPECT_EQ(draft.of("torque_Nm")->sign, 1.0);
  EXPECT_EQ(draft.of("torque_Nm")->certainty, Certainty::unsure);
}

TEST(MappingDraft, TakesTheRatioFromASecondLogInWhichTheJointMovesFreely) {
  const std::vector<LogTable> tables = {table_of(elastic_log(kJointHeader)),
                                        table_of(joint_log(kJointHeader, -1.0))};
  MappingDraft draft = draft_mapping(tables);
  try_draft(tables, draft);
  ASSERT_NE(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("gear_angle_rad")->gear_ratio, 80.0);
  EXPECT_EQ(draft.of("torque_Nm")->sign, -1.0) << draft.yaml();
  EXPECT_EQ(draft.refusal, "");
  const std::vector<LogTable> others = {tables.front(), table_of(joint_log("t_s,a,b,c"))};
  EXPECT_THAT(error_message([&] { (void)draft_mapping(others); }),
              HasSubstr("expected the columns and units of log.csv: t_s, motor_angle_rad"));
}

TEST(MappingDraft, StatesWhyARatioIsUnsure) {
  // A drive that slips by another amount each time: no ratio explains it.
  Random random(5);
  double slip = 0.0;
  std::string text = "t_s,motor_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int row = 0; row < 800; ++row) {
    const test::JointState state = test::joint_at(row);
    slip += 0.12 * random.normal();
    text += fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}\n", state.t_s, state.motor_rad + slip,
                        state.joint_rad, state.torque_Nm);
  }
  const MappingDraft draft = draft_of(text);
  const ColumnGuess* const motor = draft.of("gear_angle_rad");
  ASSERT_NE(motor, nullptr) << draft.yaml();
  ASSERT_EQ(motor->certainty, Certainty::unsure) << draft.yaml();
  ASSERT_GT(motor->gear_ratio, 1.0) << draft.yaml();
  EXPECT_THAT(motor->reasons,
              testing::Contains(testing::AnyOf(HasSubstr("fit alike"), HasSubstr("% only"),
                                               HasSubstr("of its motion only"))))
      << draft.yaml();
}

TEST(MappingDraft, OffersTheErrorOfTheTorqueSensor) {
  std::string text = "t_s,motor_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int row = 0; row < 800; ++row) {
    const test::JointState state = test::joint_at(row);
    text += fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}\n", state.t_s, state.motor_rad,
                        state.joint_rad, state.torque_Nm);
  }
  std::string yaml = draft_of(text).yaml();
  const std::string line = "# uncertainty: {torque_Nm: {class: CLASS, range: RANGE}}";
  const std::size_t at = yaml.find(line);
  ASSERT_NE(at, std::string::npos) << yaml;
  yaml.replace(at, line.size(), "uncertainty: {torque_Nm: {class: 0.2%, range: 100Nm}}");
  EXPECT_EQ(parse_mapping(yaml, "draft").uncertainty.size(), 1U) << yaml;
}

TEST(MappingDraft, WithoutATorqueALittleMotionShowsNoSureRatio) {
  std::string text = "t_s,motor_angle_rad,joint_angle_rad\n";
  for (int row = 0; row < 800; ++row)
    text += fmt::format("{:.3f},{:.6f},{:.6f}\n", 0.004 * row, 148.0 * 0.1 * std::sin(0.02 * row),
                        0.1 * std::sin(0.02 * row));
  const MappingDraft draft = draft_of(text);
  ASSERT_NE(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("gear_angle_rad")->certainty, Certainty::unsure);
}

/// With the counts of an encoder of 16384 on the motor, in a row of units.
std::string counted_log() {
  std::string text = "Zeit;Motorposition;Abtriebswinkel;Drehmoment\nms;Inc;Grad;N\u00b7m\n";
  for (int row = 0; row < 800; ++row) {
    const test::JointState state = test::joint_at(row);
    text +=
        fmt::format("{:.0f};{:.0f};{:.6f};{:.5f}\n", 1e3 * state.t_s,
                    std::floor(80.0 / test::kStyleRatio * state.motor_rad / 6.283185307 * 16384.0),
                    57.29577951 * state.joint_rad, state.torque_Nm);
  }
  return text;
}

TEST(MappingDraft, OfCountsOfTheMotorHasALineThatIsReadOnceItIsComplete) {
  const MappingDraft draft = draft_of(counted_log());
  const std::string yaml = draft.yaml();
  const std::string line =
      "# gear_angle_rad: {from: Motorposition, unit: rev, scale: 1/COUNTS, gear_ratio: N}  # not "
      "shown by the data: counts of the motor's encoder: write those of one turn";
  ASSERT_THAT(yaml, HasSubstr(line));
  EXPECT_THAT(yaml, HasSubstr("complete the line of gear_angle_rad below, from 'Motorposition'"));
  EXPECT_THAT(yaml, HasSubstr("joint_angle_rad: {from: Abtriebswinkel, unit: deg}  # sure"));
  std::string completed = yaml;
  completed.replace(completed.find("# gear_angle_rad"), 2, "");
  const auto replace = [&](const std::string& word, const std::string& by) {
    completed.replace(completed.find(word), word.size(), by);
  };
  EXPECT_THAT(error_message([&] { (void)parse_mapping(completed, "m.yaml"); }),
              HasSubstr("Write the counts of one turn of the encoder in the place of COUNTS"));
  replace("1/COUNTS", "1/16384");
  EXPECT_THAT(error_message([&] { (void)parse_mapping(completed, "m.yaml"); }),
              HasSubstr("Write the gear ratio in the place of N"));
  replace("gear_ratio: N", "gear_ratio: 80");
  const std::vector<Recording> read =
      measured_recordings(table_of(counted_log()), parse_mapping(completed, "m.yaml"));
  const test::JointState last = test::joint_at(799);
  EXPECT_NEAR(read.front().channel("gear_angle_rad").values.back(),
              last.motor_rad / test::kStyleRatio, 1e-5);
}

TEST(MappingDraft, TakesCountsInBracketsForThoseOfAnEncoder) {
  for (const std::string name :
       {"Motorposition [counts]", "Motorposition [Ink]", "Motorposition [Inkr]",
        "Motor encoder [counts]", "Encoder motore [imp]", "Motorgeber [Inkr]", "Geber Motor [Ink]",
        "Codeur moteur [pts]", "Drehgeber Motor (Inc)"}) {
    std::string text = counted_log();
    text.replace(text.find("Motorposition"), std::string("Motorposition").size(), name);
    text.replace(text.find(";Inc;"), 5, ";;");
    std::string yaml = draft_of(text).yaml();
    const std::string rule = ", unit: rev, scale: 1/COUNTS, gear_ratio: N}";
    ASSERT_THAT(yaml, HasSubstr(rule)) << name;
    EXPECT_THAT(yaml, HasSubstr("# not shown by the data: counts of the motor's encoder")) << name;
    yaml.replace(yaml.find("# gear_angle_rad"), 2, "");
    yaml.replace(yaml.find(rule), rule.size(), ", unit: rev, scale: 1/16384, gear_ratio: 80}");
    const std::vector<Recording> read =
        measured_recordings(table_of(text), parse_mapping(yaml, "m.yaml"));
    EXPECT_NEAR(read.front().channel("gear_angle_rad").values.back(),
                test::joint_at(799).motor_rad / test::kStyleRatio, 1e-5)
        << name;
  }
}

TEST(MappingDraft, TakesAnUnknownUnitInBracketsForNoCounts) {
  std::string text = counted_log();
  text.replace(text.find("Motorposition"), std::string("Motorposition").size(),
               "Motorposition [foo]");
  text.replace(text.find(";Inc;"), 5, ";;");
  EXPECT_THAT(draft_of(text).yaml(), HasSubstr("unit: in brackets, not known"));
  EXPECT_EQ(read_name("Drehmomentgeber").quantity, Quantity::torque);
  EXPECT_EQ(read_name("Drehmoment Geber").quantity, Quantity::torque);
}

/// A counter of 16 bits in ms, which begins again; a force at a lever of 0.12 m.
std::string overflowing_log() {
  std::string text = "Zaehler [ms];joint [rad];Kraft Messdose [N]\n";
  for (int row = 0; row < 800; ++row) {
    const test::JointState state = test::joint_at(row);
    text += fmt::format("{};{:.6f};{:.5f}\n", (64000 + 4 * row) % 65536, state.joint_rad,
                        state.torque_Nm / 0.12);
  }
  return text;
}

TEST(MappingDraft, WritesTheSpanOfACounterThatBeginsAgain) {
  const std::string text = overflowing_log();
  const MappingDraft draft = draft_of(text);
  EXPECT_EQ(draft.refusal, "");
  EXPECT_THAT(draft.yaml(), HasSubstr("t_s: {from: \"Zaehler [ms]\", unit: ms, unwrap: 65536}"));
  LogSummary summary;
  state_clock(table_of(text), summary);
  EXPECT_EQ(summary.clock, "Zaehler [ms]");
  EXPECT_NEAR(summary.duration_s, 799 * 0.004, 1e-9);
}

TEST(MappingDraft, OfAForceStatesTheLineOfItsTorque) {
  const std::string text = overflowing_log();
  std::string yaml = draft_of(text).yaml();
  const std::string line = "torque_Nm: {from: \"Kraft Messdose [N]\", unit: N, scale: 0.12}";
  ASSERT_THAT(yaml, HasSubstr("# Missing: no column is the torque"));
  ASSERT_THAT(yaml, HasSubstr(line));
  yaml.insert(yaml.find("\nchannels:\n") + 11, "  " + line + "\n");
  const std::vector<Recording> read =
      measured_recordings(table_of(text), parse_mapping(yaml, "m.yaml"));
  EXPECT_NEAR(read.front().channel("torque_Nm").values.back(), test::joint_at(799).torque_Nm, 1e-5);
}

TEST(MappingDraft, ReadsNoUnitThatHasTwoMeaningsOrNone) {
  const std::string grad = [] {
    std::string text = counted_log();
    text.replace(text.find("Grad"), 4, "grad");
    return text;
  }();
  EXPECT_THAT(draft_of(grad).yaml(),
              HasSubstr("# joint_angle_rad: {from: Abtriebswinkel, unit: deg}  # not shown by the "
                        "data: It may be degrees"));
  std::string unknown = counted_log();
  unknown.replace(unknown.find("Grad"), 4, "Foo");
  EXPECT_THAT(draft_of(unknown).yaml(), HasSubstr("the size of its unit 'Foo'"));
}

TEST(MappingDraft, WritesWhatTheDataDoNotShowAsAComment) {
  std::string text = "t_s,motor_rad,joint_rad,torque_Nm\n";
  for (int row = 0; row < 300; ++row)
    text += fmt::format("{:.3f},{:.5f},0.1,{:.5f}\n", 0.004 * row, std::sin(0.05 * row),
                        5.0 * std::sin(0.05 * row));
  const MappingDraft draft = draft_of(text);  // the joint is clamped
  EXPECT_EQ(draft.of("gear_angle_rad"), nullptr);
  EXPECT_THAT(draft.yaml(),
              HasSubstr("# gear_angle_rad: {from: motor_rad, unit: rad, gear_ratio: N}  "
                        "# not shown by the data: the gear ratio"));
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

/// A joint whose columns a function of the row writes.
template <class CellsOf>
std::string log_of(const std::string& header, int rows, const CellsOf& cells_of) {
  std::string text = header + "\n";
  for (int row = 0; row < rows; ++row) text += cells_of(row) + "\n";
  return text;
}

/// Between -1 and 1, without period.
double noise(int row) {
  return std::fmod(std::abs(std::sin(12.9898 * row) * 43758.5453), 2.0) - 1.0;
}

// The encoder of a locked output has noise, whose factor has a sign by chance.
TEST(MappingDraft, TakesNoSignFromTheNoiseOfALockedOutput) {
  for (const double sign : {1.0, -1.0}) {
    const MappingDraft draft = draft_of(log_of(kJointHeader, 2000, [&](int row) {
      const double torque = 20.0 * std::sin(0.01 * row) + 5.0 * std::sin(0.023 * row);
      return fmt::format("{:.3f},{:.6f},{:.9f},{:.5f}", 0.004 * row,
                         100.0 * (torque / 350.0 + 0.0001 * noise(row + 5000)),
                         sign * 2e-6 * noise(row), torque);
    }));
    EXPECT_EQ(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
    EXPECT_THAT(draft.yaml(), HasSubstr("it does not move with the joint"));
    const ColumnGuess* const motor = guess_for(draft, "motor_angle_rad");
    EXPECT_EQ(motor->sign, 1.0) << draft.yaml();
    ASSERT_NE(draft.of("torque_Nm"), nullptr);
    EXPECT_EQ(draft.of("torque_Nm")->sign, 1.0) << draft.yaml();
    EXPECT_THAT(draft.of("torque_Nm")->reasons, testing::Each(Not(HasSubstr("deflection"))));
  }
}

TEST(MappingDraft, ComparesWidthsOfAnglesInOneUnit) {
  // The angle of the motor's side is 20 times the joint's, but in revolutions.
  const MappingDraft draft = draft_of(log_of("t_s,enc_a_rev,enc_b_deg,torque_Nm", 800, [](int row) {
    const test::JointState state = test::joint_at(row);
    return fmt::format("{:.3f},{:.8f},{:.6f},{:.5f}", state.t_s,
                       20.0 / test::kStyleRatio * state.motor_rad / 6.283185307179586,
                       57.29577951 * state.joint_rad, state.torque_Nm);
  }));
  EXPECT_EQ(guess_for(draft, "enc_a_rev")->rule(),
            "gear_angle_rad: {from: enc_a_rev, unit: rev, gear_ratio: 20}");
  EXPECT_EQ(guess_for(draft, "enc_b_deg")->rule(), "joint_angle_rad: {from: enc_b_deg, unit: deg}");
  EXPECT_EQ(draft.of("torque_Nm")->sign, 1.0) << draft.yaml();
}

// The error of the ratio is that of the motion that the joint has without the torque.
TEST(MappingDraft, StatesTheErrorOfARatioThatTheTorqueHides) {
  JointLog log;
  for (int row = 0; row < 2000; ++row) {
    const double torque = std::sin(0.02 * row);
    log.torque.push_back(torque);
    log.joint.push_back(torque + 0.01 * noise(row));
    log.motor.push_back(7.9 * log.joint.back() + 3.0 * torque + 0.02 * noise(row + 7000));
  }
  const auto fit = fit_gear({log});
  ASSERT_TRUE(fit);
  // 0.02 / sqrt(3) of noise over 0.01 / sqrt(3) sqrt(2000) of motion.
  EXPECT_NEAR(fit->error, 2.0 / std::sqrt(2000.0), 0.005);
  EXPECT_NEAR(fit->factor, 7.9, 4.0 * fit->error);
  EXPECT_TRUE(moves_with_joint(*fit));
}

TEST(MappingDraft, HasNoRatioForAFactorOfZero) {
  EXPECT_EQ(plausible_ratio({.factor = 0.0}), 0.0);
  EXPECT_EQ(plausible_ratio({.factor = HUGE_VAL}), 0.0);
  EXPECT_EQ(plausible_ratio({.factor = -100.02}), 100.0);
}

std::string log_with_step(double step) {
  return log_of("t,joint_rad,torque_Nm", 400, [&](int row) {
    return fmt::format("{:.6g},{:.5f},{:.5f}", step * row, std::sin(0.05 * row),
                       5.0 * std::cos(0.05 * row));
  });
}

TEST(MappingDraft, IsUnsureOfAUnitOfTimeWhereTwoFit) {
  const auto clock_for = [](double step) { return *guess_for(draft_of(log_with_step(step)), "t"); };
  struct Step {
    double step;
    const char* unit;
    Certainty certainty;
  };
  for (const Step& each :
       {Step{0.004, "s", Certainty::likely}, Step{0.1, "s", Certainty::unsure},
        Step{0.5, "ms", Certainty::unsure}, Step{1.0, "ms", Certainty::likely},
        Step{20.0, "ms", Certainty::likely}, Step{250.0, "us", Certainty::unsure},
        Step{4000.0, "us", Certainty::likely}}) {
    const ColumnGuess clock = clock_for(each.step);
    EXPECT_EQ(clock.unit, each.unit) << each.step;
    EXPECT_EQ(clock.certainty, each.certainty) << each.step;
  }
  EXPECT_THAT(clock_for(0.1).reasons, testing::Contains(HasSubstr("10 Hz in s or 1e+04 Hz in ms")));
}

TEST(MappingDraft, HasTheUsualRateOfALogWithAPause) {
  const MappingDraft draft = draft_of(log_of("t_s,joint_rad,torque_Nm", 800, [](int row) {
    const double t = 0.004 * row + (row >= 500 ? 7.0 : 0.0);
    return fmt::format("{:.3f},{:.5f},{:.5f}", t, std::sin(0.05 * row), 5.0 * std::cos(0.05 * row));
  }));
  EXPECT_NEAR(draft.rate_Hz, 250.0, 0.1);
  // Stamps of 10 ms for rows of 4 ms: their mean.
  const MappingDraft coarse = draft_of(log_of("time_ms,joint_rad,torque_Nm", 400, [](int row) {
    return fmt::format("{},{:.5f},{:.5f}", 10 * (row * 4 / 10), std::sin(0.05 * row),
                       5.0 * std::cos(0.05 * row));
  }));
  EXPECT_NEAR(coarse.rate_Hz, 250.0, 1.0);
}

// The angles show that the torque is right, and that the deflection has the wrong sign.
TEST(MappingDraft, PrefersTheAnglesToADeflectionOfTheWrongSign) {
  const MappingDraft draft =
      draft_of(log_of("t_s,motor_rad,joint_rad,torque_Nm,deflection_rad", 800, [](int row) {
        const test::JointState state = test::joint_at(row);
        const double twist = state.motor_rad / test::kStyleRatio - state.joint_rad;
        return fmt::format("{:.3f},{:.6f},{:.6f},{:.5f},{:.7f}", state.t_s, state.motor_rad,
                           state.joint_rad, state.torque_Nm, -twist);
      }));
  ASSERT_NE(draft.of("torque_Nm"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("torque_Nm")->sign, 1.0) << draft.yaml();
  EXPECT_THAT(draft.of("torque_Nm")->reasons, Not(testing::Contains(HasSubstr("falls with"))));
  ASSERT_NE(draft.of("spring_deflection_rad"), nullptr) << draft.yaml();
  EXPECT_EQ(draft.of("spring_deflection_rad")->sign, -1.0) << draft.yaml();
}

TEST(MappingDraft, ReplacesTheReasonOfAUnitThatTheRatioChanges) {
  // In degrees, of which the range fits radians as well.
  const MappingDraft draft =
      draft_of(log_of("t_s,motor_position,joint_rad,torque_Nm", 800, [](int row) {
        const test::JointState state = test::joint_at(row);
        return fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}", state.t_s,
                           57.29577951 * 50.0 / test::kStyleRatio * state.motor_rad,
                           state.joint_rad, state.torque_Nm);
      }));
  const ColumnGuess* const motor = guess_for(draft, "motor_position");
  EXPECT_EQ(motor->rule(), "gear_angle_rad: {from: motor_position, unit: deg, gear_ratio: 50}");
  EXPECT_EQ(motor->certainty, Certainty::unsure);
  EXPECT_THAT(motor->reasons, AllOf(testing::Contains(HasSubstr("only in deg is the ratio one")),
                                    Not(testing::Contains(HasSubstr("fits radians")))));
}

TEST(MappingDraft, KeepsTheRelationOfTheAnglesForAnAnswerInAnotherUnit) {
  const std::string text = log_of("t_s,motor_rad,joint_rad,torque_Nm", 800, [](int row) {
    const test::JointState state = test::joint_at(row);
    return fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}", state.t_s,
                       300.0 / test::kStyleRatio * state.motor_rad, state.joint_rad,
                       state.torque_Nm);
  });
  const MappingDraft guessed = draft_of(text);
  ASSERT_EQ(guessed.of("gear_angle_rad")->gear_ratio, 300.0) << guessed.yaml();
  MappingDraft motor = guessed;
  answer(motor, 1, "gear_angle_deg");
  ASSERT_NE(motor.of("gear_angle_rad"), nullptr) << motor.yaml();
  EXPECT_NEAR(motor.of("gear_angle_rad")->gear_ratio, 300.0 * M_PI / 180.0, 1e-3);
  MappingDraft both = motor;
  answer(both, 2, "joint_angle_deg");
  EXPECT_NEAR(both.of("gear_angle_rad")->gear_ratio, 300.0, 1e-9) << both.yaml();
  // 300 * 57 is the ratio of no gear.
  MappingDraft joint = guessed;
  answer(joint, 2, "joint_angle_deg");
  EXPECT_EQ(joint.of("gear_angle_rad"), nullptr);
  EXPECT_THAT(joint.yaml(), HasSubstr("check the units of both angles"));
  EXPECT_THAT(joint.yaml(), HasSubstr("gear_ratio: N"));
}

TEST(MappingDraft, HasTheRemarksAndTheRatioOfTheAnswers) {
  MappingDraft draft = draft_of(log_of("t_s,motor_rad,joint_rad,c", 800, [](int row) {
    const test::JointState state = test::joint_at(row);
    return fmt::format("{:.3f},{:.6f},{:.6f},{:.5f}", state.t_s, 80.0 * state.joint_rad,
                       state.joint_rad, state.torque_Nm);
  }));
  EXPECT_THAT(draft.remarks, testing::Contains(HasSubstr("no column is the torque")));
  answer(draft, 3, "torque_Nm");
  EXPECT_THAT(draft.remarks, testing::IsEmpty());
  answer(draft, 2, "-");
  EXPECT_THAT(draft.remarks, testing::ElementsAre(HasSubstr("no deflection")));
  EXPECT_EQ(draft.of("gear_angle_rad"), nullptr) << draft.yaml();
  EXPECT_THAT(draft.yaml(), HasSubstr("that to an angle that is not the joint's"));
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
