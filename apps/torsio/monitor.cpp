#include "torsio/report/monitor.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "data_flags.hpp"
#include "monitor_calibrate.hpp"
#include "output.hpp"
#include "progress_bar.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/files/monitor_file.hpp"
#include "verbs.hpp"

namespace {

struct MonitorFlags {
  std::vector<std::string> files;  ///< a monitor file, then recordings
  std::string serial;
  std::string output;
  std::string plot;
  bool calibrate = false;
  CalibrateFlags calibration;
  DataFlags data;
  JsonOutput json;
};

void replay(MonitorFlags& flags) {
  if (flags.files.size() < 2)
    throw torsio::UsageError(
        {.place = "torsio monitor",
         .expected = "a monitor file and recordings",
         .found = fmt::format("{} files", flags.files.size()),
         .advice = "torsio monitor joint.monitor.json log.csv; a monitor file is written with "
                   "torsio monitor --calibrate"});
  const std::string monitor_file = flags.files.front();
  flags.data.recordings.assign(flags.files.begin() + 1, flags.files.end());
  flags.data.check_outputs({flags.output, flags.plot, flags.json.destination}, {monitor_file});
  require_ending("--output", flags.output, {".csv", ".gz"});
  const torsio::MonitoredTorque monitored =
      torsio::load_monitor(monitor_file, {.serial = flags.serial});
  const std::filesystem::path model = std::filesystem::path(monitor_file).parent_path() /
                                      torsio::read_monitor(monitor_file).models.front().torque.file;
  flags.data.use_model_mapping(torsio::load_model(model).card.mapping, model.string());
  ProgressBar progress;
  const torsio::Dataset dataset =
      flags.data.load_inputs(monitored.raw_inputs(), progress.listener());
  std::vector<torsio::MonitorReplay> replays;
  for (const torsio::DatasetRecord& record : dataset.records)
    replays.push_back(torsio::replay_monitor(monitored, record.recording, progress.listener()));
  const torsio::MonitorSettings& settings = monitored.monitor().settings();
  if (!flags.output.empty()) {
    std::vector<torsio::EstimatedRecording> estimated;
    for (const torsio::MonitorReplay& each : replays) estimated.push_back(each.estimated);
    torsio::write_estimates(estimated, flags.output);
  }
  if (!flags.plot.empty()) write_text(flags.plot, torsio::replay_svg(replays.front(), settings));
  if (flags.json.wants_tables() && !is_standard_output(flags.output))
    print(torsio::replays_text(replays, settings));
  flags.json.write(torsio::replays_json(replays, settings));
}

void run(MonitorFlags& flags) {
  if (!flags.calibrate) return replay(flags);
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
      "docs/safety.md has the checks, what each detects, and what none detects.");
  verb->add_option("FILES", flags->files,
                   "a monitor file and recordings; with --calibrate: recordings without a fault")
      ->required();
  flags->data.add_model_mapping(*verb);
  verb->add_option("-o,--output", flags->output,
                   "CSV file with the torques and the state of the monitor; with --calibrate: the "
                   "monitor file to write");
  verb->add_option("--plot", flags->plot, "SVG file with the torques of the first recording");
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
  verb->add_option("--signal", calibration.signals,
                   "a channel or expression to watch, or 'A moves with B'; default: every channel "
                   "of the sources")
      ->allow_extra_args(false);
  verb->add_option("--false-alarms-per-hour", calibration.false_alarms_per_hour,
                   "wanted rate; T hours of recordings support 3 / T or more")
      ->capture_default_str();
  verb->add_flag("--extrapolate", calibration.extrapolate,
                 "permit a smaller rate than the recordings support; the file then states it");
  verb->add_option("--valid-until", calibration.valid_until,
                   "last day of the calibration, as 2027-11-22; later the file is refused");
  verb->add_option("--json", flags->json.destination,
                   "write the result as JSON to a file, or - for standard output");
  verb->callback([flags] { run(*flags); });
}
