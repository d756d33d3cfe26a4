#include "evaluate/monitor/monitor_from_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr double kMonitoredTurn_rad = 2.0 * std::numbers::pi;

/// A model that states no device may be used on any. @throws Error for one of another device.
ModelFile model_of_device(const std::string& path, const std::string& device_serial) {
  ModelFile model = load_model(path);
  const std::string& serial = model.card.device_serial;
  if (!serial.empty() && !device_serial.empty() && serial != device_serial)
    throw Error({.place = path + ": device_serial",
                 .expected = "'" + device_serial + "'",
                 .found = "'" + serial + "'",
                 .advice = "calibrate the monitor with the models of this joint"});
  return model;
}

/// A model as the monitor file names it: relative to its folder.
MonitoredModel named_model(const std::string& model, const std::filesystem::path& folder) {
  if (model.empty()) return {};
  return {.file = std::filesystem::relative(std::filesystem::absolute(model), folder).string(),
          .hash = model_hash(model)};
}

MonitoredSignal monitored_signal(const std::string& text) {
  constexpr std::string_view kWith = " moves with ";
  const std::size_t at = text.find(kWith);
  MonitoredSignal signal{.name = text.substr(0, at)};
  if (at != std::string::npos) signal.moves_with = text.substr(at + kWith.size());
  const bool is_channel = channels_of(signal.name) == std::vector{signal.name};
  if (is_channel && signal.name.ends_with("angle_rad")) signal.turn = kMonitoredTurn_rad;
  return signal;
}

/// Every channel, angles with the one before them in the drive, and the deflection.
std::vector<MonitoredSignal> default_signals(const std::vector<std::string>& channels) {
  const auto has = [&](std::string_view name) {
    return std::ranges::find(channels, name) != channels.end();
  };
  const std::string motor = "motor_angle_rad";
  const std::string gear = "gear_angle_rad";
  const std::string joint = "joint_angle_rad";
  std::vector<MonitoredSignal> signals;
  for (const std::string& channel : channels) {
    MonitoredSignal signal = monitored_signal(channel);
    if (channel == gear && has(motor)) signal.moves_with = motor;
    if (channel == motor && has(gear)) signal.moves_with = gear;
    if (channel == joint && (has(gear) || has(motor))) signal.moves_with = has(gear) ? gear : motor;
    signals.push_back(std::move(signal));
  }
  if (has(gear) && has(joint)) signals.push_back({.name = gear + " - " + joint});
  return signals;
}

}  // namespace

const ModelMapping& common_mapping(const std::vector<ModelMapping>& models) {
  for (const ModelMapping& model : models)
    if (model.mapping != models.front().mapping)
      throw Error(
          {.place = model.file + ": mapping",
           .expected = fmt::format("the mapping with which {} was trained", models.front().file),
           .found = model.mapping.empty() ? "none" : "another one",
           .advice = "train both with one mapping, or give the one to use (--mapping, mapping=)"});
  return models.front();
}

std::vector<ModelMapping> model_mappings(const std::string& monitor_file) {
  const std::filesystem::path folder = std::filesystem::path(monitor_file).parent_path();
  std::vector<ModelMapping> mappings;
  for (const MonitoredSource& source : read_monitor(monitor_file).models)
    for (const MonitoredModel& of : {source.torque, source.friction}) {
      if (of.file.empty()) continue;
      const std::string model = (folder / of.file).string();
      mappings.push_back({model, load_model(model).card.mapping});
    }
  return mappings;
}

void check_last_day(std::string_view date, const std::string& place) {
  if (date.empty() || (is_date(date) && date >= today())) return;
  throw UsageError({.place = place,
                    .expected = fmt::format("a day as 2027-11-22, {} or later", today()),
                    .found = fmt::format("'{}'", date)});
}

MonitorFromModels::MonitorFromModels(MonitorRequest request) : request_(std::move(request)) {
  if (request_.sources.size() < 2)
    throw UsageError({.place = "sources of a monitor",
                      .expected = "at least two, which the monitor compares",
                      .found = fmt::format("{}", request_.sources.size())});
  file_.device_serial = request_.device_serial;
  file_.valid_until = request_.valid_until;
  for (const SourceFiles& files : request_.sources) add(files);
  find_channels();
}

void MonitorFromModels::add(const SourceFiles& files) {
  const ModelFile model = model_of_device(files.model, request_.device_serial);
  SourceModel source{.torque = make_estimator(model)};
  mappings_.push_back({files.model, model.card.mapping});
  if (!files.friction.empty()) {
    const ModelFile friction = model_of_device(files.friction, request_.device_serial);
    source.friction = make_estimator(friction);
    mappings_.push_back({files.friction, friction.card.mapping});
  }
  const std::filesystem::path folder =
      std::filesystem::absolute(request_.output).lexically_normal().parent_path();
  const MonitoredSource named{.torque = named_model(files.model, folder),
                              .friction = named_model(files.friction, folder)};
  // One model twice agrees with itself in spite of every fault.
  for (std::size_t i = 0; i < file_.models.size(); ++i)
    if (file_.models[i].torque.hash == named.torque.hash)
      throw UsageError({.place = "sources of a monitor",
                        .expected = "a model of its own for each source",
                        .found = fmt::format("the same model for {} and {}", plan_.sources[i].name,
                                             files.source.name),
                        .advice = "a model always agrees with itself"});
  sources_.push_back(std::move(source));
  plan_.sources.push_back(files.source);
  file_.models.push_back(named);
}

void MonitorFromModels::find_channels() {
  channels_ = TorqueSources(sources_).raw_inputs();
  for (const std::string& text : request_.signals) plan_.signals.push_back(monitored_signal(text));
  if (plan_.signals.empty()) plan_.signals = default_signals(channels_);
  for (const MonitoredSignal& signal : plan_.signals)
    for (const std::string& channel : channels_of(signal.name)) channels_.push_back(channel);
  std::ranges::sort(channels_);
  channels_.erase(std::unique(channels_.begin(), channels_.end()), channels_.end());
}

CalibratedMonitor MonitorFromModels::calibrate(const Dataset& fault_free,
                                               const Progress& progress) {
  CalibratedMonitor calibrated =
      calibrate_monitor(sources_, plan_, fault_free, request_.options, progress);
  for (std::size_t i = 0; i < sources_.size(); ++i)
    file_.models[i].error_bar_factor = calibrated.error_bar_factors[i];
  file_.redundancy = calibrated.redundancy;
  file_.monitor = calibrated.monitor;
  file_.fault_free_hours = calibrated.hours;
  file_.false_alarms_per_hour = calibrated.false_alarms_per_hour;
  file_.is_extrapolated = calibrated.is_extrapolated;
  file_.recordings.clear();
  for (const DatasetRecord& record : fault_free.records)
    file_.recordings.push_back(record.recording.source);
  save_monitor(request_.output, file_);
  return calibrated;
}

}  // namespace torsio
