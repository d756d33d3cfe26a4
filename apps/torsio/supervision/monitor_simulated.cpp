#include "supervision/monitor_simulated.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/fault_campaign.hpp"
#include "report/monitor.hpp"
#include "sim/campaign/fused_accuracy.hpp"
#include "sim/campaign/monitored_duty.hpp"
#include "sim/campaign/simulated_monitor.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/files/monitor_file.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

namespace {

constexpr std::uint64_t kAccuracySeed = 5000;  // no recording of a calibration has such a seed
constexpr double kAccuracyRun_s = 180.0;

torsio::SimulatedCalibration calibration(const SimulatedMonitorFlags& flags) {
  return {.fault_free_hours = flags.fault_free_hours,
          .false_alarms_per_hour = flags.false_alarms_per_hour};
}

torsio::SimulatedMonitor calibrated(const SimulatedMonitorFlags& flags,
                                    const torsio::DataSheet& sheet) {
  ProgressBar progress;
  return torsio::calibrate_simulated(sheet, calibration(flags), progress.listener());
}

/// Letters that every file system takes.
std::string file_name(const torsio::DataSheet& sheet) {
  std::string name = torsio::full_name(sheet);
  std::ranges::replace_if(
      name, [](char letter) { return letter == ':' || letter == '#'; }, '_');
  return name + ".monitor.json";
}

/// From the folder, where it is calibrated and written if it is not there yet.
torsio::MonitoredTorque monitored(const SimulatedMonitorFlags& flags,
                                  const torsio::DataSheet& sheet) {
  if (flags.monitors.empty()) {
    remark(fmt::format("calibrating the monitor of {}; --monitors FOLDER keeps it\n",
                       torsio::full_name(sheet)));
    return calibrated(flags, sheet).monitored();
  }
  const std::filesystem::path path = std::filesystem::path(flags.monitors) / file_name(sheet);
  if (!std::filesystem::exists(path)) {
    // Before the calibration, which lasts minutes.
    std::error_code failed;
    std::filesystem::create_directories(flags.monitors, failed);
    if (failed)
      throw torsio::UsageError({.place = "--monitors",
                                .expected = "a folder, or one that can be created",
                                .found = flags.monitors + ": " + failed.message()});
    require_writable(path.string());
    remark(fmt::format("calibrating the monitor of {}: {}\n", torsio::full_name(sheet),
                       path.string()));
    torsio::save_simulated_monitor(path, calibrated(flags, sheet), torsio::full_name(sheet));
  }
  return torsio::load_monitor(path, {.serial = torsio::full_name(sheet)});
}

torsio::DataSheet one_actuator(const SimulatedMonitorFlags& flags) {
  if (flags.actuators.size() != 1)
    throw torsio::UsageError({.place = "--actuator",
                              .expected = "one simulated actuator",
                              .found = fmt::format("{}", flags.actuators.size())});
  return torsio::find_data_sheet(flags.actuators.front());
}

/// Every actuator, as a specimen with tolerances; two springs with other friction than that of training.
std::vector<std::string> actuators_of(const SimulatedMonitorFlags& flags) {
  if (!flags.actuators.empty()) return flags.actuators;
  return {"dfki-28#07",        "dfki-50:bouc-wen#07", "dfki-120:lugre#07", "dfki-300#07",
          "harmonic-drive#07", "elastomer#07",        "rubber-clutch#07"};
}

}  // namespace

void calibrate_simulated(const SimulatedMonitorFlags& flags, const std::string& output,
                         const JsonOutput& json) {
  const torsio::DataSheet sheet = one_actuator(flags);
  require_writable(output);
  const torsio::SimulatedMonitor monitor = calibrated(flags, sheet);
  torsio::save_simulated_monitor(output, monitor, torsio::full_name(sheet));
  if (json.wants_tables()) print(torsio::calibration_text(monitor.calibrated));
  json.write(torsio::calibration_json(monitor.calibrated));
}

torsio::MonitorReplay replay_simulated(const SimulatedMonitorFlags& flags,
                                       const std::string& monitor_file,
                                       torsio::MonitorSettings& settings) {
  const torsio::DataSheet sheet = one_actuator(flags);
  torsio::DutyRun work{
      .seed = flags.seed,
      .duration_s = torsio::signed_quantity_with_unit(flags.duration, "s", "--duration")};
  if (!flags.faults.empty()) work.faults = torsio::read_fault_schedule(flags.faults, sheet);
  for (const std::string& injection : flags.injections)
    work.faults.faults.push_back(torsio::parse_injection(injection, sheet));
  const torsio::MonitoredTorque monitor =
      monitor_file.empty()
          ? monitored(flags, sheet)
          : torsio::load_monitor(monitor_file, {.serial = torsio::full_name(sheet)});
  settings = monitor.monitor().settings();
  ProgressBar progress;
  return torsio::monitored_duty(sheet, std::move(work), monitor, progress.listener());
}

void run_campaign(const SimulatedMonitorFlags& flags, const JsonOutput& json) {
  std::vector<torsio::CampaignGroup> groups;
  for (const std::string& name : actuators_of(flags)) {
    const torsio::DataSheet sheet = torsio::find_data_sheet(name);
    torsio::CampaignGroup group{.name = torsio::full_name(sheet),
                                .sheet = sheet,
                                .monitor = [torque = monitored(flags, sheet)] { return torque; }};
    const std::filesystem::path file = std::filesystem::path(flags.monitors) / file_name(sheet);
    group.monitor_hash = flags.monitors.empty() ? torsio::calibration_hash(calibration(flags))
                                                : torsio::model_hash(file);
    groups.push_back(std::move(group));
  }
  ProgressBar progress;
  const torsio::CampaignResult result =
      torsio::run_fault_campaign(groups, flags.campaign, progress.listener());
  if (json.wants_tables()) print(torsio::fault_campaign_text(result));
  json.write(torsio::fault_campaign_json(result));
}

void run_accuracy(const SimulatedMonitorFlags& flags, const JsonOutput& json) {
  std::vector<torsio::FusedAccuracy> rows;
  rows.reserve(actuators_of(flags).size());
  for (const std::string& name : actuators_of(flags)) {
    const torsio::DataSheet sheet = torsio::find_data_sheet(name);
    const torsio::MonitoredTorque monitor = monitored(flags, sheet);
    ProgressBar progress;
    rows.push_back(torsio::fused_accuracy(sheet, monitor, flags.accuracy_runs,
                                          flags.seed + kAccuracySeed, kAccuracyRun_s,
                                          progress.listener()));
  }
  if (json.wants_tables()) print(torsio::accuracy_text(rows));
  json.write(torsio::accuracy_json(rows));
}
