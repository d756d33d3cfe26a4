#include "data/bam/bam_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include "data/log_summary.hpp"
#include "data/read_log.hpp"
#include "data/resample.hpp"
#include "report/log_summary.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

std::string header(const std::string& motor = "xl330") {
  return R"({"mass": 0.49, "length": 0.1, "kp": 400, "vin": 7.4, "motor": ")" + motor +
         R"(", "trajectory": "sin_sin", "entries": [)";
}

std::string entry(double t, double position, const std::string& load, bool is_on = true) {
  return R"({"position": )" + std::to_string(position) + R"(, "speed": 0.5, "load": )" + load +
         R"(, "input_volts": 7.3, "temp": 28, "timestamp": )" + std::to_string(t) +
         R"(, "goal_position": 0.25, "torque_enable": )" + (is_on ? "true" : "false") + "}";
}

/// Entries 6 ms and 4 ms apart, in turn, whose position grows evenly with time.
std::string log_of(const std::string& motor = "xl330", const std::string& load = "885") {
  std::string text = header(motor);
  double t = 0.004;
  for (int n = 0; n < 20; ++n) {
    text += (n == 0 ? "" : ", ") + entry(t, 0.1 + 2.0 * t, n == 3 ? "65093" : load, n < 10);
    t += n % 2 == 0 ? 0.006 : 0.004;
  }
  return text + "]}";
}

LogTable table_of_text(const std::string& text) {
  return read_bam_log(*bytes_in_memory(text, "run.json"), "run.json");
}

std::string bam_refusal(const std::string& text) {
  return error_message([&] { return table_of_text(text); });
}

/// A file in a folder of its own.
struct WrittenLog {
  TemporaryFolder folder;
  std::string path;
  explicit WrittenLog(const std::string& text, const std::string& name = "run.json")
      : path(folder.path(name)) {
    std::ofstream(path) << text;
  }
};

TEST(BamLog, IsRecognisedByItsEntries) {
  EXPECT_TRUE(is_bam_log(log_of()));
  EXPECT_TRUE(is_bam_log("\n { \"entries\": [{"));
  EXPECT_FALSE(is_bam_log("[{\"entries\": 1}]"));
  EXPECT_FALSE(is_bam_log("t_s,\"entries\""));
  EXPECT_FALSE(is_bam_log(""));
}

TEST(BamLog, HasChannelsConditionsAndLabels) {
  const LogTable table = table_of_text(log_of());
  EXPECT_THAT(table.column_names(),
              ElementsAre("t_s", "joint_angle_rad", "joint_speed_rad_s", "goal_angle_rad", "duty_1",
                          "drive_supply_V", "temperature_degC", "enabled_1"));
  EXPECT_EQ(table.rows(), 20U);
  EXPECT_THAT(table.conditions,
              ElementsAre(Pair("mass_kg", 0.49), Pair("length_m", 0.1), Pair("kp_1", 400.0),
                          Pair("supply_V", 7.4), Pair("arm_mass_kg", 0.0)));
  EXPECT_THAT(table.labels, ElementsAre(Pair("motor", "xl330"), Pair("trajectory", "sin_sin")));
  EXPECT_EQ(table.recording_name, "sin_sin_kp400");
}

TEST(BamLog, DecodesNegativePwmAndScalesItToDuty) {
  const LogTable table = table_of_text(log_of());
  const std::vector<double>& duty = table.find("duty_1")->values;
  EXPECT_DOUBLE_EQ(duty[2], 1.0);
  EXPECT_DOUBLE_EQ(duty[3], -443.0 / 885.0);
}

TEST(BamLog, KeepsALoadWhoseFullScaleIsNotKnown) {
  const LogTable table = table_of_text(log_of("sts3250", "300"));
  ASSERT_NE(table.find("load_1"), nullptr);
  EXPECT_EQ(table.find("duty_1"), nullptr);
  EXPECT_DOUBLE_EQ(table.find("load_1")->values[3], -443.0);
  ASSERT_EQ(table.notes.size(), 1U);
  EXPECT_THAT(table.notes[0],
              AllOf(HasSubstr("'sts3250'"), HasSubstr("443"), HasSubstr("duty_1: load_1/FULL")));
}

TEST(BamLog, TakesALoadWithinOneAsDuty) {
  std::string text = header("mx106") + entry(0.0, 0.0, "0.5") + ", " + entry(0.1, 0.0, "-0.25");
  const LogTable table = table_of_text(text + "]}");
  EXPECT_THAT(table.find("duty_1")->values, ElementsAre(0.5, -0.25));
}

TEST(BamLog, ReadsTheOlderNameOfTheArm) {
  const std::string text = R"({"mass": 1, "arm-mass": 0.2, "entries": [)" + entry(0.0, 0.0, "0") +
                           R"(], "kp": 32, "trajectory": "x"})";
  const LogTable table = table_of_text(text);
  EXPECT_THAT(table.conditions, testing::Contains(Pair("arm_mass_kg", 0.2)));
  EXPECT_EQ(table.recording_name, "x_kp32");
}

TEST(BamLog, IsInterpolatedOntoTwoHundredHertz) {
  const WrittenLog log(log_of());
  const std::vector<Recording> recordings = load_recordings(log.path);
  ASSERT_EQ(recordings.size(), 1U);
  const Recording& recording = recordings[0];
  EXPECT_EQ(recording.name(), "sin_sin_kp400");
  EXPECT_DOUBLE_EQ(recording.sample_rate_Hz(), 200.0);
  EXPECT_DOUBLE_EQ(recording.time_s(0), 0.004);
  const std::vector<double>& angle = recording.channel("joint_angle_rad").values;
  ASSERT_EQ(angle.size(), 20U);
  for (std::size_t n = 0; n < angle.size(); ++n)
    EXPECT_NEAR(angle[n], 0.1 + 2.0 * recording.time_s(n), 1e-6) << n;
  for (const double enabled : recording.channel("enabled_1").values)
    EXPECT_TRUE(enabled == 0.0 || enabled == 1.0) << enabled;
  EXPECT_NEAR(recording.channel("temperature_K").values[4], 301.15, 1e-9);
  EXPECT_THAT(recording.conditions(), testing::Contains("mass_kg"));
  EXPECT_THAT(recording.labels, testing::Contains(Pair("trajectory", "sin_sin")));
  EXPECT_THAT(recording.notes, testing::Contains(HasSubstr("interpolated onto 200 Hz")));
  EXPECT_EQ(resample(recording, 100.0).labels, recording.labels);
}

TEST(BamLog, TakesTheRateOfUserOrMapping) {
  const WrittenLog log(log_of());
  LoadOptions options;
  options.rate_Hz = 100.0;
  EXPECT_DOUBLE_EQ(load_recordings(log.path, options)[0].sample_rate_Hz(), 100.0);
  const std::string mapping = log.folder.path("clock.yaml");
  std::ofstream(mapping) << "clock: {resample: 250Hz}\n";
  options.rate_Hz.reset();
  options.mapping = mapping;
  const auto recordings = load_recordings(log.path, options);
  EXPECT_DOUBLE_EQ(recordings[0].sample_rate_Hz(), 250.0);
  EXPECT_THAT(recordings[0].notes, testing::Not(testing::Contains(HasSubstr("interpolated"))));
}

TEST(BamLog, KeepsRunsOfOneNameApart) {
  const WrittenLog log(log_of(), "2026-01-15_10h28m10.json");
  const std::string other = log.folder.path("2026-01-15_10h28m17.json");
  std::ofstream(other) << log_of();
  const std::string third = log.folder.path("third.json");
  std::ofstream(third) << R"({"kp": 800, "trajectory": "sin_sin", "entries": [)" +
                              entry(0.0, 0.0, "0") + "," + entry(0.005, 0.0, "0") + "]}";
  const Dataset dataset = load_inputs({log.path, other, third}, {"joint_angle_rad"});
  std::vector<std::string> names;
  for (const DatasetRecord& record : dataset.records) names.push_back(record.recording.name());
  EXPECT_THAT(names, ElementsAre("sin_sin_kp400_2026-01-15_10h28m10",
                                 "sin_sin_kp400_2026-01-15_10h28m17", "sin_sin_kp800"));
}

TEST(BamLog, LetsAManifestStateAnotherMass) {
  const WrittenLog log(log_of());
  const std::string manifest = log.folder.path("runs.yaml");
  std::ofstream(manifest) << "files: [{file: run.json, conditions: {mass_kg: 0.5}}]\n";
  LoadOptions options;
  options.target = "joint_angle_rad";
  const auto recordings = load_recordings(manifest, options);
  EXPECT_DOUBLE_EQ(recordings[0].channel("mass_kg").values[0], 0.5);
  EXPECT_DOUBLE_EQ(recordings[0].channel("length_m").values[0], 0.1);
}

TEST(BamLog, IsRefusedWhereItIsTruncated) {
  const std::string text = log_of();
  for (std::size_t size = 1; size < text.size(); size += 7)
    EXPECT_THAT(bam_refusal(text.substr(0, size)), HasSubstr("run.json: byte")) << size;
  EXPECT_THAT(bam_refusal(text.substr(0, text.size() - 2)), HasSubstr("after 20 whole entries"));
}

TEST(BamLog, IsRefusedWithThePlaceOfAWrongEntry) {
  const std::string good = entry(0.0, 0.0, "0");
  EXPECT_THAT(bam_refusal(header() + good + R"(, {"position": "x"}]})"),
              AllOf(HasSubstr("entry 2, position"), HasSubstr("a number"), HasSubstr("'x'")));
  EXPECT_THAT(bam_refusal(header() + good + R"(, {"position": 0, "timestamp": 1}]})"),
              HasSubstr("entry 2, speed"));
  EXPECT_THAT(bam_refusal(header() + R"({"position": 0, "timestamp": 1}, )" + good + "]}"),
              AllOf(HasSubstr("entry 2, speed"), HasSubstr("a further one")));
  EXPECT_THAT(bam_refusal(header() + R"({"position": 0}]})"), HasSubstr("entry 1, timestamp"));
  EXPECT_THAT(bam_refusal(header() + R"({"position": null, "timestamp": 1}]})"),
              HasSubstr("entry 1, position"));
  EXPECT_THAT(bam_refusal(header() + R"({"position": 0, "position": 1}]})"), HasSubstr("twice"));
  EXPECT_THAT(bam_refusal(header() + R"({"position": [1]}]})"), HasSubstr("found a list"));
  EXPECT_THAT(bam_refusal(header() + "3]}"), HasSubstr("an object for each sample"));
  EXPECT_THAT(bam_refusal(header() + R"({"position": 1e999, "timestamp": 1}]})"),
              HasSubstr("numbers that a double can hold"));
  EXPECT_THAT(bam_refusal(header() + R"({"torque_enable": 2}]})"), HasSubstr("true or false"));
}

TEST(BamLog, IsRefusedWithAnotherHeader) {
  EXPECT_THAT(bam_refusal(R"({"entries": []})"), HasSubstr("a list without entries"));
  EXPECT_THAT(bam_refusal(R"({"entries": 3})"), HasSubstr("run.json: entries"));
  EXPECT_THAT(bam_refusal(R"({"mass": "heavy", "entries": []})"),
              AllOf(HasSubstr("run.json: mass"), HasSubstr("'heavy'")));
  EXPECT_THAT(bam_refusal(R"({"mass": 1, "mass": 2})"), HasSubstr("it twice"));
  EXPECT_THAT(bam_refusal(R"({"a": {"entries": []}})"), HasSubstr("no list of entries"));
  EXPECT_THAT(bam_refusal("{\"a\": " + std::string(200, '[')), HasSubstr("levels of nesting"));
}

TEST(BamLog, NamesWhatItDoesNotRead) {
  const std::string text =
      R"({"kp": 1, "dt": [1, {"x": 2}], "entries": [{"position": 0, "timestamp": 0, "current": 3, "state": {"a": [1]}}]})";
  const LogTable table = table_of_text(text);
  EXPECT_EQ(table.rows(), 1U);
  EXPECT_THAT(table.notes, ElementsAre("fields of entries that are not read: current, state"));
}

TEST(BamLog, IsNamedWhereOtherJsonIsRefused) {
  const WrittenLog log(R"({"t": [0, 1], "q": [0, 1]})");
  EXPECT_THAT(error_message([&] { return load_recordings(log.path); }),
              AllOf(HasSubstr("JSON of BAM (an object with \"entries\")"), HasSubstr("read_json")));
}

TEST(ListLog, HasTheColumnsConditionsAndLabelsOfALogOfBam) {
  const WrittenLog log(log_of());
  const LogSummary summary = list_log(log.path);
  ASSERT_EQ(summary.topics.size(), 1U);
  EXPECT_EQ(summary.topics[0].messages, 20U);
  EXPECT_EQ(summary.topics[0].largest_gap_ns, 6'000'000);
  EXPECT_THAT(summary.topics[0].fields, testing::Contains("duty_1"));
  EXPECT_THAT(summary.conditions, testing::Contains(Pair("kp_1", 400.0)));
  EXPECT_THAT(log_summary_text(summary),
              AllOf(HasSubstr("condition mass_kg: 0.49"), HasSubstr("label trajectory: sin_sin")));
  EXPECT_THAT(log_summary_json(summary), HasSubstr("\"motor\": \"xl330\""));
  EXPECT_EQ(labels_text(load_recordings(log.path).front()),
            "sin_sin_kp400: motor xl330, trajectory sin_sin");
}

}  // namespace
}  // namespace torsio
