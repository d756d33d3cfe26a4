#include "supervision/monitor_calibrate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <utility>

#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/monitor.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/files/monitor_file.hpp"

namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

/// NAME=MODEL, NAME=MODEL,FRICTION, each with or without :PART+PART
struct SourceFlag {
  torsio::TorqueSource source;
  std::string model;
  std::string friction;
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
         .expected = "NAME=MODEL, NAME=MODEL:PART+PART or NAME=MODEL,FRICTION:PART+PART",
         .found = "'" + text + "'",
         .advice = "for example --source spring=spring.safetensors:gear_encoder+joint_encoder"});
  SourceFlag flag{.source = {.name = text.substr(0, equals), .depends_on = {}},
                  .model = text.substr(equals + 1),
                  .friction = {}};
  if (const std::size_t colon = flag.model.rfind(':'); colon != std::string::npos) {
    flag.source.depends_on = split(flag.model.substr(colon + 1), '+');
    flag.model.resize(colon);
  }
  if (const std::size_t comma = flag.model.find(','); comma != std::string::npos) {
    flag.friction = flag.model.substr(comma + 1);
    flag.model.resize(comma);
  }
  return flag;
}

/// A model that states no device may be used on any. @throws torsio::Error for one of another device.
torsio::ModelFile model_of(const std::string& path, const std::string& device_serial) {
  torsio::ModelFile model = torsio::load_model(path);
  const std::string& serial = model.card.device_serial;
  if (!serial.empty() && !device_serial.empty() && serial != device_serial)
    throw torsio::Error({.place = path + ": device_serial",
                         .expected = "'" + device_serial + "'",
                         .found = "'" + serial + "'",
                         .advice = "calibrate the monitor with the models of this joint"});
  return model;
}

/// The models of a source, as the file names them: relative to its folder.
torsio::MonitoredModel named(const std::string& model, const std::filesystem::path& folder) {
  if (model.empty()) return {};
  return {.file = std::filesystem::relative(std::filesystem::absolute(model), folder).string(),
          .hash = torsio::model_hash(model)};
}

/// EXPRESSION, or "EXPRESSION moves with EXPRESSION".
torsio::MonitoredSignal signal_of(const std::string& text) {
  constexpr std::string_view kWith = " moves with ";
  const std::size_t at = text.find(kWith);
  torsio::MonitoredSignal signal{.name = text.substr(0, at)};
  if (at != std::string::npos) signal.moves_with = text.substr(at + kWith.size());
  const bool is_channel = torsio::channels_of(signal.name) == std::vector{signal.name};
  if (is_channel && signal.name.ends_with("angle_rad")) signal.turn = kTurn_rad;
  return signal;
}

/// Every channel, angles with the one before them in the drive, and the deflection.
std::vector<torsio::MonitoredSignal> default_signals(const std::vector<std::string>& channels) {
  const auto has = [&](std::string_view name) {
    return std::ranges::find(channels, name) != channels.end();
  };
  const std::string motor = "motor_angle_rad";
  const std::string gear = "gear_angle_rad";
  const std::string joint = "joint_angle_rad";
  std::vector<torsio::MonitoredSignal> signals;
  for (const std::string& channel : channels) {
    torsio::MonitoredSignal signal = signal_of(channel);
    if (channel == gear && has(motor)) signal.moves_with = motor;
    if (channel == motor && has(gear)) signal.moves_with = gear;
    if (channel == joint && (has(gear) || has(motor))) signal.moves_with = has(gear) ? gear : motor;
    signals.push_back(std::move(signal));
  }
  if (has(gear) && has(joint)) signals.push_back({.name = gear + " - " + joint});
  return signals;
}

/// With its unit, or the value of an option that is not given.
double quantity_or(const std::string& text, const char* unit, const char* option, double value) {
  return text.empty() ? value : torsio::signed_quantity_with_unit(text, unit, option);
}

void check_last_day(const std::string& date) {
  if (date.empty() || (torsio::is_date(date) && date >= torsio::today())) return;
  throw torsio::UsageError(
      {.place = "--valid-until",
       .expected = fmt::format("a day as 2027-11-22, {} or later", torsio::today()),
       .found = fmt::format("'{}'", date)});
}

/// One model twice agrees with itself in spite of every fault.
/// @param models the last one is new
void check_own_model(const std::vector<torsio::TorqueSource>& sources,
                     const std::vector<torsio::MonitoredSource>& models) {
  for (std::size_t i = 0; i + 1 < models.size(); ++i)
    if (models[i].torque.hash == models.back().torque.hash)
      throw torsio::UsageError({.place = "--source",
                                .expected = "a model of its own for each source",
                                .found = fmt::format("the same model for {} and {}",
                                                     sources[i].name, sources.back().name),
                                .advice = "a model always agrees with itself"});
}

}  // namespace

void use_common_mapping(DataFlags& data, const std::vector<ModelMapping>& models) {
  for (const ModelMapping& model : models)
    if (data.mapping.empty() && model.mapping != models.front().mapping)
      throw torsio::Error(
          {.place = model.file + ": mapping",
           .expected = fmt::format("the mapping with which {} was trained", models.front().file),
           .found = model.mapping.empty() ? "none" : "another one",
           .advice = "train both with one mapping, or give the one to use with --mapping"});
  data.use_model_mapping(models.front().mapping, models.front().file);
}

void calibrate(CalibrateFlags& flags, DataFlags& data, const JsonOutput& json) {
  if (flags.sources.size() < 2)
    throw torsio::UsageError(
        {.place = "--calibrate",
         .expected = "at least two --source NAME=MODEL, which the monitor compares",
         .found = flags.sources.empty() ? "none" : "one"});
  check_last_day(flags.valid_until);
  std::vector<std::string> models;
  std::vector<ModelMapping> mappings;
  std::vector<torsio::SourceModel> sources;
  torsio::MonitorPlan plan;
  torsio::MonitorFile file;
  file.device_serial = flags.device_serial;
  file.valid_until = flags.valid_until;
  const std::filesystem::path folder =
      std::filesystem::absolute(flags.output).lexically_normal().parent_path();
  for (const std::string& text : flags.sources) {
    SourceFlag flag = source_of(text);
    const torsio::ModelFile model = model_of(flag.model, flags.device_serial);
    torsio::SourceModel source{.torque = torsio::make_estimator(model)};
    mappings.push_back({flag.model, model.card.mapping});
    models.push_back(flag.model);
    if (!flag.friction.empty()) {
      const torsio::ModelFile friction = model_of(flag.friction, flags.device_serial);
      source.friction = torsio::make_estimator(friction);
      mappings.push_back({flag.friction, friction.card.mapping});
      models.push_back(flag.friction);
    }
    sources.push_back(std::move(source));
    plan.sources.push_back(std::move(flag.source));
    file.models.push_back(
        {.torque = named(flag.model, folder), .friction = named(flag.friction, folder)});
    check_own_model(plan.sources, file.models);
  }
  use_common_mapping(data, mappings);
  data.check_outputs({flags.output, json.destination}, models);
  require_writable(flags.output);
  for (const std::string& text : flags.signals) plan.signals.push_back(signal_of(text));
  std::vector<std::string> channels = torsio::TorqueSources(sources).raw_inputs();
  if (plan.signals.empty()) plan.signals = default_signals(channels);
  for (const torsio::MonitoredSignal& signal : plan.signals)
    for (const std::string& channel : torsio::channels_of(signal.name)) channels.push_back(channel);
  std::ranges::sort(channels);
  channels.erase(std::unique(channels.begin(), channels.end()), channels.end());

  ProgressBar progress;
  const torsio::Dataset dataset = data.load_inputs(channels, progress.listener());
  torsio::CalibrationOptions options{.false_alarms_per_hour = flags.false_alarms_per_hour,
                                     .extrapolate = flags.extrapolate};
  options.least_threshold_Nm = quantity_or(flags.least_threshold, "Nm", "--least-threshold", 0.0);
  options.persistence_s =
      quantity_or(flags.persistence, "s", "--persistence", options.persistence_s);
  options.required_Nm = quantity_or(flags.required, "Nm", "--required", options.required_Nm);
  const torsio::CalibratedMonitor calibrated =
      torsio::calibrate_monitor(sources, plan, dataset, options, progress.listener());
  for (std::size_t i = 0; i < sources.size(); ++i)
    file.models[i].error_bar_factor = calibrated.error_bar_factors[i];
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
