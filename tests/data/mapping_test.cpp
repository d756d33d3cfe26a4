#include "torsio/data/mapping.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "data/csv/csv_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

std::vector<Recording> read(const std::string& csv, const std::string& mapping = "{}",
                            double rate_Hz = 0.0) {
  const Mapping rules = parse_mapping(mapping, "map.yaml");
  return measured_recordings(parse_csv(csv, "log.csv", {.skip = rules.drop}), rules, rate_Hz);
}

constexpr double kDeg = std::numbers::pi / 180.0;

TEST(Mapping, WithoutOneTheHeadersAreSufficient) {
  const auto recordings = read("t_ms,angle_deg,torque_mNm\n500,1,10\n502,2,20\n504,3,nan\n");
  ASSERT_EQ(recordings.size(), 1U);
  const Recording& recording = recordings[0];
  EXPECT_EQ(recording.name(), "log");
  EXPECT_EQ(recording.sample_rate_Hz(), 500.0);
  EXPECT_DOUBLE_EQ(recording.time_s(0), 0.5);
  ASSERT_EQ(recording.channels().size(), 2U);
  EXPECT_DOUBLE_EQ(recording.channel("angle_rad").values[2], 3.0 * kDeg);
  EXPECT_DOUBLE_EQ(recording.channel("torque_Nm").values[1], 0.02);
  EXPECT_TRUE(std::isnan(recording.channel("torque_Nm").values[2]));
}

TEST(Mapping, MovesTheValuesOfAColumnThatNothingElseNeeds) {
  LogTable table = parse_csv("t_s,a_rad,b_deg,run_1\n0,1,2,7\n1,2,3,7\n", "log.csv");
  const double* const moved = table.columns[1].values.data();
  const double* const converted = table.columns[2].values.data();
  const Mapping rules = parse_mapping(
      "split_by: run_1\nchannels: {c_rad: a_rad, d_rad: b_deg, e_rad: b_deg, f_1: run_1}",
      "m.yaml");
  const auto recordings = measured_recordings(std::move(table), rules);
  const Recording& recording = recordings.front();
  EXPECT_EQ(recording.channel("c_rad").values.data(), moved);
  EXPECT_NE(recording.channel("d_rad").values.data(), converted);
  EXPECT_EQ(recording.channel("e_rad").values, recording.channel("d_rad").values);
  EXPECT_EQ(recording.channel("f_1").values, (std::vector<double>{7.0, 7.0}));
}

TEST(Mapping, RenamesFlipsScalesAndShifts) {
  const Recording recording = read("stamp,Pos,tau,cur_mA\n0,10,5,100\n1,20,6,200\n", R"(
channels:
  t_s: {from: stamp, unit: ms}
  joint_angle_rad: {from: Pos, unit: deg, sign: -1, offset: 90deg}
  torque_Nm: tau
  motor_torque_Nm: {from: cur_mA, scale: 2.5}
)")[0];
  EXPECT_EQ(recording.sample_rate_Hz(), 1000.0);
  EXPECT_DOUBLE_EQ(recording.channel("joint_angle_rad").values[0], 80.0 * kDeg);
  EXPECT_DOUBLE_EQ(recording.channel("torque_Nm").values[1], 6.0);
  EXPECT_DOUBLE_EQ(recording.channel("motor_torque_Nm").values[1], 0.5);
  EXPECT_FALSE(recording.has("cur_A"));
}

TEST(Mapping, TakesFractionsAndUnitsAsPeopleWriteThem) {
  const Recording recording = read("t_s,motor,speed\n0,300,30\n1,600,60\n", R"(
channels:
  gear_angle_rad: {from: motor, unit: deg, scale: -1/150}
  gear_speed_rad_s: {from: speed, unit: deg/s}
)")[0];
  EXPECT_DOUBLE_EQ(recording.channel("gear_angle_rad").values[1], -4.0 * kDeg);
  EXPECT_DOUBLE_EQ(recording.channel("gear_speed_rad_s").values[0], 30.0 * kDeg);
  for (const char* scale : {"1/0", "1/", "/150", "1/2/3", "one"})
    EXPECT_THROW(
        read("t_s,motor\n0,1\n1,2\n", std::string("channels: {gear_angle_rad: {from: motor, "
                                                  "unit: deg, scale: '") +
                                          scale + "'}}"),
        Error)
        << scale;
}

TEST(Mapping, DropsTextAndSplitsIntoRecords) {
  const auto recordings =
      read("t_s,x_m,run,note\n0,1,7,a\n1,2,7,b\n2,3,8,c\n3,4,8,d\n4,5,7,e\n5,6,7,f\n",
           "{drop: [note], split_by: run}");
  ASSERT_EQ(recordings.size(), 3U);
  EXPECT_EQ(recordings[0].name(), "log[run=7]");
  EXPECT_EQ(recordings[1].name(), "log[run=8]");
  EXPECT_EQ(recordings[2].name(), "log[run=7]#2");
  EXPECT_EQ(recordings[1].channel("x_m").values, (std::vector<double>{3.0, 4.0}));
  EXPECT_EQ(recordings[1].time_s(0), 2.0);
  const auto kept = read("t_s,x_m,run\n0,1,7\n1,2,7\n2,3,8\n3,4,8\n", "{split_by: run, keep: [8]}");
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(kept[0].name(), "log[run=8]");
}

TEST(MappingText, ReadsBackToTheSameMapping) {
  const std::string yaml = R"(
channels:
  t_s: {from: stamp, unit: ms}
  joint_angle_deg: {from: "Pos: [raw], 'x'", unit: deg, sign: -1, offset: 90deg}
  gear_angle_rad: {from: "#motor", unit: deg, scale: 1/150}
  torque_Nm: "true"
drop: [note, "~"]
missing: ["-999", bad]
skip_lines: 3
split_by: run
keep: [8]
clock: {rebuild: true, max_stray_steps: 3, format: "%H:%M:%S"}
rate: 2kHz
zero:
  - {channel: joint_angle_rad, first: 0.1s}
  - {channel: gear_angle_rad, mid_range: true}
hold: [torque_Nm]
latency: {torque_Nm: 2ms}
uncertainty: {torque_Nm: {class: 0.3%, range: 57000mNm, gain: 0.57%, mounting: 0.3%, zero: 0.1Nm}}
derive: {spring_deflection_rad: "gear_angle_rad - joint_angle_rad"}
computed_from: {torque_Nm: [iq_A]}
)";
  const Mapping mapping = parse_mapping(yaml, "map.yaml");
  const std::string text = mapping_text(mapping);
  const Mapping again = parse_mapping(text, "card");
  EXPECT_EQ(mapping_text(again), text);
  ASSERT_EQ(again.channels.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(again.channels[i].name, mapping.channels[i].name);
    EXPECT_EQ(again.channels[i].from, mapping.channels[i].from);
    EXPECT_EQ(again.channels[i].unit, mapping.channels[i].unit);
    EXPECT_EQ(again.channels[i].sign, mapping.channels[i].sign);
    EXPECT_EQ(again.channels[i].scale, mapping.channels[i].scale);
    EXPECT_EQ(again.channels[i].offset, mapping.channels[i].offset);
  }
  EXPECT_EQ(again.drop, mapping.drop);
  EXPECT_EQ(again.missing, mapping.missing);
  EXPECT_EQ(again.skip_lines, 3U);
  EXPECT_EQ(again.clock.format, "%H:%M:%S");
  EXPECT_EQ(again.split_by, "run");
  EXPECT_EQ(again.keep, std::vector<double>{}) << "which records of one log were used";
  EXPECT_TRUE(again.clock.rebuild);
  EXPECT_EQ(again.clock.max_stray_steps, 3.0);
  EXPECT_EQ(again.rate_Hz, 2000.0);
  EXPECT_EQ(again.zero, mapping.zero);
  EXPECT_EQ(again.hold, mapping.hold);
  EXPECT_EQ(again.latency.at(0).latency_s, 0.002);
  ASSERT_EQ(again.uncertainty.size(), 1U);
  EXPECT_EQ(again.uncertainty.at(0).combined(), mapping.uncertainty.at(0).combined());
  EXPECT_EQ(again.derive, mapping.derive);
  EXPECT_EQ(again.computed_from, mapping.computed_from);
  EXPECT_EQ(mapping_text(Mapping{}), "");
  EXPECT_EQ(mapping_text(parse_mapping("{clock: {resample: 400Hz}}", "m")),
            "clock: {resample: 400}\n");
}

TEST(Mapping, KeepsTheRulesOfGapsAndCodings) {
  const std::string text =
      "channels:\n  torque_Nm: {from: raw, modulus: 65536}\n"
      "decimal: comma\nclock: {resample: 100, max_gap: 0.5, split_at_gaps: 2, sort: true}\n";
  EXPECT_EQ(mapping_text(parse_mapping(text, "m")), text);
}

TEST(Mapping, DecodesNumbersBeforeTheirUnit) {
  const std::string csv = "t_s,raw\n0,1\n1,65535\n2,65534\n3,2\n";
  const auto values = [&](const std::string& coding) {
    return read(csv, "channels: {torque_Nm: {from: raw, unit: Nm, scale: 0.5, " + coding + "}}")[0]
        .channel("torque_Nm")
        .values;
  };
  EXPECT_EQ(values("modulus: 65536"), (std::vector{0.5, -0.5, -1.0, 1.0}));
  EXPECT_EQ(values("unwrap: 65536"), (std::vector{0.5, -0.5, -1.0, 1.0}));
  EXPECT_EQ(values("sign_bit: 32768"), (std::vector{0.5, -16383.5, -16383.0, 1.0}));
}

TEST(Mapping, AMaskIsOneWhereverItComesFrom) {
  const std::string csv = "t_s,torque_Nm,neu\n0,1,1\n1,1,0\n2,3,1\n3,3,0\n";
  const std::vector<std::uint8_t> marks{1, 0, 1, 0};
  EXPECT_EQ(read(csv, "channels: {torque_fresh_1: neu}")[0].channel("torque_Nm").fresh, marks);
  Recording derived = read(csv, "channels: {neu_1: neu}")[0];
  add_derived(derived, {{"torque_fresh_1", "neu_1"}});
  EXPECT_EQ(derived.channel("torque_Nm").fresh, marks);
  EXPECT_THROW(add_derived(derived, {{"torque_fresh_1", "2 * neu_1"}}), Error);
  EXPECT_EQ(read(csv, "{drop: [neu], hold: [torque_Nm]}")[0].channel("torque_Nm").fresh, marks);
}

TEST(Mapping, SplitsALogAtGapsAndAtANewBeginning) {
  const std::string csv = "t_s,x_m\n0,1\n1,2\n2,3\n9,4\n10,5\n3,6\n4,7\n5,8\n";
  const std::vector<Recording> parts = read(csv, "clock: {split_at_gaps: 5s}");
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[1].channel("x_m").values, (std::vector{4.0, 5.0}));
  EXPECT_EQ(parts[1].time_s(0), 9.0);
  EXPECT_EQ(parts[2].size(), 3U);
}

TEST(Mapping, UsesThePartOfALogBetweenFromAndTo) {
  const std::string csv = "t_s,x_m\n100,1\n101,2\n102,3\n103,4\n";
  EXPECT_EQ(read(csv, "{from: 1s, to: 2s}")[0].channel("x_m").values, (std::vector{2.0, 3.0}));
  EXPECT_THROW((void)read(csv, "from: 50s"), Error);
  EXPECT_EQ(read("x_m\n1\n2\n3\n", "{rate: 1Hz, from: 1s}")[0].size(), 2U);
  EXPECT_NE(
      test::error_message([&] { (void)read("x_m\n1\n2\n", "from: 1s"); }).find("has no clock"),
      std::string::npos);
}

TEST(Mapping, UnwrapsTheCounterOfAClock) {
  const std::string csv = "t_us,x_m\n4294957296,1\n4294967295,2\n9999,3\n19999,4\n";
  const Recording recording = read(csv, "channels: {t_s: {from: t_us, unwrap: 4294967296}}")[0];
  EXPECT_NEAR(recording.sample_rate_Hz(), 100.0, 1.0);
  EXPECT_EQ(recording.size(), 4U);
}

/// Rows of 100 Hz with the number of the row as value, in this order.
std::string log_of_rows(const std::vector<int>& rows, const std::vector<double>& shift_s = {}) {
  std::string csv = "t_s,x_m\n";
  for (const int row : rows)
    csv += fmt::format(
        "{:.4f},{}\n",
        0.01 * row + (shift_s.empty() ? 0.0 : shift_s[static_cast<std::size_t>(row)]), row);
  return csv;
}

std::vector<int> rows_in_order(int count) {
  std::vector<int> rows(static_cast<std::size_t>(count));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

void move_row(std::vector<int>& rows, std::size_t from, std::size_t later) {
  const int row = rows[from];
  rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(from));
  rows.insert(rows.begin() + static_cast<std::ptrdiff_t>(from + later), row);
}

TEST(Mapping, RowsThatComeLateAreSortedAndThoseThatComeTwiceReadOnce) {
  std::vector<int> rows = rows_in_order(300);
  move_row(rows, 20, 6);
  move_row(rows, 100, 1);
  move_row(rows, 250, 49);
  rows.insert(rows.begin() + 60, 58);
  for (const char* mapping :
       {"{}", "clock: {rebuild: true}", "clock: {resample: 100Hz}", "clock: {split_at_gaps: 1s}"}) {
    const std::vector<Recording> recordings = read(log_of_rows(rows), mapping);
    ASSERT_EQ(recordings.size(), 1U) << mapping;
    ASSERT_EQ(recordings[0].size(), 300U) << mapping;
    EXPECT_NEAR(recordings[0].sample_rate_Hz(), 100.0, 1e-9);
    for (std::size_t i = 0; i < 300; ++i)
      EXPECT_NEAR(recordings[0].channels()[0].values[i], static_cast<double>(i), 1e-9);
    ASSERT_EQ(recordings[0].notes.size(), 2U);
    EXPECT_NE(recordings[0].notes[0].find("4 rows come late, by up to 49 rows"), std::string::npos)
        << recordings[0].notes[0];
    EXPECT_NE(recordings[0].notes[1].find("1 row that repeats another"), std::string::npos);
  }
}

TEST(Mapping, LateRowsOfEachRecordAreSorted) {
  const Recording recording =
      read("run,t_s,x_m\n1,0,0\n1,1,1\n1,2,2\n1,4,4\n1,3,3\n2,0,0\n2,1,1\n2,2,2\n",
           "{split_by: run, keep: [1]}")[0];
  EXPECT_EQ(recording.channel("x_m").values, (std::vector{0.0, 1.0, 2.0, 3.0, 4.0}));
}

TEST(Mapping, TheLineOfALateRowIsThatOfTheFile) {
  std::vector<int> rows = rows_in_order(50);
  move_row(rows, 20, 5);
  rows.erase(rows.begin() + 40);
  const std::string message = test::error_message([&] { (void)read(log_of_rows(rows)); });
  EXPECT_NE(message.find("line 42, column 1 (t_s): 1 sample is missing"), std::string::npos)
      << message;
}

TEST(Mapping, EveryAdviceOnRowsInAnotherOrderLeadsToARecording) {
  std::vector<int> late = rows_in_order(300);
  for (std::size_t row = 10; row < 280; row += 9) move_row(late, row, 6);
  std::vector<int> twice = rows_in_order(300);
  for (std::size_t row = 280; row > 10; row -= 9)
    twice.insert(twice.begin() + static_cast<std::ptrdiff_t>(row), twice[row]);
  std::vector<double> jitter_s;
  for (int i = 0; i < 300; ++i) jitter_s.push_back(0.004 * std::sin(1.7 * i));
  for (const std::vector<int>& rows : {late, twice}) {
    const std::string csv = log_of_rows(rows, jitter_s);
    std::vector<std::string> mappings{"{}"};
    std::size_t read_logs = 0;
    for (std::size_t k = 0; k < mappings.size(); ++k) {
      ASSERT_LT(k, 12U) << "circle of advice: " << mappings[k];
      const std::string message = test::error_message([&] { (void)read(csv, mappings[k]); });
      EXPECT_EQ(message.find("begins again"), std::string::npos) << message;
      EXPECT_EQ(message.find("starts again"), std::string::npos) << message;
      if (message.empty()) ++read_logs;
      for (std::size_t at = message.find("clock: {"); at != std::string::npos;
           at = message.find("clock: {", at + 1))
        mappings.push_back(message.substr(at, message.find('}', at) + 1 - at));
      if (message.find("drop: [t_s]") != std::string::npos)
        mappings.push_back("{drop: [t_s], rate: 100Hz}");
      if (message.find("rate: ") != std::string::npos) {
        EXPECT_NE(message.find("rate: 100Hz"), std::string::npos) << message;
      }
    }
    EXPECT_GT(read_logs, 1U);
  }
}

TEST(Mapping, RowsOfSeveralJointsAreNotReadAsOne) {
  std::string joints = "t_s,x_m\n";
  std::string coarse = joints;
  for (int i = 0; i < 100; ++i) {
    joints +=
        fmt::format("{0},{1:.5f}\n{0},{2:.5f}\n", 0.01 * i, std::sin(0.1 * i), 5.0 - 0.01 * i);
    coarse += fmt::format("{0},{1:.5f}\n{0},{2:.5f}\n", 0.01 * i, std::sin(0.1 * i),
                          std::sin(0.1 * i + 0.05));
  }
  for (const char* mapping : {"{}", "clock: {rebuild: true}", "clock: {resample: 100Hz}"}) {
    const std::string message = test::error_message([&] { (void)read(joints, mapping); });
    EXPECT_NE(message.find("the rows of 2 joints alternate"), std::string::npos) << message;
  }
  EXPECT_EQ(read(coarse, "clock: {rebuild: true}")[0].size(), 200U);
}

TEST(Mapping, ACounterThatOverflowsAndASecondLogAreNamedWhereTheyAre) {
  std::string counter = "t_us,x_m\n";
  for (int i = 0; i < 300; ++i) counter += fmt::format("{},{}\n", (i * 1000) % 65536, i);
  const std::string overflow = test::error_message([&] { (void)read(counter); });
  EXPECT_NE(overflow.find("begins again after 2^16"), std::string::npos) << overflow;
  EXPECT_EQ(read(counter, "channels: {t_s: {from: t_us, unwrap: 65536}}")[0].size(), 300U);
  const std::string log = log_of_rows(rows_in_order(200));
  const std::string restart =
      test::error_message([&] { (void)read(log + log.substr(log.find('\n') + 1)); });
  EXPECT_NE(restart.find("line 202"), std::string::npos) << restart;
  EXPECT_NE(restart.find("the clock starts again"), std::string::npos) << restart;
  EXPECT_EQ(read(log + log.substr(log.find('\n') + 1), "clock: {split_at_gaps: 0.05s}").size(), 2U);
}

TEST(Mapping, ALogWithoutAClockTakesTheGivenRate) {
  EXPECT_EQ(read("x_m\n1\n2\n", "rate: 2kHz")[0].sample_rate_Hz(), 2000.0);
  EXPECT_EQ(read("x_m\n1\n2\n", "{}", 50.0)[0].sample_rate_Hz(), 50.0);
  EXPECT_EQ(read("x_m\n1\n", "{}", 50.0)[0].size(), 1U);
}

TEST(Mapping, RebuildsAClockWithCoarseStamps) {
  std::string csv = "t_s,x_m\n";
  for (int i = 0; i < 101; ++i)
    csv += std::to_string(i / 10 * 10) + "e-3," + std::to_string(i) + "\n";
  const Recording recording = read(csv, "clock: {rebuild: true}")[0];
  EXPECT_NEAR(recording.sample_rate_Hz(), 1000.0, 1e-6);
  EXPECT_EQ(recording.size(), 101U);
}

TEST(Mapping, ResamplesUnevenStampsWhereTheyAre) {
  const Recording recording =
      read("t_s,x_m\n0,0\n0.1,1\n0.3,3\n0.4,4\n0.8,8\n", "clock: {resample: 10Hz}")[0];
  ASSERT_EQ(recording.size(), 9U);
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(recording.channels()[0].values[i], static_cast<double>(i), 1e-12);
}

TEST(Mapping, ResamplingSpreadsSamplesThatShareAStamp) {
  const Recording recording =
      read("t_s,x_m\n0,0\n0,1\n0.2,2\n0.2,3\n0.4,4\n0.4,5\n", "clock: {resample: 10Hz}")[0];
  EXPECT_EQ(recording.size(), 6U);
  for (std::size_t i = 0; i < recording.size(); ++i)
    EXPECT_NEAR(recording.channels()[0].values[i], static_cast<double>(i), 1e-12);
}

TEST(Mapping, HoldsASlowSensorAndMarksItsSamples) {
  const Channel torque =
      read("t_s,torque_Nm\n1,5\n2,\n3,\n4,7\n", "hold: [torque_Nm]")[0].channel("torque_Nm");
  EXPECT_EQ(torque.values, (std::vector<double>{5, 5, 5, 7}));
  EXPECT_EQ(torque.fresh, (std::vector<std::uint8_t>{1, 0, 0, 1}));
}

TEST(Mapping, HoldingBeginsWhereEveryHeldChannelHasAValue) {
  const Recording recording = read("t_s,q_rad,torque_Nm,x_1\n0,1,,0\n1,,,1\n2,,5,2\n3,2,,3\n",
                                   "hold: [q_rad, torque_Nm]")[0];
  EXPECT_EQ(recording.time_s(0), 2.0);
  EXPECT_EQ(recording.channel("q_rad").values, (std::vector<double>{1, 2}));
  EXPECT_EQ(recording.channel("q_rad").fresh, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(recording.channel("torque_Nm").values, (std::vector<double>{5, 5}));
  EXPECT_EQ(recording.channel("x_1").values, (std::vector<double>{2, 3}));
  EXPECT_EQ(recording.notes.size(), 1U);
  const auto runs = read("t_s,run,torque_Nm\n0,1,4\n1,1,\n2,2,\n3,2,5\n4,2,6\n",
                         "{split_by: run, hold: [torque_Nm]}");
  EXPECT_EQ(runs[0].size(), 2U);
  EXPECT_EQ(runs[1].channel("torque_Nm").values, (std::vector<double>{5, 6}));
  const std::string message =
      test::error_message([&] { (void)read("t_s,torque_Nm\n0,\n1,\n", "hold: [torque_Nm]"); });
  EXPECT_NE(message.find("nothing was measured in log"), std::string::npos) << message;
}

TEST(Mapping, ReadsUnitsAsPeopleWriteThem) {
  const auto converted = [](const std::string& channel, const std::string& unit) {
    const std::string si = channel.substr(0, channel.find(':'));
    return read("t_s,x\n0,1\n1,1\n", "channels: {" + si + ": {from: x, unit: " + unit + "}}")[0]
        .channel(si)
        .values[0];
  };
  for (const char* const deg : {"\"(deg)\"", "[deg]", "\"\u00b0\"", "_deg", "Deg", "degrees"})
    EXPECT_NEAR(converted("joint_angle_rad", deg), 0.0174533, 1e-6) << deg;
  for (const char* const torque : {"N\u00b7m", "N.m", "\"N m\"", "\"[Nm]\"", "N-m"})
    EXPECT_EQ(converted("torque_Nm", torque), 1.0) << torque;
  EXPECT_EQ(converted("state_1", "_1"), 1.0);
  EXPECT_NEAR(converted("joint_speed_rad_s", "RPM"), 0.1047198, 1e-6);
}

TEST(Mapping, ReadsUnitsOfOtherLanguages) {
  const auto converted = [](const std::string& channel, const std::string& unit) {
    return read("t_s,x\n0,1\n1,1\n",
                "channels: {" + channel + ": {from: x, unit: \"" + unit + "\"}}")[0]
        .channel(channel)
        .values[0];
  };
  for (const char* const deg : {"Grad", "[Grad]", "degrés", "grados", "gradi", "º", "Stopnie"})
    EXPECT_NEAR(converted("joint_angle_rad", deg), 0.0174533, 1e-6) << deg;
  for (const char* const rpm :
       {"U/min", "Umdr/min", "tr/min", "giri/min", "obr/min", "min-1", "min⁻¹", "1/min", "min^-1"})
    EXPECT_NEAR(converted("motor_speed_rad_s", rpm), 0.1047198, 1e-6) << rpm;
  for (const char* const rate : {"Grad/s", "°/s", "grados/s"})
    EXPECT_NEAR(converted("joint_speed_rad_s", rate), 0.0174533, 1e-6) << rate;
  EXPECT_NEAR(converted("joint_angle_rad", "Umdrehungen"), 6.2831853, 1e-6);
  EXPECT_EQ(converted("torque_Nm", "N⋅m"), 1.0);
}

TEST(Mapping, ProposesNoUnitOfAnotherSize) {
  const auto refusal = [](const std::string& channel, const std::string& unit) {
    return test::error_message([&] {
      (void)read("t_s,x\n0,1\n1,1\n", "channels: {" + channel + ": {from: x, unit: " + unit + "}}");
    });
  };
  // Gradians and degrees: the two lines of the answer are read.
  const std::string grad = refusal("joint_angle_rad", "grad");
  EXPECT_THAT(grad, testing::HasSubstr("unit: deg  or gon"));
  EXPECT_THAT(grad, testing::HasSubstr("unit: rev, scale: 1/400"));
  EXPECT_THAT(refusal("joint_angle_rad", "gon"), testing::HasSubstr("scale: 1/400"));
  EXPECT_NEAR(read("t_s,x\n0,100\n1,1\n",
                   "channels: {joint_angle_rad: {from: x, unit: rev, scale: 1/400}}")[0]
                  .channel("joint_angle_rad")
                  .values[0],
              1.5707963, 1e-6);
  for (const char* const unit : {"Gard", "dag", "mrd", "radd", "MRAD"}) {
    const std::string message = refusal("joint_angle_rad", unit);
    EXPECT_THAT(message, testing::Not(testing::HasSubstr("Did you mean"))) << unit;
    EXPECT_THAT(message, testing::HasSubstr("Units of rad: rad, mrad, urad, deg, rev")) << unit;
  }
  EXPECT_THAT(refusal("torque_Nm", "MNM"), testing::Not(testing::HasSubstr("Did you mean")));
  EXPECT_THAT(refusal("torque_Nm", "mnm"), testing::HasSubstr("Did you mean 'mNm'?"));
  for (const char* const counts : {"Inc", "Ink", "Ink.", "Inkremente", "Impulse", "counts"})
    EXPECT_THAT(refusal("gear_angle_rad", counts), testing::HasSubstr("scale: 1/COUNTS")) << counts;
}

TEST(Mapping, RemarksOnAnUnknownWordInTheRowOfUnitsWhereItStatesNoUnit) {
  const auto notes = [](const std::string& rule) {
    const LogTable table = parse_csv("t,x\nms,Inc\n0,1\n1,1\n", "log.csv", {.wanted = {"t", "x"}});
    const std::vector<std::string> all =
        measured_recordings(
            table, parse_mapping("channels: {t_s: {from: t}, q_rad: " + rule + "}", "m.yaml"))
            .front()
            .notes;
    return std::ranges::count_if(
        all, [](const std::string& note) { return note.find("'Inc'") != std::string::npos; });
  };
  EXPECT_EQ(notes("{from: x}"), 1);
  EXPECT_EQ(notes("{from: x, unit: rev, scale: 1/4096}"), 0);
}

TEST(Mapping, StatesWhatToWriteForAWordOfADraftThatWasLeft) {
  const auto refusal = [](const std::string& rest) {
    return test::error_message([&] {
      (void)read("t_s,x\n0,1\n1,1\n",
                 "channels: {gear_angle_rad: {from: x, unit: rev, " + rest + "}}");
    });
  };
  EXPECT_THAT(refusal("scale: 1/COUNTS, gear_ratio: 80"),
              testing::AllOf(testing::HasSubstr("channels.gear_angle_rad.scale"),
                             testing::HasSubstr("found '1/COUNTS'"),
                             testing::HasSubstr("Write the counts of one turn of the encoder")));
  EXPECT_THAT(refusal("scale: FACTOR"), testing::HasSubstr("scale: 0.001"));
  EXPECT_THAT(refusal("scale: 1/4096, gear_ratio: N"), testing::HasSubstr("gear_ratio: 80"));
  EXPECT_NEAR(
      read("t_s,x\n0,4096\n1,1\n",
           "channels: {gear_angle_rad: {from: x, unit: rev, scale: 1/4096, gear_ratio: 80}}")[0]
          .channel("gear_angle_rad")
          .values[0],
      6.2831853 / 80.0, 1e-9);
}

TEST(Mapping, AnswersUnitsThatItDoesNotReadBeforeItListsTheOthers) {
  const auto refusal = [](const std::string& channel, const std::string& unit) {
    return test::error_message([&] {
      (void)read("t_s,x\n0,1\n1,1\n", "channels: {" + channel + ": {from: x, unit: " + unit + "}}");
    });
  };
  EXPECT_NE(refusal("joint_angle_rad", "counts").find("unit: rev, scale: 1/COUNTS"),
            std::string::npos);
  const std::string torque = refusal("torque_Nm", "nm");
  const std::size_t answer = torque.find("Did you mean 'Nm'?");
  ASSERT_NE(answer, std::string::npos) << torque;
  EXPECT_LT(answer, torque.find("_pct")) << torque;
  EXPECT_NE(refusal("torque_Nm", "\"\"").find("expected text"), std::string::npos);
}

TEST(Mapping, WithoutUnitsProposesARuleForEachColumnBeforeTheListOfUnits) {
  const std::string message =
      test::error_message([&] { (void)read("t,torque,enc [counts]\n0,1,2\n1,2,3\n"); });
  const std::size_t units = message.find("_pct");
  ASSERT_NE(units, std::string::npos) << message;
  for (const char* const line :
       {"3 columns have no unit: t, torque, enc [counts]", "torque_Nm: {from: torque, unit: Nm}",
        "enc_rad: {from: \"enc [counts]\", unit: rev, scale: 1/COUNTS}", "torsio map log"})
    EXPECT_LT(message.find(line), units) << line << "\n" << message;
}

TEST(Mapping, OfChannelsLeavesOutColumnsWithoutAUnitThatItDoesNotName) {
  const Recording recording =
      read("t_s,tau,state,adc0,q_rad\n0,1,2,3,4\n1,2,3,4,5\n", "channels: {torque_Nm: tau}")[0];
  ASSERT_EQ(recording.channels().size(), 2U);
  EXPECT_EQ(recording.channel("q_rad").values[1], 5.0);  // has a unit
  EXPECT_EQ(recording.notes,
            std::vector<std::string>{"columns without a unit that the mapping does not name are "
                                     "not read: state, adc0"});
}

TEST(Mapping, WithoutChannelsColumnsWithoutAUnitAreAnErrorThatNamesAll) {
  std::string header = "t_s";
  for (int i = 0; i < 12; ++i) header += ",adc" + std::to_string(i);
  const std::string row = ",5,5,5,5,5,5,5,5,5,5,5,5\n";
  const std::string log = header + ",torque_Nm\n0,5" + row + "1,5" + row;
  const std::string message = test::error_message([&] { (void)read(log); });
  EXPECT_NE(message.find("12 columns have no unit"), std::string::npos) << message;
  const std::string advice = "drop: [\"adc*\"]";
  ASSERT_NE(message.find(advice), std::string::npos) << message;
  EXPECT_EQ(read(log, advice)[0].channels().size(), 1U);
}

TEST(Mapping, AColumnToDropMayBeMissing) {
  const std::string log = "t_s,i_1,torque_Nm\n0,1,2\n1,2,3\n";
  EXPECT_EQ(read(log, "drop: [note, '', 'x*']")[0].notes.size(), 0U);
  EXPECT_EQ(
      read(log, "drop: [torqe_Nm]")[0].notes,
      std::vector<std::string>{"there is no column 'torqe_Nm' to drop. Did you mean 'torque_Nm'?"});
  LogTable table = parse_csv(log, "log.csv");  // columns of other formats are dropped, too
  EXPECT_FALSE(measured_recordings(table, parse_mapping("drop: [i_1]", "m"))[0].has("i_1"));
}

TEST(Mapping, ADateIsTheClockOfALogWithoutAnotherOne) {
  const std::string rows = "2024-03-01T00:00:00.0Z,1\n2024-03-01T00:00:00.5Z,2\n";
  const Recording recording = read("stamp,torque_Nm\n" + rows)[0];
  EXPECT_EQ(recording.sample_rate_Hz(), 2.0);
  EXPECT_EQ(recording.notes, std::vector<std::string>{"the times in 'stamp' are the clock"});
  for (const char* mapping :
       {"channels: {torque_Nm: tau}", "channels: {torque_Nm: tau, t_s: stamp}",
        "channels: {t_s: {from: stamp, unit: ms}, torque_Nm: tau}"})
    EXPECT_EQ(read("stamp,tau\n" + rows, mapping)[0].sample_rate_Hz(), 2.0) << mapping;
  EXPECT_EQ(read("time_s,torque_Nm\n" + rows)[0].sample_rate_Hz(), 2.0);
  const Recording by_rate = read("stamp,torque_Nm\n" + rows, "rate: 100Hz")[0];
  EXPECT_EQ(by_rate.sample_rate_Hz(), 100.0);
  EXPECT_EQ(by_rate.notes,
            std::vector<std::string>{"the times in 'stamp' are not read: the mapping has a rate"});
  EXPECT_EQ(read("stamp,t_s,torque_Nm\n2024-03-01,0,1\n2024-03-01,1,2\n")[0].sample_rate_Hz(), 1.0);
}

TEST(Mapping, ARowOfUnitsIsAsGoodAsUnitsInTheNames) {
  const std::string log = "Zeit;Winkel;Moment\ns;\xc2\xb0;mNm\n0,0;90;1500\n0,5;180;2500\n";
  const Recording recording = read(log)[0];
  EXPECT_EQ(recording.sample_rate_Hz(), 2.0);
  EXPECT_DOUBLE_EQ(recording.channel("Winkel_rad").values[0], 90.0 * kDeg);
  EXPECT_DOUBLE_EQ(recording.channel("Moment_Nm").values[1], 2.5);
  EXPECT_DOUBLE_EQ(read(log, "channels: {torque_Nm: Moment}")[0].channel("torque_Nm").values[0],
                   1.5);
  const std::string conflict = "t_s,a_1\nms,-\n0,1\n500,2\n";
  const std::string message = test::error_message([&] { (void)read(conflict); });
  const std::string advice = "channels: {t_s: {from: t_s, unit: ms}}";
  ASSERT_NE(message.find(advice), std::string::npos) << message;
  EXPECT_EQ(read(conflict, advice)[0].sample_rate_Hz(), 2.0);
}

TEST(Mapping, UnitsInBracketsAreAsGoodAsUnitsInTheNames) {
  const std::string log = "Time [ms],Motor torque [mNm]\n0,1500\n500,2500\n";
  const Recording recording = read(log)[0];
  EXPECT_EQ(recording.sample_rate_Hz(), 2.0);
  EXPECT_DOUBLE_EQ(recording.channel("Motor_torque_Nm").values[1], 2.5);
  const std::string rule = "channels: {torque_Nm: \"Motor torque [mNm]\"}";
  EXPECT_DOUBLE_EQ(read(log, rule)[0].channel("torque_Nm").values[0], 1.5);
  const std::string conflict = "t_s,a [mNm]\ns,Nm\n0,1\n1,2\n";
  EXPECT_NE(test::error_message([&] { (void)read(conflict); }).find("ends in mNm, but the row"),
            std::string::npos);
}

TEST(Mapping, OfALogWithoutAClockTheLikelyOneIsNamed) {
  const auto refused = [&](const std::string& log) {
    return test::error_message([&] { (void)read(log); });
  };
  EXPECT_NE(refused("sent,got,torque_Nm\n2024-03-01T00:00:00,2024-03-01T00:00:01,1\n")
                .find("channels: {t_s: sent}"),
            std::string::npos);
  EXPECT_NE(refused("time_start_s,torque_Nm\n0,1\n")
                .find("channels: {t_s: {from: time_start_s, unit: UNIT}}"),
            std::string::npos);
}

TEST(Mapping, AFreshnessColumnFollowsItsChannelThroughARenaming) {
  const Recording recording =
      read("t_s,load_Nm,load_fresh_1\n0,1,1\n1,1,0\n2,2,1\n", "channels: {torque_Nm: load_Nm}")[0];
  EXPECT_EQ(recording.channels().size(), 1U);
  EXPECT_EQ(recording.channel("torque_Nm").fresh, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST(Mapping, CompensatesALatencyByWholeSamples) {
  const Recording recording =
      read("t_s,torque_Nm\n0,1\n0.01,2\n0.02,3\n0.03,4\n", "latency: {torque_Nm: 21ms}")[0];
  const auto& values = recording.channel("torque_Nm").values;
  EXPECT_EQ(values[0], 3.0);
  EXPECT_EQ(values[1], 4.0);
  EXPECT_TRUE(std::isnan(values[2]));
}

TEST(Mapping, OfAColumnThatALogDoesNotHaveNamesTheDraft) {
  EXPECT_THAT(test::error_message([] {
                (void)read("t_s,tau\n0,1\n1,2\n", "channels: {torque_Nm: {from: tua, unit: Nm}}");
              }),
              testing::AllOf(testing::HasSubstr("has no column 'tua'"),
                             testing::HasSubstr("Did you mean 'tau'?\n  A draft"),
                             testing::HasSubstr("torsio map log.csv -o mapping.yaml")));
}

TEST(Mapping, StatesTheUncertaintyOfASensor) {
  const Recording recording =
      read("t_s,torque_Nm\n0,1\n0.01,2\n",
           "uncertainty: {torque_mNm: {class: 0.2%, range: 100Nm, gain: 0.3%, mounting: 0.4 %, "
           "zero: 50mNm}}")[0];
  const SensorUncertainty& sensor = recording.uncertainties.at("torque_Nm");
  // A limit of 0.2 Nm, all values within it equally likely.
  EXPECT_DOUBLE_EQ(sensor.constant, std::hypot(0.2 / std::numbers::sqrt3, 0.05));
  EXPECT_DOUBLE_EQ(sensor.relative, 0.005);
  EXPECT_EQ(
      read("t_s,a_m\n0,1\n1,2\n", "uncertainty: {a_m: {gain: 1%}}")[0].uncertainties.at("a_m"),
      (SensorUncertainty{.constant = 0.0, .relative = 0.01}));
  EXPECT_EQ(recording.part(0, 1).uncertainties.size(), 1U);
}

TEST(Mapping, RefusesUncertaintiesThatMeanNothing) {
  const auto message = [](const std::string& entries) {
    return test::error_message(
        [&] { (void)parse_mapping("uncertainty: {torque_Nm: {" + entries + "}}", "m.yaml"); });
  };
  using testing::HasSubstr;
  EXPECT_THAT(message("class: 0.2%"), HasSubstr("the range of the sensor beside it"));
  EXPECT_THAT(message("class: 0.2%"), HasSubstr("class: 0.2%, range: 100Nm"));
  EXPECT_THAT(message("range: 100Nm, gain: 1%"), HasSubstr("class: beside range:"));
  EXPECT_THAT(message("class: 0.2, range: 100Nm"),
              HasSubstr("Write 0.2% for 0.2 percent of the range, or 20% for 0.2 of it."));
  EXPECT_THAT(message("class: CLASS, range: RANGE"), HasSubstr("found 'CLASS'"));
  EXPECT_THAT(message("class: CLASS, range: RANGE"), testing::Not(HasSubstr("CLASS%")));
  EXPECT_THAT(message("gain: 0.005"),
              HasSubstr("Write 0.005% for 0.005 percent of the reading, or 0.5% for 0.005 of it."));
  EXPECT_THAT(message("class: 0.2%, range: 0Nm"), HasSubstr("expected a range above 0"));
  EXPECT_THAT(message("zero: nan"), testing::Not(HasSubstr("nanNm")));
  EXPECT_THAT(message("gain: 0.5Nm"), HasSubstr("a share of the reading in %"));
  EXPECT_THAT(message("gain: -1%"), HasSubstr("from 0% to below 100%"));
  EXPECT_THAT(message("gain: 100%"), HasSubstr("from 0% to below 100%"));
  EXPECT_THAT(message("gain: nan%"), HasSubstr("m.yaml: line 1 (uncertainty.torque_Nm.gain)"));
  EXPECT_THAT(message("zero: 0.1"), HasSubstr("Write 0.1Nm"));
  EXPECT_THAT(message("zero: 0.1N"), HasSubstr("uncertainty.torque_Nm.zero"));
  EXPECT_THAT(message("zero: -0.1Nm"), HasSubstr("not negative"));
  EXPECT_THAT(message("zero: 1e300Nm"), HasSubstr("at most 1e+12 Nm"));
  EXPECT_THAT(message("mountign: 1%"), HasSubstr("Did you mean 'mounting'?"));
  EXPECT_THAT(message(""), HasSubstr("a number above 0 for class:"));
  EXPECT_THAT(message("gain: 0%"), HasSubstr("a number above 0 for class:"));
  EXPECT_THAT(test::error_message([] {
                (void)parse_mapping("uncertainty: {class: 0.2%, range: 100Nm}", "m.yaml");
              }),
              testing::AllOf(HasSubstr("the channel of the sensor is missing"),
                             HasSubstr("uncertainty: {torque_Nm: {class: 0.2%, range: 100Nm}}")));
  EXPECT_THAT(test::error_message([] {
                (void)parse_mapping("uncertainty: {torque_Nm: {gain: 1%}, torque_mNm: {gain: 2%}}",
                                    "m.yaml");
              }),
              HasSubstr("the uncertainty of torque_Nm is given twice"));
  EXPECT_THAT(test::error_message(
                  [] { (void)parse_mapping("uncertainty: {torque: {gain: 1%}}", "m.yaml"); }),
              HasSubstr("a channel name that ends in a unit"));
}

TEST(Mapping, RefusesALatencyLongerThanTheRecord) {
  for (const char* latency : {"1e300s", "50ms"})
    EXPECT_THROW(static_cast<void>(read("t_s,torque_Nm\n0,1\n0.01,2\n0.02,3\n0.03,4\n",
                                        std::string("latency: {torque_Nm: ") + latency + "}")),
                 Error)
        << latency;
}

TEST(Mapping, RefusesAResamplingThatFillsTheMemory) {
  // 2^28 numbers are the limit for all channels together.
  EXPECT_THROW(static_cast<void>(read("t_s,a_m,b_m,c_m\n0,0,0,0\n0.9,1,1,1\n2,3,3,3\n",
                                      "clock: {resample: 50000kHz}")),
               Error);
}

TEST(Mapping, TakesZerosFromTheStartOrTheMiddle) {
  const std::string csv = "t_s,a_rad,b_rad\n0,1,1\n1,3,3\n2,9,9\n";
  const Recording recording = read(csv, R"(
zero:
  - {channel: a_rad, first: 2s}
  - {channel: b_rad, mid_range: true}
)")[0];
  EXPECT_EQ(recording.channel("a_rad").values, (std::vector<double>{-1, 1, 7}));
  EXPECT_EQ(recording.channel("b_rad").values, (std::vector<double>{-4, -2, 4}));
  ASSERT_EQ(recording.zeros.size(), 2U);
  EXPECT_EQ(recording.zeros[0].first_s, 2.0);
  EXPECT_TRUE(recording.zeros[1].mid_range);
}

TEST(Mapping, RefusesAZeroThatIsTakenOverMoreThanTheRecording) {
  const std::string csv = "t_s,a_rad\n0,1\n1,3\n2,9\n";
  EXPECT_NO_THROW(static_cast<void>(read(csv, "zero: [{channel: a_rad, first: 3s}]")));
  const std::string message = test::error_message(
      [&] { static_cast<void>(read(csv, "zero: [{channel: a_rad, first: 4s}]")); });
  EXPECT_NE(message.find("log: zero of a_rad: expected at most the 3 s of the recording"),
            std::string::npos)
      << message;
}

TEST(Mapping, RefusesValuesThatAreInfiniteAfterTheirConversion) {
  const std::string csv = "t_s,a_rad\n0,1\n1,3\n";
  const std::string message = test::error_message(
      [&] { static_cast<void>(read(csv, "channels: {a_rad: {from: a_rad, scale: 1e308}}")); });
  EXPECT_NE(message.find("log.csv: line 3"), std::string::npos) << message;
  EXPECT_NE(message.find("too large after its conversion to SI"), std::string::npos) << message;
}

TEST(Mapping, DerivesChannelsAndRemembersHow) {
  Recording recording =
      read("t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n0,3,1,5\n1,5,1,\n2,9,2,6\n")[0];
  const Mapping mapping = parse_mapping(R"(
derive:
  spring_deflection_rad: gear_angle_rad - joint_angle_rad
  half_torque_Nm: torque_Nm / 2
)",
                                        "map.yaml");
  add_derived(recording, mapping.derive);
  EXPECT_EQ(recording.channel("spring_deflection_rad").values, (std::vector<double>{2, 4, 7}));
  EXPECT_TRUE(std::isnan(recording.channel("half_torque_Nm").values[1]));
  EXPECT_EQ(recording.channel("half_torque_Nm").values[2], 3.0);
  EXPECT_EQ(recording.definitions, mapping.derive);
  EXPECT_THROW(add_derived(recording, {{"torque_rate_Nm_s", "rate(torque_Nm)"}}), Error);
}

TEST(Mapping, WhatIsWrittenReadsBackBitByBit) {
  const TemporaryFolder folder;
  const std::string path = folder.path("a.csv");
  EXPECT_TRUE(rc::check([&] {
    const auto samples = *rc::gen::inRange<std::size_t>(2, 200);
    const double rate_Hz = *rc::gen::element(1000.0, 1.0 / 0.0012, 333.0, 0.1, 999.97, 1.0 / 3.0);
    const double start_s = *rc::gen::element(0.0, 12.5, -3.0, 1.7e9);
    Recording written("a", rate_Hz, start_s);
    for (const char* name : {"a_rad", "b_Nm"}) {
      Channel channel{.name = name, .values = std::vector<double>(samples), .fresh = {}};
      for (double& value : channel.values) {
        value = std::bit_cast<double>(*rc::gen::arbitrary<std::uint64_t>());
        if (!std::isfinite(value)) value = std::nan("");
      }
      if (*rc::gen::arbitrary<bool>())
        for (std::size_t i = 0; i < samples; ++i) channel.fresh.push_back(i % 3 == 0 ? 1 : 0);
      written.add(channel);
    }
    write_csv(written, path);
    const Recording read_back = measured_recordings(read_csv(path), {})[0];
    RC_ASSERT(read_back.channels().size() == written.channels().size());
    for (std::size_t c = 0; c < written.channels().size(); ++c) {
      const Channel& before = written.channels()[c];
      const Channel& after = read_back.channels()[c];
      RC_ASSERT(after.name == before.name);
      RC_ASSERT(after.fresh == before.fresh);
      for (std::size_t i = 0; i < samples; ++i) {
        const bool both_missing = std::isnan(before.values[i]) && std::isnan(after.values[i]);
        RC_ASSERT(both_missing || std::bit_cast<std::uint64_t>(before.values[i]) ==
                                      std::bit_cast<std::uint64_t>(after.values[i]));
      }
    }
    // Stamps since 1970 hold the time to 2^-22 s only.
    const double tolerance = start_s > 1e9 ? 1e-3 : 1e-12;
    RC_ASSERT(std::abs(read_back.sample_rate_Hz() - rate_Hz) <= tolerance * rate_Hz);
  }));
}

}  // namespace
}  // namespace torsio
