#include "fleet/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <tuple>
#include <utility>

#include "evaluate/drift/verdicts.hpp"
#include "files/json_text.hpp"
#include "numerics/parallel.hpp"
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

/// What recordings showed of a joint; nothing of it is in the registry yet.
struct Comparison {
  std::vector<RegisteredRecording> recordings;
  DriftEntry entry;
};

Comparison compare(Registry& registry, const FleetJoint& joint, const CalibrationRequest& request,
                   const Progress& progress) {
  const auto [id, model] = current_model(registry, joint.serial);
  LoadOptions options = load_options(request, progress);
  if (options.target.empty()) options.target = model.settings.target;
  options.default_mapping = model.card.mapping;
  options.default_mapping_place = "the model of " + joint.serial;
  std::vector<std::string> files = joint.train;
  files.insert(files.end(), joint.test.begin(), joint.test.end());
  const Dataset dataset = load_dataset({}, files, options);
  Comparison result;
  result.recordings.reserve(dataset.records.size());
  for (const DatasetRecord& record : dataset.records)
    result.recordings.push_back({.sha256 = record.recording.source.sha256,
                                 .device = joint.serial,
                                 .file = stored_path(record.recording.source.file),
                                 .samples = record.recording.size(),
                                 .rate_Hz = record.recording.sample_rate_Hz()});
  result.entry = entry_of(detect_drift(model, dataset, {}, progress));
  result.entry.device = joint.serial;
  result.entry.model = id;
  result.entry.recording = result.recordings.front().sha256;
  return result;
}

void enter(Registry& registry, const Comparison& comparison) {
  for (const RegisteredRecording& recording : comparison.recordings)
    registry.add_recording(recording);
  registry.add_drift(comparison.entry);
}

/// The comparisons of a list, by several threads.
class ListWatch {
 public:
  ListWatch(Registry& registry, const CalibrationRequest& request, const Progress& progress)
      : registry_(registry),
        request_(request),
        progress_(progress),
        outcomes_(request.joints.size()) {}

  std::vector<std::string> run(std::size_t threads) {
    for_each_chunk(outcomes_.size(), threads, [&](std::size_t joint) { compare_one(joint); });
    return std::move(failures_);
  }

 private:
  struct Outcome {
    Comparison comparison = {};
    std::string failure = {};
  };

  void compare_one(std::size_t joint) {
    const FleetJoint& of = request_.joints[joint];
    Outcome outcome;
    guarded(outcome, [&] {
      outcome.comparison = compare(registry_, of, request_, [this](double, std::string_view) {
        const std::scoped_lock lock(guard_);
        return report();
      });
    });
    const std::scoped_lock lock(guard_);
    outcomes_[joint] = std::move(outcome);
    enter_finished();
    if (!report()) throw Cancelled();
  }

  /// In the order of the list, so that the history does not depend on the threads.
  void enter_finished() {
    for (; entered_ < outcomes_.size() && outcomes_[entered_]; ++entered_) {
      Outcome& outcome = *outcomes_[entered_];
      if (outcome.failure.empty()) guarded(outcome, [&] { enter(registry_, outcome.comparison); });
      if (!outcome.failure.empty())
        failures_.push_back(
            fmt::format("{}: {}", request_.joints[entered_].serial, outcome.failure));
      outcome = {};
    }
  }

  [[nodiscard]] bool report() const {
    const double share = static_cast<double>(entered_) / static_cast<double>(outcomes_.size());
    return !progress_ || progress_(share, "comparing joints");
  }

  /// An error is the failure of its joint alone.
  template <class Work>
  static void guarded(Outcome& outcome, const Work& work) {
    try {
      work();
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      outcome.failure = error.what();
    }
  }

  Registry& registry_;
  const CalibrationRequest& request_;
  const Progress& progress_;
  std::mutex guard_;  // guards all that follows, and the listener
  std::vector<std::optional<Outcome>> outcomes_;
  std::size_t entered_ = 0;
  std::vector<std::string> failures_;
};

WatchedJoint watched(Registry& registry, const DeviceSummary& summary) {
  WatchedJoint joint{.serial = summary.device.serial, .type = summary.device.type};
  if (summary.current) joint.model = summary.current->id;
  std::vector<DriftEntry> history = registry.drift_history(joint.serial);
  // A comparison with an earlier model does not show how the current one has drifted.
  joint.earlier_comparisons =
      std::erase_if(history, [&](const DriftEntry& entry) { return joint.model != entry.model; });
  joint.comparisons = history.size();
  if (history.empty()) return joint;
  joint.last = history.back();
  joint.severity = severity_of(history.back());
  const WatchJson details = details_of(history.back());
  joint.worst = details.value("worst", std::string());
  joint.advice = details.value("advice", std::string());
  if (details.contains("calibration_rmse") && details["calibration_rmse"].is_number())
    joint.error_ratio = history.back().rmse / details["calibration_rmse"].get<double>();
  if (history.size() > 1) joint.severity_before = severity_of(history[history.size() - 2]);
  return joint;
}

/// The lowest first: what there is something to do about, what is open, what is sound, what was not compared.
int urgency(const WatchedJoint& joint) {
  if (!joint.last) return 3;
  if (joint.last->verdict == name(DriftVerdict::changed)) return 0;
  for (const DriftAdvice advice :
       {DriftAdvice::calibrate, DriftAdvice::set_zero, DriftAdvice::check_sensor})
    if (joint.advice == name(advice)) return 0;
  return joint.last->verdict == name(DriftVerdict::not_changed) ? 2 : 1;
}

}  // namespace

void watch_joint(Registry& registry, const FleetJoint& joint, const CalibrationRequest& request,
                 const Progress& progress) {
  enter(registry, compare(registry, joint, request, progress));
}

std::vector<std::string> watch_joints(Registry& registry, const CalibrationRequest& request,
                                      std::size_t threads, const Progress& progress) {
  return ListWatch(registry, request, progress).run(threads);
}

std::vector<WatchedJoint> rank_by_drift(Registry& registry) {
  std::vector<WatchedJoint> joints;
  const std::vector<DeviceSummary> summaries = registry.summaries();
  joints.reserve(summaries.size());
  for (const DeviceSummary& summary : summaries) joints.push_back(watched(registry, summary));
  std::ranges::stable_sort(joints, {}, [](const WatchedJoint& joint) {
    const auto descending = [](double value) {
      return std::isfinite(value) ? -value : std::numeric_limits<double>::infinity();
    };
    return std::tuple(urgency(joint), descending(joint.severity), descending(joint.error_ratio));
  });
  return joints;
}

}  // namespace torsio
