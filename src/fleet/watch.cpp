#include "fleet/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "data/byte_source.hpp"
#include "evaluate/drift/verdicts.hpp"
#include "files/json_text.hpp"
#include "search/stored_path.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using WatchJson = nlohmann::ordered_json;

struct CurrentModel {
  std::int64_t id = 0;
  ModelFile file;
};

CurrentModel current_model(Registry& registry, const std::string& serial) {
  const std::optional<RegisteredModel> current = registry.current(serial);
  if (!current)
    throw Error({.place = "device " + serial,
                 .problem = "no model is current, so that nothing can be compared",
                 .advice = "Calibrate it (torsio fleet calibrate --promote), or promote one of its "
                           "models (torsio store promote)."});
  const std::string bytes = registry.model_bytes(serial, current->id);
  return {current->id, parse_model(std::as_bytes(std::span(bytes)), current->file, serial)};
}

double half_width(const DriftQuantity& of) { return 0.5 * (of.highest - of.lowest); }

/// Over the change that counts, by the end of the interval that is nearer to none.
double severity_of(const DriftQuantity& of) {
  if (!std::isfinite(of.change) || !(of.smallest > 0.0)) return kNotMeasured;
  const double certain = std::max(0.0, std::abs(of.change) - half_width(of));
  return certain / of.smallest;
}

std::string change_text(const DriftQuantity& of) {
  return std::isfinite(of.relative) ? fmt::format("{} {:+.3g} %", of.name, 100.0 * of.relative)
                                    : fmt::format("{} {:+.3g} {}", of.name, of.change, of.unit);
}

DriftEntry entry_of(const Drift& drift) {
  DriftEntry entry;
  entry.verdict = name(drift.joint);
  entry.rmse = drift.rmse;
  constexpr double kNormal95 = 1.96;
  WatchJson details{{"advice", name(drift.advice)},
                    {"calibration_rmse", json_number(drift.calibration_rmse)},
                    {"quantities", WatchJson::array()}};
  double worst = 0.0;
  std::string worst_text = "nothing";
  for (const DriftQuantity& of : drift.quantities) {
    const double error = half_width(of) / kNormal95;
    if (of.name == drift_names::kScale || of.name == drift_names::kStiffness) {
      entry.stiffness = of.relative;
      entry.stiffness_error = error / std::abs(of.before);
    } else if (of.name == drift_names::kFriction) {
      entry.friction = of.relative;
      entry.friction_error = error / std::abs(of.before);
    } else if (of.name == drift_names::kZero) {
      entry.zero = of.change;
      entry.zero_error = error;
      entry.bias = of.change;
    }
    const double severity = severity_of(of);
    if (severity > worst) {
      worst = severity;
      worst_text = change_text(of);
    }
    details["quantities"].push_back({{"name", of.name},
                                     {"change", json_number(of.change)},
                                     {"lowest", json_number(of.lowest)},
                                     {"highest", json_number(of.highest)},
                                     {"smallest", json_number(of.smallest)},
                                     {"verdict", name(of.verdict)}});
  }
  details["severity"] = worst;
  details["worst"] = worst_text;
  entry.details = details.dump();
  return entry;
}

/// What the details of an entry state; empty where they are not those of `entry_of`.
WatchJson details_of(const DriftEntry& entry) {
  WatchJson details = WatchJson::parse(entry.details, nullptr, /*allow_exceptions=*/false);
  return details.is_object() ? details : WatchJson::object();
}

double severity_of(const DriftEntry& entry) {
  const WatchJson details = details_of(entry);
  return details.contains("severity") && details["severity"].is_number()
             ? details["severity"].get<double>()
             : kNotMeasured;
}

/// Adds the files of a joint. @returns their uses by its model
std::vector<RecordingUse> add_recordings(Registry& registry, const CalibrationRequest& request,
                                         const std::string& serial) {
  std::vector<RecordingUse> uses;
  const auto joint = std::ranges::find(request.joints, serial, &FleetJoint::serial);
  if (joint == request.joints.end()) return uses;  // simulated
  const auto add = [&](const std::vector<std::string>& files, Role role) {
    for (const std::string& file : files) {
      uses.push_back({.sha256 = sha256_of_file(file), .role = std::string(name(role))});
      registry.add_recording(
          {.sha256 = uses.back().sha256, .device = serial, .file = stored_path(file)});
    }
  };
  add(joint->train, Role::train);
  add(joint->test, Role::test);
  return uses;
}

}  // namespace

void watch_joint(Registry& registry, const FleetJoint& joint, const CalibrationRequest& request,
                 const Progress& progress) {
  const auto [id, model] = current_model(registry, joint.serial);
  LoadOptions options = load_options(request, progress);
  if (options.target.empty()) options.target = model.settings.target;
  options.default_mapping = model.card.mapping;
  options.default_mapping_place = "the model of " + joint.serial;
  std::vector<std::string> files = joint.train;
  files.insert(files.end(), joint.test.begin(), joint.test.end());
  const Dataset dataset = load_dataset({}, files, options);
  for (const DatasetRecord& record : dataset.records)
    registry.add_recording({.sha256 = record.recording.source.sha256,
                            .device = joint.serial,
                            .file = stored_path(record.recording.source.file),
                            .samples = record.recording.size(),
                            .rate_Hz = record.recording.sample_rate_Hz()});
  DriftEntry entry = entry_of(detect_drift(model, dataset, {}, progress));
  entry.device = joint.serial;
  entry.model = id;
  entry.recording = dataset.records.front().recording.source.sha256;
  registry.add_drift(entry);
}

std::vector<std::string> watch_joints(Registry& registry, const CalibrationRequest& request,
                                      const Progress& progress) {
  std::vector<std::string> failures;
  for (const FleetJoint& joint : request.joints) {
    try {
      watch_joint(registry, joint, request, progress);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      failures.push_back(fmt::format("{}: {}", joint.serial, error.what()));
    }
  }
  return failures;
}

std::vector<WatchedJoint> rank_by_drift(Registry& registry) {
  std::vector<WatchedJoint> joints;
  for (const DeviceSummary& summary : registry.summaries()) {
    WatchedJoint joint{.serial = summary.device.serial, .type = summary.device.type};
    if (summary.current) joint.model = summary.current->id;
    const std::vector<DriftEntry> history = registry.drift_history(joint.serial);
    joint.comparisons = history.size();
    if (!history.empty()) {
      joint.last = history.back();
      joint.severity = severity_of(history.back());
      const WatchJson details = details_of(history.back());
      joint.worst = details.value("worst", std::string());
      joint.advice = details.value("advice", std::string());
    }
    if (history.size() > 1) joint.severity_before = severity_of(history[history.size() - 2]);
    joints.push_back(std::move(joint));
  }
  std::ranges::stable_sort(joints, [](const WatchedJoint& a, const WatchedJoint& b) {
    const auto rank = [](const WatchedJoint& joint) {
      return std::isfinite(joint.severity) ? -joint.severity : 1.0;
    };
    return rank(a) < rank(b);
  });
  return joints;
}

RegisteredFleet register_fleet(Registry& registry, StudyStore& store, const FleetCalibration& fleet,
                               const CalibrationRequest& request, bool promotes,
                               const std::string& by) {
  RegisteredFleet result;
  for (std::size_t i = 0; i < fleet.joints.size(); ++i) {
    const CalibratedJoint& joint = fleet.joints[i];
    registry.add_device({.serial = joint.serial, .type = joint.type});
    if (joint.chosen.empty()) continue;  // no model was made
    const std::optional<RegisteredModel> before = registry.current(joint.serial);
    NewModel added{.device = joint.serial,
                   .bytes = store.samples(joint.trial),
                   .file = joint.serial + ".safetensors",
                   .by = by,
                   .note = fmt::format("fleet calibrate: {}", joint.chosen),
                   .recordings = add_recordings(registry, request, joint.serial),
                   .trial = joint.trial};
    if (before && before->trial != joint.trial) added.parent = before->id;
    const std::int64_t model = registry.add_model(added);
    ++result.models;
    if (!promotes) continue;
    if (std::ranges::find(fleet.outliers, i, &FleetOutlier::joint) != fleet.outliers.end()) {
      result.refused.push_back(joint.serial + ": it differs from the others of its type");
      continue;
    }
    if (registry.promote(joint.serial, model, by, "fleet calibrate")) ++result.promoted;
  }
  return result;
}

}  // namespace torsio
