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

TEST(Csv, ASkippedColumnMayHoldAnything) {
  const LogTable table =
      parse_csv("a_1,phase,b_1\n1,\"up, then down\",2\n3,down,4\n", "a.csv", {.skip = {"phase"}});
  ASSERT_EQ(table.columns.size(), 2U);
  EXPECT_EQ(table.columns[1].values, (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(table.columns[1].number, 3U);
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
