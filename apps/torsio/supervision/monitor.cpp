#include "report/monitor.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "supervision/monitor_calibrate.hpp"
#include "supervision/monitor_simulated.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/files/monitor_file.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct MonitorFlags {
  std::vector<std::string> files;  ///< a monitor file, then recordings
  std::string serial;
  std::string output;
  bool calibrate = false;
  CalibrateFlags calibration;
  SimulatedMonitorFlags simulated;
  DataFlags data;
  JsonOutput json;
  ReportOutput report;
};

/// What a call does, and the options that it uses.
struct Mode {
  std::string_view name;
  std::vector<std::string_view> options;
};

Mode mode_of(const MonitorFlags& flags) {
  const SimulatedMonitorFlags& simulated = flags.simulated;
  if (simulated.is_campaign)
    return {"--campaign",
            {"--campaign", "--actuator", "--monitors", "--fault-free-calibration-hours",
             "--injections", "--fault-free-hours", "--low-load-hours", "--classes", "--threads",
             "--resume", "--electrical", "--seed", "--json"}};
  if (simulated.accuracy_runs > 0)
    return {"--accuracy",
            {"--accuracy", "--actuator", "--monitors", "--fault-free-calibration-hours", "--seed",
             "--json"}};
  const bool is_simulated = !simulated.actuators.empty();
  if (flags.calibrate && is_simulated)
    return {"--calibrate --actuator",
            {"--calibrate", "--actuator", "--fault-free-calibration-hours",
             "--false-alarms-per-hour", "--output", "--json"}};
  if (flags.calibrate)
    return {"--calibrate",
            {"FILES", "--calibrate", "--mapping", "--rate", "--output", "--device-serial",
             "--source", "--signal", "--false-alarms-per-hour", "--extrapolate",
             "--least-threshold", "--required", "--persistence", "--valid-until", "--json"}};
  if (is_simulated)
    return {"--actuator",
            {"FILES", "--actuator", "--monitors", "--fault-free-calibration-hours", "--inject",
             "--faults", "--duration", "--seed", "--output", "--plot", "--plot-figure",
             "--plot-size", "--json", "--report"}};
  return {"a monitor file with recordings",
          {"FILES", "--mapping", "--rate", "--output", "--plot", "--plot-figure", "--plot-size",
           "--device-serial", "--json", "--report"}};
}

/// @throws torsio::UsageError for an option that this call would not use.
void check_options(const CLI::App& verb, const MonitorFlags& flags) {
  const Mode mode = mode_of(flags);
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_name();
    if (option->empty() || std::ranges::find(mode.options, name) != mode.options.end()) continue;
    throw torsio::UsageError(
        {.place = fmt::format("torsio monitor {}", mode.name),
         .expected = fmt::format("only what it uses: {}", fmt::join(mode.options, ", ")),
         .found = name});
  }
}

std::vector<torsio::MonitorReplay> replay_recordings(MonitorFlags& flags,
                                                     torsio::MonitorSettings& settings) {
  if (flags.files.size() < 2)
    throw torsio::UsageError(
        {.place = "torsio monitor",
         .expected = "a monitor file and recordings, or --actuator",
         .found = fmt::format("{} files", flags.files.size()),
         .advice = "torsio monitor joint.monitor.json log.csv; a monitor file is written with "
                   "torsio monitor --calibrate"});
  const std::string monitor_file = flags.files.front();
  for (const char* const ending : {".csv", ".gz", ".yaml"})
    if (monitor_file.ends_with(ending))
      throw torsio::UsageError({.place = "torsio monitor",
                                .expected = "the monitor file first, then recordings",
                                .found = monitor_file,
                                .advice = "torsio monitor joint.monitor.json log.csv"});
  flags.data.recordings.assign(flags.files.begin() + 1, flags.files.end());
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {monitor_file});
  const torsio::MonitoredTorque monitored =
      torsio::load_monitor(monitor_file, {.serial = flags.serial});
  const torsio::MonitorFile file = torsio::read_monitor(monitor_file);
  if (flags.serial.empty() && !file.device_serial.empty())
    remark(
        fmt::format("the monitor is that of device {}; --device-serial checks that the recordings "
                    "are of it\n",
                    file.device_serial));
  use_common_mapping(flags.data, torsio::model_mappings(monitor_file));
  ProgressBar progress;
  const torsio::Dataset dataset =
      flags.data.load_inputs(monitored.raw_inputs(), progress.listener());
  settings = monitored.monitor().settings();
  std::vector<torsio::MonitorReplay> replays;
  replays.reserve(dataset.records.size());
  for (const torsio::DatasetRecord& record : dataset.records)
    replays.push_back(torsio::replay_monitor(monitored, record.recording, progress.listener()));
  return replays;
}

std::vector<torsio::MonitorReplay> replay_joint(MonitorFlags& flags,
                                                torsio::MonitorSettings& settings) {
  if (flags.files.size() > 1)
    throw torsio::UsageError({.place = "torsio monitor --actuator",
                              .expected = "at most a monitor file",
                              .found = fmt::format("{} files", flags.files.size())});
  const std::string monitor_file = flags.files.empty() ? "" : flags.files.front();
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {monitor_file});
  return {replay_simulated(flags.simulated, monitor_file, settings)};
}

void replay(MonitorFlags& flags) {
  require_ending("--output", flags.output, {".csv", ".gz"});
  torsio::MonitorSettings settings;
  const std::vector<torsio::MonitorReplay> replays = flags.simulated.actuators.empty()
                                                         ? replay_recordings(flags, settings)
                                                         : replay_joint(flags, settings);
  if (!flags.output.empty()) {
    std::vector<torsio::EstimatedRecording> estimated;
    estimated.reserve(replays.size());
    for (const torsio::MonitorReplay& each : replays) estimated.push_back(each.estimated);
    torsio::write_estimates(estimated, flags.output, torsio::FaultColumn::number);
  }
  if (flags.json.wants_tables() && !is_standard_output(flags.output))
    print(torsio::replays_text(replays, settings));
  flags.json.write(torsio::replays_json(replays, settings));
  if (flags.report.is_wanted()) flags.report.write(torsio::monitor_report(replays, settings));
}

void run(const CLI::App& verb, MonitorFlags& flags) {
  check_options(verb, flags);
  flags.simulated.campaign.seed = flags.simulated.seed;
  if (flags.simulated.is_campaign || flags.simulated.accuracy_runs > 0) {
    DataFlags().check_outputs({flags.json.destination});
    return flags.simulated.is_campaign ? run_campaign(flags.simulated, flags.json)
                                       : run_accuracy(flags.simulated, flags.json);
  }
  if (!flags.calibrate) return replay(flags);
  if (flags.output.empty())
    throw torsio::UsageError({.place = "--calibrate",
                              .expected = "-o FILE, the monitor file to write",
                              .found = "none"});
  if (!flags.simulated.actuators.empty()) {
    if (!verb.get_option("--false-alarms-per-hour")->empty())
      flags.simulated.false_alarms_per_hour = flags.calibration.false_alarms_per_hour;
    return calibrate_simulated(flags.simulated, flags.output, flags.json);
  }
  flags.data.recordings = flags.files;
  flags.calibration.device_serial = flags.serial;
  flags.calibration.output = flags.output;
  calibrate(flags.calibration, flags.data, flags.json);
}

}  // namespace

void add_monitor(CLI::App& app) {
  auto flags = std::make_shared<MonitorFlags>();
  CLI::App* verb = app.add_subcommand(
      "monitor", "compare the torques of several sources and find faults of sensors and parts");
  verb->footer(
      "Example: torsio monitor joint.monitor.json robot_log.csv -o torque.csv\n"
      "Calibrate: torsio monitor --calibrate --source current=current.safetensors:current_sensor "
      "\\\n"
      "             --source spring=spring.safetensors:joint_encoder sound1.csv sound2.csv \\\n"
      "             -o joint.monitor.json\n"
      "A stop and a joint that was never ready are results: the exit code is 0, as for a joint "
      "without\na finding; scripts read stopped_at_s and watching_from_s of --json.\n"
      "docs/robot/safety.md has the checks, what each detects, and what none detects.");
  verb->add_option("FILES", flags->files,
                   "a monitor file and recordings; with --calibrate: recordings without a fault");
  flags->data.add_model_mapping(*verb);
  verb->add_option("-o,--output", flags->output,
                   "CSV file with the torques and the state of the monitor; with --calibrate: the "
                   "monitor file to write");
  verb->add_option("--device-serial", flags->serial,
                   "serial number of the joint; a monitor of another one is refused");
  verb->add_flag("--calibrate", flags->calibrate,
                 "choose the limits from recordings without a fault and write a monitor file");
  CalibrateFlags& calibration = flags->calibration;
  verb->add_option(
          "--source", calibration.sources,
          "NAME=MODEL or NAME=MODEL:PART+PART: a model file that estimates the torque, and "
          "the parts on which it depends")
      ->allow_extra_args(false);
  verb->add_option(
          "--signal", calibration.signals,
          "a channel or expression to watch, or 'A moves with B' for one that cannot remain "
          "at one value while B moves; default: every channel of the sources, each angle with the "
          "one before it in the drive, and the deflection")
      ->allow_extra_args(false);
  verb->add_option("--false-alarms-per-hour", calibration.false_alarms_per_hour,
                   "wanted rate; T hours of recordings support 3 / T or more; of a simulated joint "
                   "1e-4, extrapolated, unless it is given")
      ->capture_default_str();
  verb->add_flag("--extrapolate", calibration.extrapolate,
                 "permit a smaller rate than the recordings support; the file then states it");
  verb->add_option("--least-threshold", calibration.least_threshold,
                   "no pair of sources has a smaller one, as 1.4Nm; for what the recordings do not "
                   "contain, as another temperature");
  verb->add_option(
      "--required", calibration.required,
      "disagreement that has to be found, as 8Nm: the monitor is not ready while error bars "
      "make a threshold larger than 0.8 times this (default: no limit)");
  verb->add_option(
      "--persistence", calibration.persistence,
      "how long a difference must exceed its threshold, as 8ms (default: 5ms); filters of the "
      "sources spread a spike over their settling time");
  verb->add_option("--valid-until", calibration.valid_until,
                   "last day of the calibration, as 2027-11-22; later the file is refused");
  SimulatedMonitorFlags& simulated = flags->simulated;
  verb->add_option(
          "--actuator", simulated.actuators,
          "a simulated joint at work in place of recordings; with --campaign and --accuracy "
          "several, separated by commas (default: one of each)")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option(
      "--monitors", simulated.monitors,
      "folder with the monitors of simulated joints; one that is missing is calibrated and "
      "written there");
  verb->add_option("--fault-free-calibration-hours", simulated.fault_free_hours,
                   "work of a simulated joint from which its thresholds are chosen")
      ->capture_default_str();
  verb->add_option("--inject", simulated.injections,
                   "a fault: kt=-20%@3s, gear_angle=1deg@2s, current=gain:-20%@2s, "
                   "motor_angle=freeze@2s..4s; more than once")
      ->allow_extra_args(false);
  verb->add_option("--faults", simulated.faults, "YAML file with a schedule of faults");
  verb->add_option("--duration", simulated.duration, "of the work of a simulated joint")
      ->capture_default_str();
  verb->add_flag("--campaign", simulated.is_campaign,
                 "random faults in simulated joints, and joints at work without a fault");
  verb->add_option("--accuracy", simulated.accuracy_runs,
                   "errors of the combined torque in so many runs of each simulated joint");
  torsio::CampaignSettings& campaign = simulated.campaign;
  verb->add_option("--injections", campaign.injections, "of each class and actuator")
      ->capture_default_str();
  verb->add_option("--fault-free-hours", campaign.fault_free_hours,
                   "of joints at work, of all actuators together")
      ->capture_default_str();
  verb->add_option("--low-load-hours", campaign.low_load_hours,
                   "of joints under little load whose spring has another hysteresis than its model")
      ->capture_default_str();
  verb->add_option("--classes", campaign.classes,
                   "only those whose name begins so, separated by commas")
      ->delimiter(',');
  verb->add_option("--threads", campaign.threads, "0: as many as the machine has")
      ->capture_default_str();
  verb->add_option(
      "--resume", campaign.resume,
      "file to which results are appended; a campaign that was stopped continues with it");
  verb->add_flag("--electrical", campaign.is_electrical,
                 "the motors have windings, an inverter and current control");
  add_seed(*verb, simulated.seed, "of the work of simulated joints, and of a campaign");
  flags->json.add(*verb, "the result");
  flags->report.add(*verb);
  verb->callback([flags, verb] { run(*verb, *flags); });
}
