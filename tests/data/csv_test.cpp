#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "data/csv/csv_table.hpp"
#include "data/csv/time_stamp.hpp"
#include "support/error_message.hpp"
#include "support/gzipped.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

TEST(ParseCsv, ANumberTooSmallIsZeroAndOneTooLargeIsRefusedWhateverTheLocale) {
  struct CommaLocale {
    CommaLocale() {
      for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
        if (std::setlocale(LC_NUMERIC, name) != nullptr) break;
    }
    ~CommaLocale() { static_cast<void>(std::setlocale(LC_NUMERIC, "C")); }
    CommaLocale(const CommaLocale&) = delete;
    CommaLocale& operator=(const CommaLocale&) = delete;
  } const comma;
  const std::string zeros(400, '0');
  for (const std::string& small :
       {std::string("5.1e-330"), std::string("0.0071e-400"), "0." + zeros + "9",
        zeros + ".1e-999999999", std::string("0e999")})
    EXPECT_EQ(parse_csv("a_1\n-" + small + "\n", "t").columns[0].values[0], 0.0) << small;
  for (const std::string& large : {std::string("5.1e330"), std::string("0.0071e400"), "9" + zeros,
                                   "0." + zeros + "1e999999999"})
    EXPECT_THROW(static_cast<void>(parse_csv("a_1\n" + large + "\n", "t")), Error) << large;
  EXPECT_EQ(parse_csv("a_1\n0." + zeros + "1e401\n", "t").columns[0].values[0], 1.0);
  EXPECT_EQ(parse_csv("a_1\n4.9e-324\n", "t").columns[0].values[0], 4.9e-324);
}

void expect_two_rows(const LogTable& table) {
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[0].name, "t_s");
  EXPECT_EQ(table.columns[1].name, "torque_Nm");
  EXPECT_EQ(table.columns[0].values, (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(table.columns[1].values, (std::vector<double>{1.5, -2.0}));
}

class CsvDialect : public testing::TestWithParam<std::string> {};

TEST_P(CsvDialect, IsReadLikeThePlainOne) { expect_two_rows(parse_csv(GetParam(), "a.csv")); }

INSTANTIATE_TEST_SUITE_P(
    All, CsvDialect,
    testing::Values(
        "t_s,torque_Nm\n0,1.5\n0.5,-2\n", "t_s,torque_Nm\n0,1.5\n0.5,-2",
        "t_s,torque_Nm\r\n0,1.5\r\n0.5,-2\r\n", "\xef\xbb\xbft_s,torque_Nm\n0,1.5\n0.5,-2\n",
        "\xef\xbb\xbf# made by hand\n\nt_s,torque_Nm\n0,1.5\n# a pause\n\n0.5,-2\n",
        "t_s;torque_Nm\n0;1.5\n0.5;-2\n", "t_s;torque_Nm\n0;1,5\n0,5;-2\n",
        "t_s\ttorque_Nm\n0\t1.5\n0.5\t-2\n", "t_s\ttorque_Nm\n0\t1,5\n0,5\t-2\n",
        "\"t_s\",\"torque_Nm\"\n0,1.5\n0.5,-2\n", "\"t_s\"; \"torque_Nm\"\n\"0\";\"1,5\"\n0,5;-2\n",
        " t_s , torque_Nm\n 0, +1.5 \n .5,-2.\n", "t_s,torque_Nm\n0E0,15e-1\n5e-1,-0.2e+1\n",
        test::gzipped("t_s,torque_Nm\n0,1.5\n0.5,-2\n"),
        test::gzipped("t_s,torque_Nm\n0,1.5\n") + test::gzipped("0.5,-2\n")));

TEST(Csv, AQuotedHeaderMayHoldSeparatorsAndQuotes) {
  const LogTable table = parse_csv("\"a,b_rad\",\"the \"\"x\"\"_1\"\n1,2\n", "a.csv");
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[0].name, "a,b_rad");
  EXPECT_EQ(table.columns[1].name, "the \"x\"_1");
}

TEST(Csv, EmptyCellsAndNanAreMissingValues) {
  const LogTable table = parse_csv("a_1,b_1,c_1\n,nan,\nNaN, ,3\n", "a.csv");
  EXPECT_TRUE(std::isnan(table.columns[0].values[0]));
  EXPECT_TRUE(std::isnan(table.columns[0].values[1]));
  EXPECT_TRUE(std::isnan(table.columns[1].values[0]));
  EXPECT_TRUE(std::isnan(table.columns[1].values[1]));
  EXPECT_TRUE(std::isnan(table.columns[2].values[0]));
  EXPECT_EQ(table.columns[2].values[1], 3.0);
}

TEST(Csv, MarksOfMissingValuesAreReadAndNoted) {
  for (const char* mark :
       {"-nan", "NAN(ind)", "-nan(ind)", "1.#QNAN", "-1.#IND", "NA", "N/A", "n/a", "null", "NULL",
        "None", "#N/A", "<NA>", "NaT", "--", "?", "\"NA\"", " NA "}) {
    const LogTable table = parse_csv(std::string("a_1,b_1\n1,2\n3,") + mark + "\n", "a.csv");
    EXPECT_TRUE(std::isnan(table.columns[1].values[1])) << mark;
    ASSERT_EQ(table.notes.size(), 1U) << mark;
    EXPECT_NE(table.notes[0].find("cells that are read as not measured"), std::string::npos);
  }
  EXPECT_TRUE(parse_csv("a_1\nnan\n\"\"\n1\n", "a.csv").notes.empty());
  for (const char* other : {"inf", "-inf", "1.#INF", "bad", "nanometre"})
    EXPECT_THROW((void)parse_csv(std::string("a_1\n1\n") + other + "\n", "a.csv"), Error) << other;
}

TEST(Csv, FurtherMarksOfMissingValuesAreTextsOrNumbers) {
  const CsvOptions options{.rules = {.missing = {"bad", "-999"}}};
  const LogTable table = parse_csv("a_1,b_1\n1,bad\n-999.0,2\n3,-999\n", "a.csv", options);
  EXPECT_TRUE(std::isnan(table.columns[1].values[0]));
  EXPECT_TRUE(std::isnan(table.columns[0].values[1]));
  EXPECT_TRUE(std::isnan(table.columns[1].values[2]));
  EXPECT_EQ(table.columns[0].values[2], 3.0);
}

TEST(Csv, NumbersForWhatIsMissingAreNumbersInTheClockAMaskAndWhatSplitsTheLog) {
  const std::string csv = "t_ms,torque_Nm,torque_fresh_1,run,dt [s]\n0,5,0,0,0\n1,0,\"0\",0,0\n";
  const LogTable table =
      parse_csv(csv, "a.csv", {.rules = {.missing = {"0"}, .complete = {"run"}}});
  for (const std::size_t column : {2U, 3U, 4U})
    EXPECT_EQ(table.columns[column].values, (std::vector<double>{0.0, 0.0})) << column;
  EXPECT_EQ(table.columns[0].values, (std::vector<double>{0.0, 1.0}));
  EXPECT_EQ(table.columns[1].values[0], 5.0);
  EXPECT_TRUE(std::isnan(table.columns[1].values[1]));
}

std::vector<double> first_column(const std::string& cells, const CsvRules& rules = {}) {
  return parse_csv("a_1;b_1\n" + cells, "a.csv", {.rules = rules}).columns[0].values;
}

TEST(Csv, CommasBeforeThreeDigitsAreNotReadWithoutAProof) {
  const std::string cells = "32,152;1\n-814;2\n-1,018;3\n";
  const std::string message = test::error_message([&] { (void)first_column(cells); });
  for (const char* part : {"a.csv: line 2, column 1 (a_1): the comma in '32,152'",
                           "below 1000 numbers without a comma", "decimal: point  if it is 32152",
                           "decimal: comma  if it is 32.152"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_EQ(first_column(cells, {.decimal = "point"}), (std::vector{32152.0, -814.0, -1018.0}));
  EXPECT_EQ(first_column(cells, {.decimal = "comma"}), (std::vector{32.152, -814.0, -1.018}));
  for (const char* other : {"1,234;0.5\n", "1,234;1.234\n", "1,234;2,345\n"})
    EXPECT_THROW((void)first_column(other), Error) << other;
}

TEST(Csv, OneNumberProvesWhatTheCommasOfAFileAre) {
  for (const char* proof : {"0,123", "1,5", "-,512", "1234,567", "1,234e1", "1,2345", "1.234,5"})
    EXPECT_EQ(first_column(std::string("1,234;1\n2,345;") + proof + "\n3,456;1\n"),
              (std::vector{1.234, 2.345, 3.456}))
        << proof;
  for (const char* proof : {"1,234,567", "1,234.5", "-12,345.6e3", "1,234."})
    EXPECT_EQ(first_column(std::string("1,234;1\n-2,345;") + proof + "\n3,456;1\n"),
              (std::vector{1234.0, -2345.0, 3456.0}))
        << proof;
  EXPECT_EQ(first_column("1.234,5;1\n2.345;2\n"), (std::vector{1234.5, 2345.0}));
  EXPECT_THROW((void)first_column("1,234,567;0,5\n"), Error);
  const LogTable quoted = parse_csv("a_1,b_1\n0.5,\"1,234.5\"\n1.234,\"2,345\"\n", "a.csv");
  EXPECT_EQ(quoted.columns[0].values, (std::vector{0.5, 1.234}));
  EXPECT_EQ(quoted.columns[1].values, (std::vector{1234.5, 2345.0}));
  ASSERT_EQ(quoted.notes.size(), 1U);
  EXPECT_NE(quoted.notes[0].find("commas are read as marks between thousands"), std::string::npos);
}

TEST(Csv, ApostrophesAndNarrowSpacesMaySeparateThousands) {
  for (const std::string mark : {"'", "\u2019", "\u202f", "\u00a0", "\u2009", "\xa0"}) {
    EXPECT_EQ(first_column("-1" + mark + "396,75;1\n419,86;1\n"), (std::vector{-1396.75, 419.86}))
        << mark;
    EXPECT_EQ(first_column("12" + mark + "345" + mark + "678;1\n1" + mark + "234.5;1\n"),
              (std::vector{12345678.0, 1234.5}))
        << mark;
    for (const std::string& other : {"1" + mark + "39", "1" + mark + "3961", "1234" + mark + "567",
                                     mark + "396", "0" + mark + "396", "1" + mark + "396e3"})
      EXPECT_THROW((void)first_column(other + ";1\n"), Error) << other;
  }
  const LogTable table = parse_csv("a_1;b_1\n1'396.5;2\n", "a.csv");
  ASSERT_EQ(table.notes.size(), 1U);
  EXPECT_NE(table.notes[0].find("'1'396.5'"), std::string::npos) << table.notes[0];
}

TEST(Csv, ANumberMustFitTheMarkThatIsStated) {
  EXPECT_THROW((void)first_column("1,5;1\n", {.decimal = "point"}), Error);
  EXPECT_THROW((void)first_column("0.5;1\n", {.decimal = "comma"}), Error);
  EXPECT_EQ(first_column("1.234;1\n0,5;2\n", {.decimal = "comma"}), (std::vector{1234.0, 0.5}));
}

TEST(Csv, ADecimalCommaMayFollowExponentsAndTimes) {
  const LogTable table =
      parse_csv("t;a_1;b_1\n12:00:00,250;1e-05;0,5\n12:00:00,500;2;1,5\n", "a.csv");
  EXPECT_EQ(table.columns[0].values, (std::vector<double>{43200.25, 43200.5}));
  EXPECT_EQ(table.columns[2].values, (std::vector<double>{0.5, 1.5}));
  EXPECT_THROW((void)parse_csv("a_1;b_1\n1.0;2\n2,0;3\n", "a.csv"), Error);
}

TEST(Csv, NumbersInOtherSpellingsAreRead) {
  const LogTable table =
      parse_csv("a_1,b_1,c_1\n\u22121.5,0x1F,1.5D+03\n\u22122,-0xff,-0.25d-1\n", "a.csv");
  EXPECT_EQ(table.columns[0].values, (std::vector{-1.5, -2.0}));
  EXPECT_EQ(table.columns[1].values, (std::vector{31.0, -255.0}));
  EXPECT_EQ(table.columns[2].values, (std::vector{1500.0, -0.025}));
  for (const char* other : {"0x", "0xg", "0x12345678901234", "D3", "1D", "1d2d3", "dead"})
    EXPECT_THROW((void)parse_csv(std::string("a_1\n1\n") + other + "\n", "a.csv"), Error) << other;
}

TEST(Csv, LinesMayEndInReturnsAlone) {
  std::string text = "t_s,torque_Nm\r";
  for (int i = 0; i < 20000; ++i) text += fmt::format("{},{}\r", i, 2 * i);
  for (const std::string& log : {text, text.substr(0, text.size() - 1)}) {
    const LogTable table = parse_csv(log, "a.csv");
    ASSERT_EQ(table.rows(), 20000U);
    EXPECT_EQ(table.columns[1].values.back(), 39998.0);
    EXPECT_EQ(table.line_of(19999), 20001U);
  }
}

TEST(Csv, RowsBeforeZeroBytesAtTheEndAreRead) {
  const std::string rows = "a_1,b_1\n1,2\n3,4\n";
  for (const std::string& end : {std::string(2000, '\0'), "5,6" + std::string(20, '\0')}) {
    const LogTable table = parse_csv(rows + end, "a.csv");
    EXPECT_EQ(table.columns[1].values, (std::vector{2.0, 4.0}));
    EXPECT_TRUE(table.is_unfinished);
    ASSERT_EQ(table.notes.size(), 1U);
    EXPECT_NE(table.notes[0].find("line 4 has zero bytes"), std::string::npos) << table.notes[0];
    const std::string message =
        test::error_message([&] { (void)parse_csv(rows + end + "\n7,8\n", "a.csv"); });
    EXPECT_NE(message.find("line 5"), std::string::npos) << message;
  }
}

TEST(Csv, RowsWithoutAHeaderAndTimesOfASerialMonitorAreNamed) {
  const auto message_of = [](const std::string& text) {
    return test::error_message([&] { (void)parse_csv(text, "a.csv"); });
  };
  const std::string echo = "1700000000,0,,elbow,-0.17,0.5\n1700000000,10000000,,elbow,-0.18,0.6\n";
  EXPECT_NE(message_of(echo).find("ros2 bag record"), std::string::npos) << message_of(echo);
  const std::string row = "0.01,elbow,2.5\n0.02,elbow,2.6\n";
  EXPECT_NE(message_of(row).find("a row of numbers"), std::string::npos) << message_of(row);
  const std::string monitor = "14:03:10.010 -> t_s,a_rad\n14:03:10.020 -> 0.00,1\n";
  EXPECT_NE(message_of(monitor).find("sed 's/^[0-9:.]* -> //'"), std::string::npos)
      << message_of(monitor);
}

struct WrittenTime {
  std::string text;
  double time_s;
};

TEST(Csv, TimesAreReadWhereTheyHaveOneMeaning) {
  constexpr double kDay_s = 19783.0 * 86400.0;  // 2024-03-01
  for (const WrittenTime& time : {WrittenTime{"2024-03-01T12:34:56.5Z", kDay_s + 45296.5},
                                  {"2024-03-01 12:34:56,5", kDay_s + 45296.5},
                                  {"2024-03-01T12:34:56.5+01:00", kDay_s + 41696.5},
                                  {"2024-03-01T12:34:56-0130", kDay_s + 50696.0},
                                  {"2024-03-01T12:34", kDay_s + 45240.0},
                                  {"2024/03/01 12:34:56 UTC", kDay_s + 45296.0},
                                  {"01.03.2024 12:34:56", kDay_s + 45296.0},
                                  {"20240301T123456Z", kDay_s + 45296.0},
                                  {"12:34:56.5", 45296.5},
                                  {"12:34:56:500", 45296.5},
                                  {"1:02:03 PM", 46923.0},
                                  {"12:00:01 AM", 1.0},
                                  {"34:56.5", 2096.5},
                                  {"2 days 00:00:01.5", 172801.5},
                                  {"2024-03-01", kDay_s}}) {
    const LogTable table = parse_csv("time;a_1\n" + time.text + ";1\n", "a.csv");
    EXPECT_NE(table.columns[0].time, TimeKind::none) << time.text;
    EXPECT_NEAR(table.columns[0].values[0], time.time_s, 1e-6) << time.text;
  }
  for (const char* text :
       {"3/1/2024 12:34:56", "12:34", "2024-13-01", "2024-02-30T00:00:00", "2024-03-01T25:00:00",
        "12:61:00", "1.5.2", "13:00:00 PM", "12:34:56:25"})
    EXPECT_THROW((void)parse_csv(std::string("time,a_1\n") + text + ",1\n", "a.csv"), Error)
        << text;
  EXPECT_THROW((void)parse_csv("time,a_1\n12:34:56,1\n5,1\n", "a.csv"), Error);
}

TEST(Csv, TheFormatOfTimesMayBeGiven) {
  const CsvOptions options{.rules = {.time_format = "%d/%m/%Y %I:%M:%S %p"}};
  const LogTable table = parse_csv("time,a_1\n1/3/2024 01:00:00.25 PM,1\n", "a.csv", options);
  EXPECT_NEAR(table.columns[0].values[0], 19783.0 * 86400.0 + 46800.25, 1e-6);
}

TEST(TimeStamp, TheFormatThatErrorsNameReadsTheText) {
  for (const char* text :
       {"3/1/2024 12:34:56.25", "03/01/24 01:02:03 PM", "01.03.24 12:34:56,5", "01-Mar-2024 12:34",
        "Fri Mar 01 12:34:56 2024", "3/1/2024", "March 1 2024 12:34:56"}) {
    EXPECT_TRUE(is_like_time(text)) << text;
    const std::string format = likely_time_format(text);
    EXPECT_TRUE(read_time_stamp(text, format)) << text << " by " << format;
  }
  for (const char* text : {"abc", "1,5", "marker 100", "1e999", "v1.2", "-inf"})
    EXPECT_FALSE(is_like_time(text)) << text;
}

TEST(Csv, DateAndTimeInTwoColumnsAreOneTime) {
  const LogTable table =
      parse_csv("Date,Time,a_1\n2024-02-29,23:59:59.5,1\n2024-03-01,00:00:00.5,2\n", "a.csv");
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[0].name, "Time");
  EXPECT_NEAR(table.columns[0].values[1] - table.columns[0].values[0], 1.0, 1e-6);
  EXPECT_NEAR(table.columns[0].values[1], 19783.0 * 86400.0 + 0.5, 1e-6);
}

TEST(Csv, TimesOfTheDayPassMidnight) {
  EXPECT_EQ(parse_csv("t,a_1\n23:59:59,1\n00:00:00,2\n00:00:01,3\n", "a.csv").columns[0].values,
            (std::vector<double>{86399.0, 86400.0, 86401.0}));
}

class CsvPreamble : public testing::TestWithParam<std::string> {};

TEST_P(CsvPreamble, IsSkippedAndNoted) {
  const LogTable table = parse_csv(GetParam() + "t_s,torque_Nm\n0,1.5\n0.5,-2\n", "a.csv");
  expect_two_rows(table);
  EXPECT_EQ(table.notes.size(), 1U);
  EXPECT_EQ(table.line_of(0), table.header_line + 1);
}

INSTANTIATE_TEST_SUITE_P(All, CsvPreamble,
                         testing::Values("Logger v1.2\n", "Logger\nDate: 2024-03-01\n\n",
                                         "Operator,John\nRate,100\n", "a;b;c\n# note\nx,y,z,1\n",
                                         "File,run7\n"));

TEST(Csv, ThePreambleOfATableWithTextsIsSkippedToo) {
  const LogTable table = parse_csv("Export\nby x, y, z\nt_s,state,a_1\n0,up,1\n1,down,2\n", "a.csv",
                                   {.skip = {"state"}});
  EXPECT_EQ(table.header_line, 3U);
  EXPECT_EQ(table.columns[1].values, (std::vector<double>{1.0, 2.0}));
}

TEST(Csv, TheLinesAboveTheHeaderMayBeCounted) {
  const CsvOptions options{.rules = {.skip_lines = 2}};
  EXPECT_EQ(parse_csv("a_1,b_1\n1,2\nc_1,d_1\n3,4\n", "a.csv", options).columns[0].name, "c_1");
}

TEST(Csv, ACommentAboveNumbersIsTheHeader) {
  expect_two_rows(parse_csv("# made by hand\n# t_s, torque_Nm\n0,1.5\n0.5,-2\n", "a.csv"));
}

TEST(Csv, ARowOfUnitsIsRead) {
  const LogTable table =
      parse_csv("t_s;Winkel;tau;n;x\n[s];\xc2\xb0;N\xc2\xb7m;-;counts\n0;1,5;2;3;4\n", "a.csv");
  EXPECT_EQ(table.columns[0].unit, "s");
  EXPECT_EQ(table.columns[1].unit, "deg");
  EXPECT_EQ(table.columns[2].unit, "Nm");
  EXPECT_EQ(table.columns[3].unit, "1");
  EXPECT_EQ(table.columns[4].unit, "");
  EXPECT_EQ(table.line_of(0), 3U);
}

TEST(Csv, AnUnknownWordInARowOfUnitsIsRemarkedOn) {
  const LogTable table = parse_csv("t;a;b;c;d;e\nms;Inc;grad;foo;-;foo\n0;1;5;2;3;4\n", "a.csv");
  EXPECT_THAT(
      table.notes,
      testing::ElementsAre(
          "line 2 is read as a row of units",
          testing::StartsWith("the row of units has 'Inc' for a: counts have no size"),
          "the row of units has 'foo' for c, e: not a unit that torsio reads; a mapping states it "
          "(unit: ..)",
          testing::StartsWith("the row of units has 'grad' for b: not read. It may be degrees")));
  EXPECT_EQ(table.columns[1].unknown_unit, "Inc");
}

TEST(Csv, AHeaderThatIsRepeatedIsNotReadAgain) {
  const LogTable table = parse_csv("t,a\ns,Nm\n0,1\n1,2\n\"t\", a\ns,Nm\n0,3\nt,a\n1,4\n", "a.csv");
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[1].values, (std::vector<double>{1.0, 2.0, 3.0, 4.0}));
  EXPECT_EQ(table.notes.back(), "the header is repeated, first in line 5: it is not read again");
  EXPECT_EQ(table.line_of(2), 7U);
  EXPECT_THROW(static_cast<void>(parse_csv("t,a\n0,1\na,t\n1,2\n", "a.csv")), Error);
}

TEST(Csv, UnitsInBracketsAreReadButNoIndices) {
  const LogTable table = parse_csv(
      "Time [ms],Motor torque (N\xc2\xb7m),w [deg/s],q[0],x(1),y [foo],n [-],a_rad [1]\n"
      "0,1,2,3,4,5,6,7\n",
      "a.csv");
  const auto name = [&](std::size_t column) { return table.columns[column].full_name(); };
  EXPECT_EQ(name(0), "Time_ms");
  EXPECT_EQ(name(1), "Motor_torque_Nm");
  EXPECT_EQ(name(2), "w_deg_s");
  for (const std::size_t column : {3U, 4U, 5U, 7U}) EXPECT_FALSE(table.columns[column].has_unit());
  EXPECT_EQ(name(6), "n_1");
  EXPECT_EQ(table.notes,
            std::vector<std::string>{
                "units in brackets in the header are read, such as that of 'Time [ms]'"});
}

TEST(Csv, EmptyCellsAfterTheLastColumnAreNotRead) {
  const LogTable table = parse_csv("Logger\nt_s;torque_Nm\n0;1,5;\n0,5;-2; ;\n", "a.csv");
  expect_two_rows(table);
  EXPECT_EQ(table.notes.back(), "empty cells after the last column are not read");
}

TEST(Csv, ColumnsWithoutANameAreNotRead) {
  for (const char* header : {",t_s,torque_Nm", "Unnamed: 0,t_s,torque_Nm", "\"\",t_s,torque_Nm"}) {
    const LogTable table = parse_csv(std::string(header) + "\n7,0,1.5\n8,0.5,-2\n", "a.csv");
    expect_two_rows(table);
    EXPECT_EQ(table.notes, std::vector<std::string>{"columns without a name are not read: 1"});
  }
  expect_two_rows(parse_csv("t_s,torque_Nm,,\n0,1.5,,\n0.5,-2,,\n", "a.csv"));
}

TEST(Csv, ColumnsThatTheMappingDoesNotNameAreReadIfTheyHaveAUnit) {
  const CsvOptions options{.wanted = {"tau"}, .rules = {.only_wanted = true}};
  const LogTable table =
      parse_csv("t_s,tau,x,x,q_rad,stamp\n0,1,up,2,3,2024-03-01T00:00:00\n", "a.csv", options);
  std::vector<std::string> names;
  for (const LogColumn& column : table.columns) names.push_back(column.name);
  EXPECT_EQ(names, (std::vector<std::string>{"t_s", "tau", "q_rad", "stamp"}));
  EXPECT_EQ(table.other_columns, (std::vector<std::string>{"x", "x"}));
  ASSERT_FALSE(table.notes.empty());
  EXPECT_NE(table.notes[0].find("not read: x, x"), std::string::npos) << table.notes[0];
}

TEST(Csv, ASkippedColumnMayHoldAnything) {
  const LogTable table =
      parse_csv("a_1,phase,b_1\n1,\"up, then down\",2\n3,down,4\n", "a.csv", {.skip = {"phase"}});
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[1].values, (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(table.columns[1].number, 3U);
  EXPECT_EQ(parse_csv("a_1,adc0_x,adc1_x\n1,2,3\n", "a.csv", {.skip = {"adc*_x"}}).columns.size(),
            1U);
}

TEST(Csv, LineNumbersCountCommentsAndBlankLines) {
  const LogTable table = parse_csv("# one\na_1\n1\n2\n\n# six\n3\n4\n", "a.csv");
  EXPECT_EQ(table.line_of(0), 3U);
  EXPECT_EQ(table.line_of(1), 4U);
  EXPECT_EQ(table.line_of(2), 7U);
  EXPECT_EQ(table.line_of(3), 8U);
  EXPECT_EQ(table.place(2, table.columns[0]), "a.csv: line 7, column 1 (a_1)");
}

TEST(Csv, TellsTheSha256OfTheFileAsItStands) {
  const TemporaryFolder folder;
  // printf 'a_1\n1\n' | sha256sum
  const std::string path = folder.file("a.csv", "a_1\n1\n");
  const LogTable table = read_csv(path);
  EXPECT_EQ(table.source.file, path);
  EXPECT_EQ(table.source.sha256,
            "2ea78cc556ed74a182f57b9ecce150d3ba98cc351c83464a486ded36bcf90042");
}

TEST(Csv, ReadsLinesThatCrossEveryBufferBorder) {
  std::string text = "a_1,b_1\n";
  std::vector<double> expected;
  for (int i = 0; text.size() < 1'000'000; ++i) {
    text += std::to_string(i) + "," + std::string(static_cast<std::size_t>(i % 17), '0') + "7\n";
    expected.push_back(i);
  }
  EXPECT_EQ(parse_csv(text, "a.csv").columns[0].values, expected);
  EXPECT_EQ(parse_csv(text, "a.csv").columns[1].values, std::vector<double>(expected.size(), 7.0));
}

TEST(Csv, EveryNumberIsRoundedCorrectly) {
  EXPECT_TRUE(rc::check("the shortest text of a double reads back as it", [](std::uint64_t bits) {
    const auto value = std::bit_cast<double>(bits);
    RC_PRE(std::isfinite(value));
    for (const auto& text : {fmt::format("{}", value), fmt::format("{:.17g}", value),
                             fmt::format("{:.17e}", value), fmt::format("{:.25g}", value)}) {
      const double read = parse_csv("a_1\n" + text + "\n", "a.csv").columns[0].values[0];
      RC_ASSERT(std::bit_cast<std::uint64_t>(read) == bits);
    }
  }));
  EXPECT_TRUE(rc::check("a short decimal reads like strtod", [](std::int64_t mantissa) {
    const int places = *rc::gen::inRange(-25, 25);
    const std::string text = fmt::format("{}e{}", mantissa, places);
    RC_ASSERT(parse_csv("a_1\n" + text + "\n", "a.csv").columns[0].values[0] ==
              std::strtod(text.c_str(), nullptr));
  }));
}

TEST(Csv, NumbersBeyondTheRangeOfDoublesBecomeZeroOrAreRefused) {
  EXPECT_EQ(parse_csv("a_1\n1e-999\n", "a.csv").columns[0].values[0], 0.0);
  EXPECT_THROW(parse_csv("a_1\n1e999\n", "a.csv"), std::exception);
}

TEST(Csv, EndsAtALongStretchWithoutSamples) {
  const CsvOptions options{.limits = {.gap_bytes = 1000}};
  const auto with_gap = [&](const std::string& line, std::size_t lines) {
    std::string text = "a_1\n1\n";
    for (std::size_t n = 0; n < lines; ++n) text += line + "\n";
    return text + "2\n";
  };
  // Shorter stretches may be repeated.
  EXPECT_EQ(parse_csv(with_gap("", 900) + with_gap("# note", 100).substr(4), "a.csv", options)
                .columns[0]
                .values,
            (std::vector<double>{1, 2, 1, 2}));
  for (const char* line : {"", "\r", "# note"}) {
    const std::string message =
        test::error_message([&] { (void)parse_csv(with_gap(line, 1001), "a.csv", options); });
    EXPECT_TRUE(message.starts_with("a.csv: line ")) << message;
    EXPECT_NE(message.find("more than 1000 bytes of blank lines"), std::string::npos) << message;
  }
}

Recording example(std::size_t samples) {
  Recording recording("example", 1000.0, 0.25);
  std::vector<double> angle(samples);
  std::vector<double> torque(samples);
  std::vector<std::uint8_t> fresh(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    angle[i] = std::sin(0.01 * static_cast<double>(i));
    torque[i] = i % 3 == 0 ? -0.0 : std::nan("");
    fresh[i] = i % 3 == 0 ? 1 : 0;
  }
  recording.add({.name = "angle_rad", .values = angle});
  recording.add({.name = "torque_Nm", .values = torque, .fresh = fresh});
  return recording;
}

TEST(CsvWriter, WritesTheClockFirstAndFreshnessBesideItsChannel) {
  const TemporaryFolder folder;
  const std::string path = folder.path("a.csv");
  write_csv(example(2), path);
  std::ifstream file(path);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_EQ(
      text,
      "t_s,angle_rad,torque_Nm,torque_fresh_1\n0.25,0,-0,1\n0.251,0.009999833334166664,nan,0\n");
}

TEST(CsvWriter, PacksWhatEndsInGzAndAlwaysToTheSameBytes) {
  const TemporaryFolder folder;
  const auto written = [&](const char* name) {
    write_csv(example(20000), folder.path(name));
    std::ifstream file(folder.path(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string plain = written("a.csv");
  const std::string packed = written("a.csv.gz");
  EXPECT_LT(packed.size(), plain.size() / 2);
  EXPECT_EQ(packed, written("b.csv.gz"));
  const LogTable table = read_csv(folder.path("a.csv"));
  const LogTable unpacked = read_csv(folder.path("a.csv.gz"));
  ASSERT_EQ(table.columns.size(), unpacked.columns.size());
  EXPECT_EQ(table.columns.front().values, unpacked.columns.front().values);
  EXPECT_EQ(table.columns.back().values, unpacked.columns.back().values);
}

TEST(CsvWriter, LeavesTheOldFileAndNothingElseWhenItFails) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.csv", "old");
  Recording infinite("infinite", 1.0);
  infinite.add({.name = "a_1", .values = {1.0, HUGE_VAL}});
  EXPECT_THROW(write_csv(infinite, path), std::exception);
  std::ifstream file(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "old");
  EXPECT_EQ(folder.files(), 1U);
  EXPECT_THROW(write_csv(example(2), folder.path("missing/a.csv")), std::exception);
  EXPECT_THROW(write_csv(example(100000), "/dev/full"), std::exception);
}

}  // namespace
}  // namespace torsio
