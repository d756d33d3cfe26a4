#include <map>
#include <tuple>
#include <utility>

#include "bindings.hpp"
#include "evaluate/monitor/monitor_from_models.hpp"
#include "report/adaptation.hpp"
#include "report/monitor.hpp"
#include "sim/campaign/monitored_duty.hpp"
#include "sim/campaign/simulated_monitor.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/files/monitor_file.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

namespace torsio::python {
namespace {

/// The document of the program's command, and the torques and states of each recording.
using Monitored = std::pair<std::string, std::vector<Recording>>;

Monitored monitored_of(const std::vector<MonitorReplay>& replays, const MonitorSettings& settings) {
  Monitored found{replays_json(replays, settings), {}};
  for (const MonitorReplay& replay : replays) {
    Recording torques = replay.estimated.channels;
    Channel fault{"fault_1", {}};
    for (const Fault each : replay.estimated.faults)
      fault.values.push_back(static_cast<double>(each));
    torques.add(std::move(fault));
    found.second.push_back(std::move(torques));
  }
  return found;
}

/// (name, model file, friction model or None, parts on which it depends) of each source.
using MonitorSources =
    std::vector<std::tuple<std::string, py::object, py::object, std::vector<std::string>>>;

/// Recordings for a monitor's models, read with their mapping where no other one is given.
struct MonitorLogs {
  py::object items;
  py::object mapping;
  std::optional<double> rate_Hz;
};

std::vector<Recording> read_logs(const MonitorLogs& logs, const std::vector<ModelMapping>& models) {
  LoadOptions options;
  options.rate_Hz = logs.rate_Hz;
  if (logs.mapping.is_none()) {
    const ModelMapping& common = common_mapping(models);
    options.default_mapping = common.mapping;
    options.default_mapping_place = common.file + ": mapping";
  } else {
    options.mapping = path_text(logs.mapping);
  }
  std::vector<Recording> recordings = recordings_from(logs.items, options);
  if (recordings.empty())
    throw UsageError({.place = "monitor", .expected = "recordings", .found = "none"});
  return recordings;
}

Monitored monitor(const std::string& path, const MonitorLogs& logs, const std::string& serial) {
  const MonitoredTorque monitored = load_monitor(path, {.serial = serial});
  const std::vector<Recording> recordings = read_logs(logs, model_mappings(path));
  return interruptible([&](const Progress& progress) {
    std::vector<MonitorReplay> replays;
    replays.reserve(recordings.size());
    for (const Recording& recording : recordings)
      replays.push_back(replay_monitor(monitored, recording, progress));
    return monitored_of(replays, monitored.monitor().settings());
  });
}

/// As `torsio monitor --calibrate`.
std::string calibrate_monitor_file(MonitorRequest request, const MonitorLogs& logs) {
  check_last_day(request.valid_until, "valid_until");
  MonitorFromModels monitor(std::move(request));
  Dataset dataset;
  for (Recording& recording : read_logs(logs, monitor.mappings())) {
    for (const std::string& channel : monitor.channels())
      static_cast<void>(recording.channel(channel));  // throws where there is none
    dataset.records.push_back({.recording = std::move(recording), .segments = {}});
  }
  return interruptible([&](const Progress& progress) {
    return calibration_json(monitor.calibrate(dataset, progress));
  });
}

Monitored monitor_simulated(const std::string& actuator, const std::string& path,
                            const std::vector<std::string>& injections, const std::string& schedule,
                            double duration_s, std::uint64_t seed) {
  return interruptible([&](const Progress& progress) {
    const DataSheet sheet = find_data_sheet(actuator, progress);
    DutyRun work{.seed = seed, .duration_s = duration_s};
    if (!schedule.empty()) work.faults = read_fault_schedule(schedule, sheet, progress);
    for (const std::string& injection : injections)
      work.faults.faults.push_back(parse_injection(injection, sheet));
    const MonitoredTorque monitored = load_monitor(path, {.serial = full_name(sheet)});
    const MonitorSettings settings = monitored.monitor().settings();
    return monitored_of({monitored_duty(sheet, std::move(work), monitored, progress)}, settings);
  });
}

/// As `torsio monitor --calibrate --actuator`.
std::string calibrate_simulated_monitor(const std::string& actuator, const std::string& path,
                                        double fault_free_hours, double false_alarms_per_hour) {
  return interruptible([&](const Progress& progress) {
    const DataSheet sheet = find_data_sheet(actuator, progress);
    const SimulatedMonitor found = calibrate_simulated(
        sheet,
        {.fault_free_hours = fault_free_hours, .false_alarms_per_hour = false_alarms_per_hour},
        progress);
    save_simulated_monitor(path, found, full_name(sheet));
    return calibration_json(found.calibrated);
  });
}

/// As `torsio adapt`.
std::pair<std::string, Model> adapt(const Model& model, Dataset dataset, double held_out,
                                    double embargo_s, const std::string& method,
                                    const std::map<std::string, std::string>& given,
                                    const std::string& serial) {
  return interruptible([&](const Progress& progress) {
    const AdaptationSettings settings = adaptation_settings(method, given);
    if (!dataset.has_role(Role::test)) hold_out_ends(dataset, held_out, embargo_s);
    AdaptedModel adapted = adapt_model(*model.file, dataset, settings, progress);
    if (!serial.empty()) adapted.file.card.device_serial = serial;
    std::string document = adaptation_json(adapted, {});
    return std::pair(std::move(document),
                     Model{std::make_shared<const ModelFile>(std::move(adapted.file))});
  });
}

}  // namespace

void bind_supervision(py::module_& module) {
  module.def(
      "monitor",
      [](const py::object& path, const py::object& recordings, const std::string& serial,
         const py::object& mapping, std::optional<double> rate_Hz) {
        return monitor(path_text(path), {recordings, mapping, rate_Hz}, serial);
      },
      py::arg("path"), py::arg("recordings"), py::arg("serial"), py::arg("mapping"),
      py::arg("rate_Hz"));
  module.def(
      "calibrate_monitor",
      [](const py::object& path, const py::object& recordings, const MonitorSources& sources,
         std::vector<std::string> signals, const std::string& serial,
         const std::string& valid_until, double false_alarms_per_hour, bool extrapolates,
         double least_threshold_Nm, double required_Nm, std::optional<double> persistence_s,
         const py::object& mapping, std::optional<double> rate_Hz) {
        MonitorRequest request{.sources = {},
                               .signals = std::move(signals),
                               .output = path_text(path),
                               .device_serial = serial,
                               .valid_until = valid_until};
        for (const auto& [name, model, friction, depends_on] : sources)
          request.sources.push_back(
              {.source = {.name = name, .depends_on = depends_on},
               .model = path_text(model),
               .friction = friction.is_none() ? std::string() : path_text(friction)});
        request.options.false_alarms_per_hour = false_alarms_per_hour;
        request.options.extrapolate = extrapolates;
        request.options.least_threshold_Nm = least_threshold_Nm;
        request.options.required_Nm = required_Nm;
        if (persistence_s) request.options.persistence_s = *persistence_s;
        return calibrate_monitor_file(std::move(request), {recordings, mapping, rate_Hz});
      },
      py::arg("path"), py::arg("recordings"), py::arg("sources"), py::arg("signals"),
      py::arg("serial"), py::arg("valid_until"), py::arg("false_alarms_per_hour"),
      py::arg("extrapolates"), py::arg("least_threshold_Nm"), py::arg("required_Nm"),
      py::arg("persistence_s"), py::arg("mapping"), py::arg("rate_Hz"));
  module.def(
      "monitor_simulated",
      [](const std::string& actuator, const py::object& path,
         const std::vector<std::string>& injections, const std::string& schedule, double duration_s,
         std::uint64_t seed) {
        return monitor_simulated(actuator, path_text(path), injections, schedule, duration_s, seed);
      },
      py::arg("actuator"), py::arg("path"), py::arg("injections"), py::arg("schedule"),
      py::arg("duration_s"), py::arg("seed"));
  module.def(
      "calibrate_simulated_monitor",
      [](const std::string& actuator, const py::object& path, double fault_free_hours,
         double false_alarms_per_hour) {
        return calibrate_simulated_monitor(actuator, path_text(path), fault_free_hours,
                                           false_alarms_per_hour);
      },
      py::arg("actuator"), py::arg("path"), py::arg("fault_free_hours"),
      py::arg("false_alarms_per_hour"));
  module.def("adapt", adapt, py::arg("model"), py::arg("dataset"), py::arg("held_out"),
             py::arg("embargo_s"), py::arg("method"), py::arg("settings"), py::arg("serial"));
}

}  // namespace torsio::python
