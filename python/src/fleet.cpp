#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "bindings.hpp"
#include "files/json_text.hpp"
#include "fleet/calibration.hpp"
#include "fleet/fleet_text.hpp"
#include "fleet/registration.hpp"
#include "fleet/study_kinds.hpp"
#include "fleet/watch.hpp"
#include "fleet/watch_text.hpp"
#include "report/cross_validation.hpp"
#include "torsio/core/version.hpp"
#include "torsio/search/structure_study.hpp"
#include "torsio/search/workers.hpp"
#include "torsio/store/registry.hpp"

namespace torsio::python {
namespace {

using FleetJson = nlohmann::ordered_json;

/// Opening a SQLite file that does not exist would create it, at a misspelt path too.
StoreAddress existing_store(const std::string& address) {
  StoreAddress found = store_address(address);
  std::error_code absent;
  if (found.kind == StoreAddress::Kind::sqlite && !std::filesystem::exists(found.target, absent))
    throw UsageError({.place = found.name(),
                      .problem = "there is no store",
                      .advice = "Correct the path; calibrate_fleet(store=...) and "
                                "Study.search(store=...) begin one."});
  return found;
}

StoredStudy stored(StudyStore& store, const std::string& name) {
  if (const auto study = store.find_study(name)) return *study;
  std::string names;
  for (const StoredStudy& study : store.studies())
    names += (names.empty() ? "" : ", ") + study.name;
  throw UsageError({.place = store.address().name(),
                    .expected = names.empty() ? "a study: the store has none" : "one of " + names,
                    .found = "'" + name + "'"});
}

std::string study_list(const std::string& address) {
  StudyStore store(existing_store(address));
  FleetJson list = FleetJson::array();
  for (const StoredStudy& study : store.studies()) {
    const StudyCounts counts = store.counts(study.id);
    list.push_back({{"name", study.name},
                    {"kind", study.kind},
                    {"waiting", counts.waiting},
                    {"running", counts.running},
                    {"finished", counts.finished},
                    {"torsio_version", study.torsio_version}});
  }
  return list.dump();
}

std::string study_trials(const std::string& address, const std::string& name) {
  StudyStore store(existing_store(address));
  FleetJson list = FleetJson::array();
  for (const TrialRecord& record : store.trials(stored(store, name).id))
    list.push_back({{"trial", record.id},
                    {"key", record.trial.key},
                    {"group", record.trial.group},
                    {"device", record.trial.device},
                    {"step", record.trial.step},
                    {"state", torsio::name(record.state)},
                    {"attempts", record.attempt},
                    {"worker", record.worker},
                    {"value", json_number(record.result.value)},
                    {"seconds", json_number(record.result.seconds)},
                    {"reason", record.result.reason}});
  return list.dump();
}

std::pair<std::size_t, std::size_t> study_work(const std::string& address, const std::string& name,
                                               std::size_t threads) {
  return interruptible([&](const Progress& progress) {
    StudyStore store(existing_store(address));
    const StoredStudy study = stored(store, name);
    const std::unique_ptr<StudyKind> kind = make_study_kind(study, progress);
    const WorkersReport report = run_workers(store, study, *kind, {.threads = threads}, progress);
    return std::pair(report.finished, report.lost);
  });
}

/// As `torsio search`; the study is kept if there is a store.
std::string study_search(const SearchRequest& request, const std::string& address,
                         const std::string& name, std::size_t threads) {
  return interruptible([&](const Progress& progress) {
    const Dataset dataset = load_search_data(request, progress);
    StructureStudy kind(dataset, search_choices(dataset, request), request.settings);
    StudyStore store(address.empty() ? StoreAddress{} : store_address(address));
    if (const auto known = store.find_study(name)) refuse_changed_data(*known, dataset);
    const StoredStudy study = store.create_or_resume({.name = name,
                                                      .kind = std::string(kStructureStudy),
                                                      .spec = request_text(request, dataset),
                                                      .torsio_version = kVersion},
                                                     kind.first_trials());
    run_workers(store, study, kind, {.threads = threads}, progress);
    return cross_validation_json(kind.result(store, study.id).scores);
  });
}

/// As `torsio fleet calibrate`.
std::string calibrate_fleet(const FleetChoice& choice, const std::string& address,
                            const std::string& name, bool promotes, std::size_t threads) {
  return interruptible([&](const Progress& progress) {
    CalibrationStudy kind(calibration_request(choice));
    StudyStore store(address.empty() ? StoreAddress{} : store_address(address));
    const StoredStudy study = begin_calibration(store, name, kind);
    run_workers(store, study, kind, {.threads = threads}, progress);
    const FleetCalibration fleet = calibration_result(store, study);
    if (!address.empty()) {
      Registry registry(store.address());
      static_cast<void>(register_fleet(registry, store, fleet, kind.request(), promotes, "Python"));
    }
    return fleet_json(fleet);
  });
}

/// As `torsio fleet watch`.
std::string watch_fleet(const std::string& list, const std::string& address, std::size_t threads) {
  return interruptible([&](const Progress& progress) {
    Registry registry(existing_store(address));
    std::vector<std::string> failures;
    if (!list.empty()) failures = watch_joints(registry, read_fleet_list(list), threads, progress);
    return watch_json(rank_by_drift(registry), failures);
  });
}

std::string registry_devices(const std::string& address) {
  Registry registry(existing_store(address));
  FleetJson list = FleetJson::array();
  for (const DeviceSummary& of : registry.summaries()) {
    FleetJson json{{"serial", of.device.serial},
                   {"type", of.device.type},
                   {"model", nullptr},
                   {"family", nullptr},
                   {"models", of.models},
                   {"recordings", of.recordings},
                   {"drift", nullptr}};
    if (of.current) json["model"] = of.current->id;
    if (of.current) json["family"] = of.current->family;
    if (of.last_drift) json["drift"] = of.last_drift->verdict;
    list.push_back(std::move(json));
  }
  return list.dump();
}

std::string registry_models(const std::string& address, const std::string& serial) {
  Registry registry(existing_store(address));
  FleetJson list = FleetJson::array();
  for (const RegisteredModel& of : registry.models(serial)) {
    FleetJson json{{"model", of.id},      {"serial", of.device},
                   {"family", of.family}, {"sha256", of.sha256},
                   {"parent", nullptr},   {"base_sha256", nullptr},
                   {"rmse", nullptr},     {"added_by", of.added_by},
                   {"note", of.note},     {"torsio_version", of.torsio_version}};
    if (of.parent) json["parent"] = *of.parent;
    if (!of.base_sha256.empty()) json["base_sha256"] = of.base_sha256;
    if (const auto rmse = of.metrics.find("rmse"); rmse != of.metrics.end())
      json["rmse"] = json_number(rmse->second);
    list.push_back(std::move(json));
  }
  return list.dump();
}

std::string registry_drift(const std::string& address, const std::string& serial) {
  Registry registry(existing_store(address));
  FleetJson list = FleetJson::array();
  for (const DriftEntry& of : registry.drift_history(serial))
    list.push_back({{"found_at_s", of.found_at_s},
                    {"model", of.model},
                    {"recording", of.recording},
                    {"verdict", of.verdict},
                    {"rmse", json_number(of.rmse)},
                    {"stiffness", json_number(of.stiffness)},
                    {"stiffness_error", json_number(of.stiffness_error)},
                    {"friction", json_number(of.friction)},
                    {"friction_error", json_number(of.friction_error)},
                    {"zero", json_number(of.zero)},
                    {"zero_error", json_number(of.zero_error)}});
  return list.dump();
}

/// The current model of a device, or the one with that number.
Model registry_model(const std::string& address, const std::string& serial,
                     std::optional<std::int64_t> id) {
  Registry registry(existing_store(address));
  if (!id) {
    const auto current = registry.current(serial);
    if (!current)
      throw Error({.place = "device " + serial,
                   .problem = "no model is current",
                   .advice = "Promote one: Registry.promote(serial, model)."});
    id = current->id;
  }
  const std::string bytes = registry.model_bytes(serial, *id);
  Model model;
  model.file = std::make_shared<const ModelFile>(
      parse_model(std::as_bytes(std::span(bytes)), "device " + serial, serial));
  return model;
}

}  // namespace

void bind_fleet(py::module_& module) {
  module.def("study_list", &study_list, py::arg("store"));
  module.def("study_trials", &study_trials, py::arg("store"), py::arg("study"));
  module.def("study_work", &study_work, py::arg("store"), py::arg("study"), py::arg("threads"));
  module.def(
      "study_search",
      [](const std::vector<std::string>& recordings, const std::string& mapping, double rate_Hz,
         const std::string& target, const std::vector<std::string>& inputs,
         const std::string& models, std::size_t folds, std::uint64_t seed, const std::string& store,
         const std::string& study, std::size_t threads) {
        SearchRequest request{.recordings = recordings,
                              .mapping = mapping,
                              .rate_Hz = rate_Hz,
                              .target = target,
                              .models = models};
        if (!inputs.empty()) request.inputs = {inputs};
        request.settings.folds = folds;
        request.settings.seed = seed;
        return study_search(request, store, study, threads);
      },
      py::arg("recordings"), py::arg("mapping"), py::arg("rate_Hz"), py::arg("target"),
      py::arg("inputs"), py::arg("models"), py::arg("folds"), py::arg("seed"), py::arg("store"),
      py::arg("study"), py::arg("threads"));
  module.def(
      "calibrate_fleet",
      [](const std::string& list, const std::string& specimens, std::size_t faults,
         const std::string& base, const std::string& model, std::uint64_t seed,
         const std::string& store, const std::string& study, bool promote, std::size_t threads) {
        return calibrate_fleet({.list = list,
                                .specimens = specimens,
                                .faults = faults,
                                .base = base,
                                .model = model,
                                .seed = seed},
                               store, study, promote, threads);
      },
      py::arg("list"), py::arg("specimens"), py::arg("faults"), py::arg("base"), py::arg("model"),
      py::arg("seed"), py::arg("store"), py::arg("study"), py::arg("promote"), py::arg("threads"));
  module.def("watch_fleet", &watch_fleet, py::arg("list"), py::arg("store"), py::arg("threads"));
  module.def("registry_devices", &registry_devices, py::arg("store"));
  module.def("registry_models", &registry_models, py::arg("store"), py::arg("serial"));
  module.def("registry_drift", &registry_drift, py::arg("store"), py::arg("serial"));
  module.def("registry_model", &registry_model, py::arg("store"), py::arg("serial"),
             py::arg("model"));
  module.def(
      "registry_promote",
      [](const std::string& store, const std::string& serial, std::int64_t model,
         const std::string& reason) {
        Registry registry(existing_store(store));
        return registry.promote(serial, model, "Python", reason);
      },
      py::arg("store"), py::arg("serial"), py::arg("model"), py::arg("reason"));
  module.def(
      "registry_roll_back",
      [](const std::string& store, const std::string& serial, const std::string& reason) {
        Registry registry(existing_store(store));
        return registry.roll_back(serial, "Python", reason);
      },
      py::arg("store"), py::arg("serial"), py::arg("reason"));
}

}  // namespace torsio::python
