// One bad input for each rule of the data readers; the message must say place, problem and remedy.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "data/csv/csv_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

struct BadInput {
  std::string rule;
  std::string input;
  std::vector<std::string> says;
};
std::ostream& operator<<(std::ostream& out, const BadInput& bad) { return out << bad.rule; }
std::string rule_of(const testing::TestParamInfo<BadInput>& info) { return info.param.rule; }

void expect_says(const std::string& message, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos)
        << "wanted: " << part << "\n   got: " << message;
}

class BrokenCsv : public testing::TestWithParam<BadInput> {};

TEST_P(BrokenCsv, IsRefusedWithPlaceAndReason) {
  const std::string message = message_of([&] {
    static_cast<void>(measured_recordings(parse_csv(GetParam().input, "log.csv"), Mapping{}));
  });
  expect_says(message, GetParam().says);
}

using namespace std::string_literals;

INSTANTIATE_TEST_SUITE_P(
    All, BrokenCsv,
    testing::Values(
        BadInput{"EmptyFile", "", {"log.csv: the file is empty"}},
        BadInput{"OnlyComments", "# a\n\n# b\n", {"log.csv: no header line"}},
        BadInput{"HeaderOnly", "t_s,torque_Nm\n", {"log.csv: no samples", "found a header only"}},
        BadInput{
            "NoHeader", "0,1\n1,2\n", {"log.csv: line 1", "numbers: '0, 1'", "Put a line such as"}},
        BadInput{"RaggedShort",
                 "t_s,a_rad\n0,1\n1\n",
                 {"log.csv: line 3: expected 2 cells, as in the header (line 1), found 1"}},
        BadInput{"RaggedLong", "t_s,a_rad\n0,1\n1,2,3\n", {"log.csv: line 3", "found 3"}},
        BadInput{"DecimalCommasBetweenCommas", "t_s,a_rad\n0,1,5\n", {"found 3", "semicolons"}},
        BadInput{"QuotedCommas",
                 "t_s,a_rad\n0,\"1,512\"\n",
                 {"line 2, column 2 (a_rad): the comma in '1,512' may precede decimals",
                  "decimal: point  if it is 1512", "decimal: comma  if it is 1.512"}},
        BadInput{"GroupsOfOtherSizes", "a_1;b_1\n1;1,23,456\n", {"between thousands"}},
        BadInput{"VerticalLines", "t_s|a_rad\n0|1\n", {"no separator", "tr '|' ,"}},
        BadInput{"NonNumber",
                 "t_s,torque_Nm\n0,1\n1,abc\n",
                 {"log.csv: line 3, column 2 (torque_Nm): expected a number", "'abc'",
                  "missing: [abc]", "drop: [torque_Nm]"}},
        BadInput{"DatesOfTwoMeanings",
                 "time,torque_Nm\n3/1/2024 12:00:00,1\n3/1/2024 12:00:01,1\n",
                 {"line 2, column 1 (time)", "clock: {format: \"%m/%d/%Y %H:%M:%S\"}"}},
        BadInput{"NumberWithTail", "a_1\n1.5x\n", {"line 2, column 1 (a_1)", "'1.5x'"}},
        BadInput{"TwoPoints", "a_1\n1.5.2\n", {"line 2, column 1 (a_1)", "'1.5.2'"}},
        BadInput{"BareExponent", "a_1\n1e\n", {"'1e'"}},
        BadInput{"Infinity", "a_1\ninf\n", {"'inf'"}},
        BadInput{"Overflow", "a_1\n1e400\n", {"'1e400'"}},
        BadInput{"ThousandsMark",
                 "t_s;a_1\n0.5;1\n1.0;1,234\n",
                 {"line 3, column 2 (a_1): the comma in '1,234'", "decimal: point  if it is 1234"}},
        BadInput{"CommaAfterPoint",
                 "t_s;a_1\n0.5;1\n1.0;1,23\n",
                 {"line 3, column 2 (a_1): decimal commas and decimal points"}},
        BadInput{"PointAfterComma", "t_s;a_1\n0,5;1\n1,0;1.234\n", {"line 3, column 2 (a_1)"}},
        BadInput{"MissingUnit",
                 "t_s,torque\n0,1\n1,2\n",
                 {"log.csv: line 1, column 2 (torque): the name has no unit", "_Nm", "unit: Nm"}},
        BadInput{"UnknownUnit",
                 "t_s,length_furlong\n0,1\n1,2\n",
                 {"line 1, column 2 (length_furlong): 'furlong' is not a known unit", "_rad_s",
                  "unit:"}},
        BadInput{"ClockWithoutUnit",
                 "time,torque_Nm\n0,1\n1,2\n",
                 {"(time)", "channels: {t_s: {from: time, unit: s}}"}},
        BadInput{"SpelledOutUnit",
                 "t_s,gear_angle_radians\n0,1\n1,2\n",
                 {"channels: {gear_angle_rad: {from: gear_angle_radians, unit: rad}}"}},
        BadInput{"UnitOfAnotherSystem",
                 "t_s,torque_kpcm\n0,1\n1,2\n",
                 {"how many Nm one kpcm is",
                  "channels: {torque_Nm: {from: torque_kpcm, unit: Nm, scale: FACTOR}}"}},
        BadInput{"UnknownUnitInBrackets",
                 "t_s,Torque [kgcm]\n0,1\n1,2\n",
                 {"Specify in a mapping how many Nm one kgcm is",
                  "channels: {Torque_Nm: {from: \"Torque [kgcm]\", unit: Nm, scale: FACTOR}}"}},
        BadInput{"Latin1",
                 "t_s;Winkel (\xb0)\n0;1\n1;2\n",
                 {"log.csv: line 1: expected names in UTF-8", "Winkel (\\xb0)", "iconv"}},
        BadInput{"BlankSeparated",
                 "t_s gear_angle_rad torque_Nm\n0 1 2\n1 1 2\n",
                 {"log.csv: line 1: no separator found", "commas"}},
        BadInput{"ModelFile",
                 "\xd0\x0a\x00\x00\x00\x00\x00\x00{\"__metadata__\":{\"torsio\":\"\"}}"s,
                 {"log.csv: expected a recording, found a model file"}},
        BadInput{"ModelFileOfOneLine",
                 "\xd0\x0b\x00\x00\x00\x00\x00\x00{\"__metadata__\":{\"torsio\":\"\"}}"s,
                 {"found a model file"}},
        BadInput{"DuplicateColumn",
                 "t_s,a_rad,a_rad\n0,1,2\n",
                 {"line 1, column 3 (a_rad): duplicate column", "column 2"}},
        BadInput{"DuplicateInSi",
                 "t_s,a_rad,a_deg\n0,1,2\n1,1,2\n",
                 {"line 1, column 3 (a_deg): duplicate column: in SI it is a_rad",
                  "column 2 (a_rad)", "drop"}},
        BadInput{"NoNames", ",,\n0,1,2\n", {"line 1: expected names of columns"}},
        BadInput{"OpenQuote", "t_s,\"a_rad\n0,1\n", {"line 1: a quotation mark is not closed"}},
        BadInput{"Binary",
                 "\x7f"
                 "ELF\x01\x01\x00\x00"s,
                 {"log.csv: line 1", "binary data", "\\x7fELF\\x01"}},
        BadInput{"Zeros", std::string(100, '\0'), {"log.csv: line 1", "binary data"}},
        BadInput{"Utf16", "\xff\xfet\x00_\x00s\x00\n\x00"s, {"UTF-16", "iconv -f UTF-16"}},
        BadInput{"BinaryInside", "a_1\n1\n\x01\x02\n", {"line 3", "\\x01\\x02"}},
        BadInput{"EndlessHeader", std::string(70000, 'a'), {"line 1", "no end of the line"}},
        BadInput{
            "EndlessLine", "a_1\n" + std::string(2000000, '1'), {"line 2", "no end of the line"}},
        BadInput{"TooManyComments",
                 std::string(70000, '\n'),
                 {"no header line within the first 65536 bytes"}},
        BadInput{"TruncatedGzip",
                 "\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x2b"s,
                 {"log.csv", "truncated"}},
        BadInput{"CorruptGzip", "\x1f\x8b\x08\x00garbage that is none"s, {"log.csv", "corrupt"}},
        BadInput{"OnlyAClock", "t_s\n0\n1\n", {"log.csv: no channels"}},
        BadInput{
            "TwoClocks", "t_s,time_ms,a_rad\n0,0,1\n1,1,2\n", {"two clocks", "t_s and time_ms"}},
        BadInput{"NoClock",
                 "a_rad,b_rad\n1,2\n",
                 {"log.csv: line 1: the log has no clock", "--rate", "a_rad, b_rad"}},
        BadInput{"OneSample",
                 "t_s,a_rad\n0,1\n",
                 {"log.csv: line 2", "at least two samples", "one sample"}},
        BadInput{"MissingStamp",
                 "t_s,a_rad\n0,1\n,2\n2,3\n",
                 {"log.csv: line 3, column 1 (t_s): expected a time stamp"}},
        BadInput{"RepeatedStamp",
                 "t_s,a_rad\n0,1\n0,2\n1,3\n",
                 {"log.csv: line 3, column 1 (t_s): the clock does not advance",
                  "1 stamps are repeated", "clock: {rebuild: true}"}},
        BadInput{"BackwardStamp",
                 "t_s,a_rad\n0,1\n2,2\n1.3,3\n3,3\n",
                 {"line 4", "1 run backward", "clock: {sort: true}", "drop: [t_s]"}},
        BadInput{"MissingSample",
                 "t_s,a_rad\n0,1\n1,2\n2,3\n4,5\n5,5\n",
                 {"log.csv: line 5, column 1 (t_s): 1 sample is missing, the first after t = 2 s",
                  "near 1 s, found 2 s", "clock: {resample: 1Hz}"}},
        BadInput{"ManyMissingSamples",
                 "t_s,a_rad\n0,1\n1,2\n2,3\n3,5\n13,5\n14,5\n15,5\n",
                 {"9 samples are missing, the first after t = 3 s",
                  "clock: {resample: 1Hz, split_at_gaps: 5s}"}},
        BadInput{"UnevenClock",
                 "t_s,a_rad\n0,1\n1,2\n2,3\n3.7,5\n4.2,5\n5.2,5\n",
                 {"the clock is not even", "clock: {rebuild: true}", "clock: {resample: 1Hz}"}},
        BadInput{"ClockEndsBeforeItStarts",
                 "t_s,a_rad\n5,1\n4,2\n",
                 {"the last time stamp is not after the first"}},
        BadInput{"FreshnessIsNoMask",
                 "t_s,a_rad,a_fresh_1\n0,1,1\n1,1,0.5\n",
                 {"line 3, column 3 (a_fresh_1): expected 1 (new sample) or 0 (held), found 0.5"}},
        BadInput{"FreshnessOfTwo",
                 "t_s,a_rad,a_Nm,a_fresh_1\n0,1,1,1\n1,1,1,0\n",
                 {"two columns could be meant"}}),
    rule_of);

class BrokenMapping : public testing::TestWithParam<BadInput> {};

/// Each mapping is applied to this log.
constexpr const char* kLog =
    "t_s,pos_deg,tau,run\n0,1,2,0\n0.015,2,3,0\n0.015,3,4,0\n0.03,4,5,1\n0.045,5,6,1\n";

TEST_P(BrokenMapping, IsRefusedWithPlaceAndReason) {
  const std::string message = message_of([&] {
    const Mapping mapping = parse_mapping(GetParam().input, "map.yaml");
    auto recordings =
        measured_recordings(parse_csv(kLog, "log.csv", {.skip = mapping.drop}), mapping);
    for (Recording& recording : recordings) add_derived(recording, mapping.derive);
  });
  expect_says(message, GetParam().says);
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenMapping,
    testing::Values(
        BadInput{"NoYaml", "a: [1", {"map.yaml: line", "not YAML"}},
        BadInput{"Empty", "", {"map.yaml", "'key: value'"}},
        BadInput{"AList", "[1, 2]", {"map.yaml: line 1", "found a list"}},
        BadInput{"AManifest",
                 "files: [a.csv]",
                 {"map.yaml: line 1: expected a mapping, found a manifest", "without --mapping"}},
        BadInput{"FormatWithoutPlaces", "clock: {format: ISO}", {"(clock.format)", "%d/%m/%Y"}},
        BadInput{"TypoInAKey",
                 "\nchanels: {torque_Nm: tau}",
                 {"map.yaml: line 2 (chanels): unknown key 'chanels'",
                  "one of joints, channels, derive", "Did you mean 'channels'?"}},
        BadInput{"TypoInAnInnerKey",
                 "clock: {rebild: true}",
                 {"map.yaml: line 1 (clock.rebild)", "Did you mean 'rebuild'?"}},
        BadInput{
            "KeyTwice", "drop: [tau]\ndrop: [run]", {"map.yaml: line 2", "'drop' is given twice"}},
        BadInput{"UnknownColumn",
                 "channels: {torque_Nm: tua}",
                 {"map.yaml: channels.torque_Nm: log.csv has no column 'tua'",
                  "t_s, pos_deg, tau, run", "Did you mean 'tau'?"}},
        BadInput{"UnknownUnit",
                 "channels: {torque_Nm: {from: tau, unit: furlong}}",
                 {"map.yaml: line 1 (channels.torque_Nm.unit)", "_Nm", "'furlong'"}},
        BadInput{"NewNameWithoutUnit",
                 "channels: {torque: tau}",
                 {"(channels.torque)", "ends in a unit", "'torque'"}},
        BadInput{"AnotherQuantity",
                 "channels: {torque_Nm: pos_deg}",
                 {"map.yaml: channels.torque_Nm", "'pos_deg' in deg", "'scale:'"}},
        BadInput{"NoFrom", "channels: {torque_Nm: {unit: Nm}}", {"the key 'from' is missing"}},
        BadInput{"SignTwo",
                 "channels: {torque_Nm: {from: tau, sign: 2}}",
                 {"expected 1 or -1, found '2'"}},
        BadInput{"ScaleIsNoNumber",
                 "channels: {torque_Nm: {from: tau, scale: big}}",
                 {"(channels.torque_Nm.scale)", "'big'"}},
        BadInput{
            "ScaleZero", "channels: {torque_Nm: {from: tau, scale: 0}}", {"a number other than 0"}},
        BadInput{"DecimalOfAnotherMark", "decimal: dot", {"(decimal)", "comma or point"}},
        BadInput{"RateInNewton", "rate: 5N", {"map.yaml: line 1 (rate)", "in Hz", "'5N'"}},
        BadInput{"NegativeRate", "rate: -5", {"a positive number"}},
        BadInput{"RateBesideAClock",
                 "{rate: 5Hz, drop: [run], channels: {torque_Nm: tau}}",
                 {"map.yaml: rate: the log has a clock of its own", "drop: [t_s]"}},
        BadInput{"ZeroWithoutAWay",
                 "zero: [{channel: pos_rad}]",
                 {"either 'first: 0.1s' or 'mid_range: true'"}},
        BadInput{"ZeroOfAnUnknownChannel",
                 "{zero: [{channel: pso_rad, first: 1s}], channels: {torque_Nm: tau}, drop: [run], "
                 "clock: {rebuild: true}}",
                 {"map.yaml: zero: there is no channel 'pso_rad'", "pos_rad",
                  "Did you mean 'pos_rad'?"}},
        BadInput{"ZeroOfADerivedChannel",
                 "{zero: [{channel: b_rad, first: 1s}], derive: {b_rad: pos_rad}, channels: "
                 "{torque_Nm: tau}, "
                 "drop: [run], clock: {rebuild: true}}",
                 {"'b_rad' is derived", "Name the channels that it is computed from"}},
        BadInput{
            "HoldOfAnUnknownChannel",
            "{hold: [force_N], channels: {torque_Nm: tau}, drop: [run], clock: {rebuild: true}}",
            {"map.yaml: hold: there is no channel 'force_N'"}},
        BadInput{"SplitByUnknownColumn",
                 "{split_by: test_nr, channels: {torque_Nm: tau}}",
                 {"map.yaml: split_by: log.csv has no column 'test_nr'"}},
        BadInput{"KeepWithoutSplit", "keep: [1]", {"split_by: COLUMN beside keep"}},
        BadInput{"KeepOfNothing",
                 "{split_by: run, keep: [5], channels: {torque_Nm: tau}, clock: {rebuild: true}}",
                 {"map.yaml: keep: run is never 5 in log.csv"}},
        BadInput{"ClockBothWays",
                 "clock: {rebuild: true, resample: 5Hz}",
                 {"either rebuild or resample"}},
        BadInput{"StrayTooFar",
                 "{clock: {rebuild: true, max_stray_steps: 0.1}, channels: {torque_Nm: tau}, drop: "
                 "[run]}",
                 {"log.csv: line 4, column 1 (t_s)", "at most 0.1 stamp steps of 0.015 s",
                  "max_stray_steps: 1"}},
        BadInput{"DeriveFromNothing",
                 "{derive: {b_rad: 2 * nothing_rad}, channels: {torque_Nm: tau}, drop: [run], "
                 "clock: {rebuild: true}}",
                 {"there is no channel 'nothing_rad'"}},
        BadInput{"DeriveInDegrees", "derive: {b_deg: pos_rad}", {"the SI name b_rad"}},
        BadInput{"DeriveNoExpression",
                 "{derive: {b_rad: 2 * (pos_rad}, channels: {torque_Nm: tau}, drop: [run], clock: "
                 "{rebuild: true}}",
                 {"2 * (pos_rad"}}),
    rule_of);

class BrokenManifest : public testing::TestWithParam<BadInput> {};

TEST_P(BrokenManifest, IsRefusedWithPlaceAndReason) {
  setenv("TORSIO_TEST_NO_FOLDER", "/no/such/folder", 1);
  const TemporaryFolder folder;
  static_cast<void>(folder.file("a.csv", "t_s,a_rad,torque_Nm\n0,1,2\n1,2,3\n2,3,4\n"));
  const std::string manifest = folder.file("set.yaml", GetParam().input);
  expect_says(message_of([&] { static_cast<void>(load_dataset({manifest}, {})); }),
              GetParam().says);
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenManifest,
    testing::Values(
        BadInput{"AMapping",
                 "channels: {torque_Nm: tau}",
                 {"set.yaml: line 1: expected a recording, or a manifest", "found a mapping",
                  "--mapping"}},
        BadInput{"AFileTwice", "files: [a.csv, ./a.csv]", {"a.csv: the recording is given twice"}},
        BadInput{"NoFiles", "target: torque_Nm", {"set.yaml: line 1", "'files' is missing"}},
        BadInput{"EmptyFiles", "files: []", {"at least one file"}},
        BadInput{"TypoInAKey",
                 "files: [a.csv]\nsample_rate: 5",
                 {"set.yaml: line 2 (sample_rate): unknown key", "sample_rate_Hz"}},
        BadInput{"UnknownRole",
                 "files: [{file: a.csv, role: testing}]",
                 {"(files[0].role)", "train, validation or test"}},
        BadInput{"RoleAndSplit",
                 "files: [{file: a.csv, role: test, split: {contiguous: 0.5}}]",
                 {"either role or split"}},
        BadInput{
            "HalfASplit", "{split: {interleaved_blocks: 5}, files: [a.csv]}", {"test_every: 5"}},
        BadInput{"SplitTooFine",
                 "{split: {interleaved_blocks: 60, test_every: 5}, files: [a.csv]}",
                 {"a: split: 3 samples cannot be cut into 60 blocks"}},
        BadInput{"MissingFile", "files: [b.csv]", {"b.csv: cannot be opened: No such file"}},
        BadInput{"MissingRoot",
                 "{root: ['${TORSIO_TEST_UNSET}', nowhere], files: [a.csv]}",
                 {"set.yaml (root)", "nowhere", "export TORSIO_DATA"}},
        BadInput{"VariableThatNamesNoFolder",
                 "{root: ['${TORSIO_TEST_NO_FOLDER}/set', .], files: [a.csv]}",
                 {"the environment variable TORSIO_TEST_NO_FOLDER: it does not name a folder",
                  "found /no/such/folder", "unset TORSIO_TEST_NO_FOLDER"}},
        BadInput{
            "MissingTarget",
            "{target: torqe_Nm, files: [a.csv]}",
            {"there is no channel 'torqe_Nm'", "a_rad, torque_Nm", "Did you mean 'torque_Nm'?"}},
        BadInput{
            "MissingMapping", "{mapping: b.yaml, files: [a.csv]}", {"b.yaml: cannot be opened"}},
        BadInput{"ConditionWithoutUnit",
                 "files: [{file: a.csv, conditions: {support: 3}}]",
                 {"(files[0].conditions.support)", "ends in a unit"}},
        BadInput{"InputsCutAtACommaInParentheses",
                 "{input_sets: {x: [lag(a_rad, 3)]}, files: [a.csv]}",
                 {"(input_sets.x): the parentheses do not match", "one line"}},
        BadInput{"LatencyOfAnInput",
                 "{mapping: {latency: {a_rad: 2s}}, files: [a.csv]}",
                 {"latency.a_rad: only the target may be shifted", "torque_Nm"}}),
    rule_of);

TEST(BrokenFile, AMissingFileIsNamed) {
  expect_says(message_of([] { static_cast<void>(load_dataset({"/nowhere/x.csv"}, {})); }),
              {"/nowhere/x.csv: cannot be opened: No such file", "Check the path"});
}

TEST(BrokenFile, ADirectoryIsNoFile) {
  const TemporaryFolder folder;
  expect_says(message_of([&] { static_cast<void>(read_csv(folder.path(""))); }),
              {"expected a file, found a directory"});
}

TEST(BrokenFile, RatesOfTheCommandLineAreChecked) {
  const LoadOptions negative{.mapping = {}, .rate_Hz = -1.0, .target = {}};
  expect_says(message_of([&] { static_cast<void>(load_recordings("x.csv", negative)); }),
              {"--rate"});
}

/// Reads what a thread writes into a pipe, and tells how much of it was taken.
std::string message_from_pipe(const std::string& start, const std::string& endless,
                              std::size_t& bytes_taken, const CsvOptions& options = {}) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  std::size_t written = 0;
  std::thread writer([&] {
    std::string block = start;
    while (written < std::size_t{10} << 30) {
      const ssize_t done = write(ends[1], block.data(), block.size());
      if (done < 0) break;
      written += static_cast<std::size_t>(done);
      block = endless;
    }
    close(ends[1]);
  });
  const std::string path = "/dev/fd/" + std::to_string(ends[0]);
  const std::string message = message_of([&] { static_cast<void>(read_csv(path, options)); });
  close(ends[0]);
  writer.join();
  bytes_taken = written;
  return message;
}

class EndlessPipe : public testing::Test {
 protected:
  void SetUp() override { old_ = signal(SIGPIPE, SIG_IGN); }
  void TearDown() override { signal(SIGPIPE, old_); }

 private:
  void (*old_)(int) = nullptr;
};

TEST_F(EndlessPipe, OfZerosFailsWithinTheFirstMegabyte) {
  std::size_t taken = 0;
  const std::string message = message_from_pipe("", std::string(65536, '\0'), taken);
  expect_says(message, {"line 1", "no end of the line"});
  EXPECT_LT(taken, std::size_t{1} << 20);
}

TEST_F(EndlessPipe, OfRowsStopsAtTheLimitOfValues) {
  std::size_t taken = 0;
  CsvOptions options;
  options.limits.values = 1000000;
  std::string rows;
  for (int i = 0; i < 10000; ++i) rows += "0,0,0\n";
  const std::string message = message_from_pipe("a_1,b_1,c_1\n", rows, taken, options);
  expect_says(message, {"more than 1000000 numbers", "Cut the log"});
  EXPECT_LT(taken, std::size_t{4} << 20);
}

}  // namespace
}  // namespace torsio
