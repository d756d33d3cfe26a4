#include "monitor_calibrate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <utility>

#include "output.hpp"
#include "progress_bar.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/files/monitor_file.hpp"
#include "torsio/report/monitor.hpp"

namespace {

constexpr double kTurn_rad = 6.283185307179586;

/// NAME=MODEL or NAME=MODEL:PART+PART
struct SourceFlag {
  torsio::TorqueSource source;
  std::string model;
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

SourceFlag source_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
    throw torsio::UsageError(
        {.place = "--source",
         .expected = "NAME=MODEL or NAME=MODEL:PART+PART",
         .found = "'" + text + "'",
         .advice = "for example --source spring=spring.safetensors:gear_encoder+joint_encoder"});
  SourceFlag flag{.source = {.name = text.substr(0, equals), .depends_on = {}},
                  .model = text.substr(equals + 1)};
  const std::size_t colon = flag.model.rfind(':');
  if (colon == std::string::npos) return flag;
  flag.source.depends_on = split(flag.model.substr(colon + 1), '+');
  flag.model.resize(colon);
  return flag;
}

/// EXPRESSION, or EXPRESSION with=EXPRESSION: the second one moves with the first one.
torsio::MonitoredSignal signal_of(const std::string& text) {
  constexpr std::string_view kWith = " moves with ";
  const std::size_t at = text.find(kWith);
  torsio::MonitoredSignal signal{.name = text.substr(0, at)};
  if (at != std::string::npos) signal.moves_with = text.substr(at + kWith.size());
  const bool is_channel = torsio::channels_of(signal.name) == std::vector{signal.name};
  if (is_channel && signal.name.ends_with("angle_rad")) signal.turn = kTurn_rad;
  return signal;
}

/// Every channel that a source uses, where no signal is named.
std::vector<torsio::MonitoredSignal> all_channels(const std::vector<torsio::Estimator>& sources) {
  std::vector<torsio::MonitoredSignal> signals;
  for (const torsio::Estimator& source : sources)
    for (const std::string& channel : source.raw_inputs())
      if (std::ranges::find(signals, channel, &torsio::MonitoredSignal::name) == signals.end())
        signals.push_back(signal_of(channel));
  return signals;
}

}  // namespace

void calibrate(CalibrateFlags& flags, DataFlags& data, const JsonOutput& json) {
  if (flags.sources.empty())
    throw torsio::UsageError(
        {.place = "--calibrate", .expected = "at least one --source NAME=MODEL", .found = "none"});
  std::vector<std::string> models;
  std::vector<torsio::Estimator> sources;
  torsio::MonitorPlan plan;
  torsio::MonitorFile file;
  file.device_serial = flags.device_serial;
  file.valid_until = flags.valid_until;
  const std::filesystem::path folder = std::filesystem::path(flags.output).parent_path();
  for (const std::string& text : flags.sources) {
    SourceFlag flag = source_of(text);
    const torsio::ModelFile model = torsio::load_model(flag.model, flags.device_serial);
    sources.push_back(torsio::make_estimator(model));
    plan.sources.push_back(std::move(flag.source));
    models.push_back(flag.model);
    const std::filesystem::path from =
        std::filesystem::absolute(folder.empty() ? std::filesystem::path(".") : folder);
    file.models.push_back(
        {.file = std::filesystem::relative(std::filesystem::absolute(flag.model), from).string(),
         .hash = torsio::model_hash(flag.model)});
    if (models.size() == 1) data.use_model_mapping(model.card.mapping, flag.model);
  }
  data.check_outputs({flags.output, json.destination}, models);
  require_writable(flags.output);
  for (const std::string& text : flags.signals) plan.signals.push_back(signal_of(text));
  if (plan.signals.empty()) plan.signals = all_channels(sources);
  std::vector<std::string> channels;
  for (const torsio::Estimator& source : sources)
    channels.insert(channels.end(), source.raw_inputs().begin(), source.raw_inputs().end());
  for (const torsio::MonitoredSignal& signal : plan.signals)
    for (const std::string& channel : torsio::channels_of(signal.name)) channels.push_back(channel);
  std::ranges::sort(channels);
  channels.erase(std::unique(channels.begin(), channels.end()), channels.end());

  ProgressBar progress;
  const torsio::Dataset dataset = data.load_inputs(channels, progress.listener());
  const torsio::CalibratedMonitor calibrated = torsio::calibrate_monitor(
      sources, plan, dataset,
      {.false_alarms_per_hour = flags.false_alarms_per_hour, .extrapolate = flags.extrapolate},
      progress.listener());
  file.redundancy = calibrated.redundancy;
  file.monitor = calibrated.monitor;
  file.fault_free_hours = calibrated.hours;
  file.false_alarms_per_hour = calibrated.false_alarms_per_hour;
  file.is_extrapolated = calibrated.is_extrapolated;
  for (const torsio::DatasetRecord& record : dataset.records)
    file.recordings.push_back(record.recording.source);
  torsio::save_monitor(flags.output, file);
  if (json.wants_tables()) print(torsio::calibration_text(calibrated));
  json.write(torsio::calibration_json(calibrated));
}
