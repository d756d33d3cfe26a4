#include "sim/campaign/simulated_monitor.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <utility>

#include "core/fnv_hash.hpp"
#include "core/report_progress.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/campaign/monitor_recipe.hpp"
#include "torsio/core/version.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/monitor_file.hpp"

namespace torsio {
namespace {

constexpr double kRecording_s = 600.0;
constexpr std::size_t kTemperatures = 8;  ///< training recordings, each at its own
constexpr double kSecondsPerHour = 3600.0;
// Low-passes of 100 Hz spread a spike over some 6 ms, in 4 ms of which it is seldom above a threshold.
constexpr double kPersistence_s = 4e-3;

void add(Dataset& dataset, Recording recording, Role role) {
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

/// The specimen of the same actuator in its default variant on which the spring was calibrated.
DataSheet other_specimen(const DataSheet& joint, unsigned serial) {
  return data_sheet(fmt::format("{}#{:02}", joint.name, serial));
}

}  // namespace

std::string calibration_hash(const SimulatedCalibration& settings) {
  return fmt::format("{:016x}", text_hash(fmt::format(
                                    "{} {} {} {} {} {} {} {}", kVersion, settings.seed,
                                    settings.training_s, settings.fault_free_hours,
                                    settings.false_alarms_per_hour, settings.least_threshold_share,
                                    settings.required_share, settings.spring_serial)));
}

std::vector<SourceModel> SimulatedMonitor::models() const {
  std::vector<SourceModel> models;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    models.push_back(sources[i].model());
    models.back().error_bar_factor = calibrated.error_bar_factors.at(i);
  }
  return models;
}

MonitoredTorque SimulatedMonitor::monitored() const {
  return {TorqueSources(models()), calibrated.redundancy, calibrated.monitor};
}

void save_simulated_monitor(const std::filesystem::path& path, const SimulatedMonitor& monitor,
                            const std::string& device_serial) {
  constexpr std::string_view kEnding = ".monitor.json";
  std::string stem = path.filename().string();
  if (stem.ends_with(kEnding)) stem.resize(stem.size() - kEnding.size());
  const auto saved = [&](ModelFile model, const std::string& source) {
    model.card.device_serial = device_serial;
    const std::string name = fmt::format("{}.{}.safetensors", stem, source);
    save_model(path.parent_path() / name, model);
    return MonitoredModel{.file = name, .hash = model_hash(path.parent_path() / name)};
  };
  MonitorFile file;
  file.device_serial = device_serial;
  file.redundancy = monitor.calibrated.redundancy;
  file.monitor = monitor.calibrated.monitor;
  file.fault_free_hours = monitor.calibrated.hours;
  file.false_alarms_per_hour = monitor.calibrated.false_alarms_per_hour;
  file.is_extrapolated = monitor.calibrated.is_extrapolated;
  for (std::size_t i = 0; i < monitor.sources.size(); ++i) {
    const FittedSource& source = monitor.sources[i];
    const std::string& name = file.redundancy.sources[i].name;
    MonitoredSource models{.torque = saved(source.torque, name),
                           .error_bar_factor = monitor.calibrated.error_bar_factors[i]};
    if (source.friction) models.friction = saved(*source.friction, name + "_friction");
    file.models.push_back(std::move(models));
  }
  save_monitor(path, file);
}

SimulatedMonitor calibrate_simulated(const DataSheet& joint, const SimulatedCalibration& settings,
                                     const Progress& progress) {
  const MonitorRecipe recipe = monitor_recipe(joint);
  std::uint64_t seed = settings.seed;
  const auto work = [&](const DataSheet& sheet, double duration_s) {
    return with_source_delay(
        duty_recording(sheet, {.seed = seed++, .duration_s = duration_s}, progress));
  };
  Dataset own;
  for (std::size_t i = 0; i < kTemperatures; ++i)
    add(own, work(joint, settings.training_s / static_cast<double>(kTemperatures)), Role::train);
  Dataset other;
  add(other, work(other_specimen(joint, settings.spring_serial), settings.training_s), Role::train);
  constexpr int kValidations = 4;
  for (int i = 0; i < kValidations; ++i) {
    const Recording validation = work(joint, settings.training_s / kValidations);
    add(own, validation, Role::validation);
    add(other, validation, Role::validation);
  }
  SimulatedMonitor result;
  for (const SourceRecipe& source : recipe.sources)
    result.sources.push_back(
        fit_source(source, source.source.name == "spring" ? other : own, progress));
  own = {};
  other = {};

  Dataset fault_free;
  const double fault_free_s = settings.fault_free_hours * kSecondsPerHour;
  const auto recordings = static_cast<std::size_t>(std::ceil(fault_free_s / kRecording_s));
  for (std::size_t i = 0; i < recordings; ++i)
    add(fault_free, work(joint, fault_free_s / static_cast<double>(recordings)), Role::validation);
  std::vector<SourceModel> sources;
  for (const FittedSource& source : result.sources) sources.push_back(source.model());
  result.calibrated = calibrate_monitor(
      sources, recipe.plan, fault_free,
      {.false_alarms_per_hour = settings.false_alarms_per_hour,
       .extrapolate = true,
       .least_threshold_Nm = settings.least_threshold_share * duty_limits(joint).torque_Nm,
       .persistence_s = kPersistence_s,
       .required_Nm = settings.required_share * duty_limits(joint).torque_Nm},
      progress);
  return result;
}

}  // namespace torsio
