#include "torsio/files/monitor_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "support/two_torques.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// A folder with two models and the monitor that belongs to them.
struct Written {
  TemporaryFolder folder;
  std::string path = folder.path("joint.monitor.json");
  MonitorFile file;

  Written() {
    const test::TwoTorques joint;
    save_model(folder.path("spring.safetensors"), joint.spring);
    save_model(folder.path("current.safetensors"), joint.current);
    file.device_serial = "J-07";
    file.valid_until = "2027-03-01";
    file.models = {
        {.torque = {"spring.safetensors", model_hash(folder.path("spring.safetensors"))},
         .error_bar_factor = 1.25},
        {.torque = {"current.safetensors", model_hash(folder.path("current.safetensors"))},
         .friction = {"spring.safetensors", model_hash(folder.path("spring.safetensors"))}}};
    file.redundancy.sources = test::TwoTorques::plan().sources;
    file.redundancy.correlation = file.monitor.correlation = {1.0, 0.25, 0.25, 1.0};
    file.monitor.sources = {"spring", "current"};
    file.monitor.signals = {{.name = "spring_deflection_rad", .lowest = -1.0, .highest = 1.0},
                            {.name = "motor_current_A",
                             .longest_age_s = 2e-3,
                             .turn = 0.5,
                             .moves_with = "spring_deflection_rad",
                             .largest_hidden_travel = 0.1}};
    file.monitor.pairs = {{.first = 0,
                           .second = 1,
                           .factor = 4.5,
                           .floor_Nm = 0.75,
                           .largest_armed_Nm = 2.5,
                           .drift_limit_s = 3.0}};
    file.monitor.actions[static_cast<std::size_t>(MonitorCheck::novelty)] = MonitorAction::off;
    file.fault_free_hours = 2.5;
    file.false_alarms_per_hour = 2.0;
    file.recordings = {{"a.csv", "ab12"}};
    save_monitor(path, file);
  }
  [[nodiscard]] std::string text() const {
    std::ifstream stream(path);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void replace(const std::string& from, const std::string& to) const {
    std::string changed = text();
    const std::size_t at = changed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    std::ofstream(path) << changed;
  }
  [[nodiscard]] std::string refusal(const MonitorFileOptions& options = {
                                        .today = "2026-11-22"}) const {
    return test::error_message([&] { static_cast<void>(load_monitor(path, options)); });
  }
};

TEST(MonitorFile, ComesBackAsItWasWritten) {
  const Written written;
  const MonitorFile read = read_monitor(written.path);
  EXPECT_EQ(read.device_serial, "J-07");
  EXPECT_EQ(read.models, written.file.models);
  EXPECT_EQ(read.redundancy.correlation, written.file.redundancy.correlation);
  EXPECT_EQ(read.redundancy.sources[1].depends_on, written.file.redundancy.sources[1].depends_on);
  EXPECT_EQ(read.monitor.signals[0].highest, 1.0);
  EXPECT_EQ(read.monitor.signals[0].longest_age_s, std::numeric_limits<double>::infinity());
  EXPECT_EQ(read.monitor.signals[1].moves_with, "spring_deflection_rad");
  EXPECT_EQ(read.monitor.pairs[0].factor, 4.5);
  EXPECT_EQ(read.monitor.pairs[0].largest_armed_Nm, 2.5);
  EXPECT_EQ(read.monitor.pairs[0].ceiling_Nm, std::numeric_limits<double>::infinity());
  EXPECT_EQ(read.monitor.actions, written.file.monitor.actions);
  save_monitor(written.folder.path("again.json"), read);
  std::ifstream again(written.folder.path("again.json"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), written.text());
}

TEST(MonitorFile, KeepsEverySetting) {
  Written written;
  MonitorSettings& settings = written.file.monitor;
  written.file.redundancy.error_bar_factors = {1.0, 1.5};
  settings.pairs[0].ceiling_Nm = 9.0;
  settings.pairs[0].drift_allowance = 0.8;
  settings.persistence_s = 0.006;
  settings.release_share = 0.7;
  settings.longest_loss_s = 0.4;
  settings.longest_fault_s = 0.017;
  settings.longest_warm_up_s = 3.0;
  settings.largest_novelty = 4.0;
  settings.longest_overrun = 4;
  settings.spikes_in_a_row = 3;
  settings.spike_memory_s = 0.05;
  settings.proof_s = 0.07;
  settings.longest_command_age_s = 0.25;
  save_monitor(written.path, written.file);
  EXPECT_EQ(read_monitor(written.path).redundancy.error_bar_factors,
            written.file.redundancy.error_bar_factors);
  const MonitorSettings read = read_monitor(written.path).monitor;
  const auto numbers = [](const MonitorSettings& of) {
    return std::vector<double>{of.pairs[0].factor,
                               of.pairs[0].floor_Nm,
                               of.pairs[0].ceiling_Nm,
                               of.pairs[0].largest_armed_Nm,
                               of.pairs[0].drift_allowance,
                               of.pairs[0].drift_limit_s,
                               of.signals[1].longest_age_s,
                               of.signals[1].turn,
                               of.signals[1].largest_hidden_travel,
                               of.persistence_s,
                               of.release_share,
                               of.longest_loss_s,
                               of.longest_fault_s,
                               of.longest_warm_up_s,
                               of.largest_novelty,
                               of.sample_period_s,
                               static_cast<double>(of.longest_overrun),
                               static_cast<double>(of.spikes_in_a_row),
                               of.spike_memory_s,
                               of.proof_s,
                               of.longest_command_age_s};
  };
  EXPECT_EQ(numbers(read), numbers(settings));
  EXPECT_EQ(read.actions, settings.actions);
  EXPECT_EQ(read.sources, settings.sources);
  EXPECT_EQ(read.correlation, settings.correlation);
}

TEST(MonitorFile, KnowsTheDaysOfTheCalendar) {
  for (const char* const date : {"2027-11-22", "2028-02-29", "2027-12-31"})
    EXPECT_TRUE(is_date(date)) << date;
  for (const char* const date : {"2027-13-22", "2027-02-30", "2027-00-00", "2027-02-29",
                                 "22.11.2027", "2027-1-22", "2027-11-2x", ""})
    EXPECT_FALSE(is_date(date)) << date;
  EXPECT_TRUE(is_date(today()));
  Written written;
  written.file.valid_until = "2027-02-30";
  EXPECT_THAT(test::error_message([&] { save_monitor(written.path, written.file); }),
              HasSubstr("a date as 2027-11-22"));
  written.replace("2027-03-01", "2027-13-01");
  EXPECT_THAT(written.refusal(), HasSubstr("'2027-13-01'"));
}

TEST(MonitorFile, HasEveryPairOfItsSourcesOnce) {
  const Written written;
  const std::string text = written.text();
  const std::size_t begin = text.find("\"pairs\": [") + 10;
  const std::string pair = text.substr(begin, text.find(" ],\n \"actions\"") - begin);
  const std::string entry = pair.substr(pair.find('{'));
  written.replace(entry, entry.substr(0, entry.rfind('}') + 1) + "," + entry);
  EXPECT_THAT(written.refusal(), HasSubstr("the pair spring, current once, found it 2 times"));
  std::ofstream(written.path) << text;
  written.replace(entry, "");
  EXPECT_THAT(written.refusal(), HasSubstr("the pair spring, current once, found none"));
}

TEST(MonitorFile, RefusesACompanionWithoutALimit) {
  const Written written;
  written.replace("\"largest_hidden_travel\": 0.1", "\"largest_hidden_travel\": null");
  EXPECT_THAT(written.refusal(), testing::AllOf(HasSubstr("motor_current_A: largest_hidden_travel"),
                                                HasSubstr("spring_deflection_rad may move")));
}

TEST(MonitorFile, ADamagedOneIsToBeCalibratedAgain) {
  const Written written;
  const std::string text = written.text();
  std::ofstream(written.path) << text.substr(0, text.size() / 2);
  EXPECT_THAT(written.refusal(), testing::AllOf(HasSubstr("calibrate the monitor again"),
                                                testing::Not(HasSubstr("fit the model"))));
}

TEST(MonitorFile, OfAnEarlierReleaseHasTheDefaultsOfWhatItLacks) {
  const Written written;
  for (const char* const entry :
       {" \"longest_warm_up_s\": 10.0,\n", " \"spike_memory_s\": 0.02,\n"})
    written.replace(entry, "");
  written.replace(",\n \"longest_command_age_s\": 1.0", "");
  const MonitorSettings read = read_monitor(written.path).monitor;
  EXPECT_EQ(read.longest_warm_up_s, 10.0);
  EXPECT_EQ(read.spike_memory_s, 0.02);
  EXPECT_EQ(read.longest_command_age_s, 1.0);
}

TEST(MonitorFile, BuildsTheMonitorOfARobot) {
  const Written written;
  MonitoredTorque monitored =
      load_monitor(written.path, {.rate_Hz = 1000.0, .serial = "J-07", .today = "2027-03-01"});
  EXPECT_THAT(monitored.raw_inputs(),
              testing::ElementsAre("spring_deflection_rad", "motor_current_A"));
  const std::vector<SignalSample> raw{{.value = 0.1}, {.value = 0.5}};
  const FusedTorque torque = monitored.step(0.0, raw);
  EXPECT_EQ(torque.fault, Fault::none);
  EXPECT_GT(torque.value_Nm, 1.0);  // 1 Nm of the spring; 1 Nm and its friction of the current
  EXPECT_EQ(monitored.estimates()[0].value, 1.0);
  EXPECT_EQ(monitored.estimates()[1].value, 2.0);
  EXPECT_NEAR(monitored.estimates()[0].std_dev, 0.25, 1e-12);
}

TEST(MonitorFile, IsRefusedOnAnotherDeviceAfterItsLastDayAndAtAnotherRate) {
  const Written written;
  EXPECT_THAT(written.refusal({.serial = "J-08", .today = "2026-11-22"}),
              testing::AllOf(HasSubstr("'J-08'"), HasSubstr("'J-07'")));
  EXPECT_THAT(written.refusal({.today = "2027-03-02"}), HasSubstr("expired on 2027-03-01"));
  EXPECT_THAT(written.refusal({.rate_Hz = 500.0, .today = "2026-11-22"}), HasSubstr("1000 Hz"));
  EXPECT_EQ(written.refusal({.serial = "J-07", .today = "2027-03-01"}), "");
  Written of_none;
  of_none.file.device_serial = "";
  save_monitor(of_none.path, of_none.file);
  EXPECT_THAT(of_none.refusal({.serial = "J-07", .today = "2026-11-22"}),
              HasSubstr("one that states no device"));
  EXPECT_EQ(of_none.refusal(), "");
  // Without a date in the options the clock of the machine counts.
  written.replace("2027-03-01", "2020-03-01");
  EXPECT_THAT(written.refusal({}), HasSubstr("expired on 2020-03-01"));
}

TEST(MonitorFile, IsRefusedWithAModelThatWasReplaced) {
  const Written written;
  save_model(written.folder.path("spring.safetensors"),
             test::slope_model("spring_deflection_rad", 10.5, 0.2));
  EXPECT_THAT(written.refusal(), testing::AllOf(HasSubstr("spring.safetensors"), HasSubstr("hash"),
                                                HasSubstr("calibrate the monitor again")));
}

TEST(MonitorFile, RefusesWhatIsNotAMonitorFile) {
  const Written written;
  const auto refused = [&](const std::string& text) {
    const std::string path = written.folder.file("broken.json", text);
    return test::error_message([&] { static_cast<void>(read_monitor(path)); });
  };
  EXPECT_THAT(refused(""), HasSubstr("broken.json"));
  EXPECT_THAT(refused("[]"), HasSubstr("an object"));
  EXPECT_THAT(refused("{}"), HasSubstr("a monitor file"));
  EXPECT_THAT(refused("{\"format\": \"torsio monitor\", \"format_version\": 9}"),
              HasSubstr("found 9"));
  EXPECT_THAT(refused(written.text().substr(0, 200)), HasSubstr("broken.json"));
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = written.text();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return refused(text.replace(at, from.size(), to));
  };
  EXPECT_THAT(changed("\"proof_s\"", "\"prof_s\""),
              testing::AllOf(HasSubstr("prof_s"), HasSubstr("proof_s")));
  EXPECT_THAT(changed("\"disagreement\": \"stop\"", "\"disagreement\": \"halt\""),
              HasSubstr("off, warn or stop"));
  EXPECT_THAT(changed("\"disagreement\": \"stop\"", "\"agreement\": \"stop\""),
              HasSubstr("'agreement'"));
  EXPECT_THAT(changed("\"first\": \"spring\"", "\"first\": \"gear\""),
              HasSubstr("one of spring, current"));
  EXPECT_THAT(changed("\"factor\": 4.5", "\"factor\": -4.5"), HasSubstr("factor"));
  EXPECT_THAT(changed("0.25", "7.25"), HasSubstr("correlation"));
  EXPECT_THAT(changed("2027-03-01", "March 2027"), HasSubstr("a date as"));
  EXPECT_THAT(changed("\"floor_Nm\": 0.75", "\"floor_Nm\": \"x\""), HasSubstr("a number"));
}

TEST(MonitorFile, IsNotWrittenIfItCouldNotBeRead) {
  const Written written;
  MonitorFile wrong = written.file;
  wrong.monitor.pairs[0].first = 7;
  const std::string before = written.text();
  EXPECT_NE(test::error_message([&] { save_monitor(written.path, wrong); }), "");
  wrong = written.file;
  wrong.valid_until = "soon";
  EXPECT_THAT(test::error_message([&] { save_monitor(written.path, wrong); }), HasSubstr("a date"));
  EXPECT_EQ(written.text(), before);
}

}  // namespace
}  // namespace torsio
