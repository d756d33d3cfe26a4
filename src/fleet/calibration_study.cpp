#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "data/byte_source.hpp"
#include "evaluate/fit_and_score.hpp"
#include "files/whole_file.hpp"
#include "fleet/calibration.hpp"
#include "fleet/calibration_text.hpp"
#include "fleet/joint_traits.hpp"
#include "fleet/production_fault.hpp"
#include "search/changed_recording.hpp"
#include "search/stored_path.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "torsio/data/load.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/transfer.hpp"

namespace torsio {
namespace {

constexpr double kHeldOutShare = 0.3;
constexpr const char* kBase = "base";
constexpr const char* kOwnFit = "own fit";
constexpr const char* kHeldOut = "the test recordings of its joint";

std::string simulated_serial(const SimulatedFleet& fleet, std::uint64_t number) {
  return fmt::format("{}#{:04}", fleet.actuator, number);
}

/// Absolute paths, and the hashes of those files that have none.
void identify_files(CalibrationRequest& request) {
  const auto identify = [&](std::string& file) {
    file = stored_path(file);
    if (!request.sha256.contains(file)) request.sha256[file] = sha256_of_file(file);
  };
  for (FleetJoint& joint : request.joints) {
    std::ranges::for_each(joint.train, identify);
    std::ranges::for_each(joint.test, identify);
  }
  if (!request.base.empty()) identify(request.base);
}

/// The hash of a file as it is now. @throws ChangedRecording if it cannot be read any longer.
std::string present_hash(const std::string& file) {
  try {
    return sha256_of_file(file);
  } catch (const Error& error) {
    throw ChangedRecording(error.report());
  }
}

bool has_failed(const std::vector<Finding>& findings) {
  return std::ranges::any_of(
      findings, [](const Finding& finding) { return finding.verdict == Verdict::fail; });
}

/// The last share of each training segment gets another role; its first samples keep theirs.
Dataset with_held_out(Dataset dataset, Role role) {
  for (DatasetRecord& record : dataset.records) {
    std::vector<Segment> segments;
    for (const Segment& segment : record.segments) {
      if (segment.role != Role::train) {
        segments.push_back(segment);
        continue;
      }
      const auto held_out = static_cast<std::size_t>(
          kHeldOutShare * static_cast<double>(segment.end - segment.begin));
      segments.push_back({segment.begin, segment.end - held_out, Role::train});
      segments.push_back({segment.end - held_out, segment.end, role});
    }
    record.segments = std::move(segments);
  }
  return dataset;
}

Dataset all_as(Dataset dataset, Role role) {
  for (DatasetRecord& record : dataset.records)
    record.segments = whole_record(record.recording.size(), role);
  return dataset;
}

double rmse_on(const ModelFile& file, const Dataset& dataset, Role role, const Progress& progress) {
  return evaluate(make_estimator(file), dataset, role, progress).together.metrics.rmse;
}

}  // namespace

class CalibrationStudy::Plan {
 public:
  explicit Plan(CalibrationRequest request) : request_(std::move(request)) {
    identify_files(request_);
    if (request_.simulated) faults_ = planted_faults(*request_.simulated, request_.seed);
  }

  [[nodiscard]] const CalibrationRequest& request() const noexcept { return request_; }

  [[nodiscard]] std::vector<Trial> first_trials() const {
    std::vector<Trial> trials;
    const auto add = [&](const FleetJoint& joint) {
      trials.push_back({.key = joint.serial,
                        .spec = task_text(joint, request_.sha256),
                        .group = "joints",
                        .device = joint.serial,
                        .priority = 1.0});
    };
    for (const FleetJoint& joint : request_.joints) add(joint);
    if (request_.simulated)
      for (std::uint64_t n = request_.simulated->first; n <= request_.simulated->last; ++n)
        add({.serial = simulated_serial(*request_.simulated, n),
             .type = request_.simulated->actuator});
    return trials;
  }

  TrialResult run(const Claim& claim, const Progress& progress) {
    FileHashes sha256;
    const FleetJoint task = task_from_text(claim.spec, sha256);
    CalibratedJoint joint{.serial = task.serial, .type = task.type};
    std::optional<ModelFile> model;
    try {
      model = calibrate(task, joint, progress);
    } catch (const Cancelled&) {
      throw;
    } catch (const ChangedRecording&) {
      throw;
    } catch (const Error& error) {
      joint.failure = error.what();
    }
    TrialResult result{.is_failed = !joint.failure.empty(),
                       .value = request_.only_compares ? joint.traits.rmse : joint.test_rmse,
                       .reason = joint.failure,
                       .result = joint_text(joint)};
    if (model) result.samples = text_of(model_bytes(*model));
    return result;
  }

 private:
  /// What joints of a type are compared with.
  struct Base {
    ModelFile file;
    std::string sha256;
    std::string serial;  ///< the joint whose model it is; empty: it is a file
  };

  static std::string text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  /// @param read what was made of the files: the hashes of recordings were found as they were read
  void refuse_changed_files(const FleetJoint& joint, const Dataset& read = {}) const {
    for (const std::vector<std::string>* files : {&joint.train, &joint.test})
      for (const std::string& file : *files) {
        const auto record = std::ranges::find_if(read.records, [&](const DatasetRecord& each) {
          return each.recording.source.file == file && !each.recording.source.sha256.empty();
        });
        refuse_changed_recording(
            file, request_.sha256.at(file),
            record == read.records.end() ? present_hash(file) : record->recording.source.sha256);
      }
  }

  [[nodiscard]] Dataset recordings_of(const FleetJoint& joint, const Progress& progress) const {
    if (request_.simulated)
      return production_recordings(joint.serial, fault_of(joint.serial), request_.seed, progress);
    Dataset dataset;
    try {
      dataset = load_dataset(joint.train, joint.test, load_options(request_, progress));
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {  // perhaps since a file has changed
      refuse_changed_files(joint);
      throw;
    }
    refuse_changed_files(joint, dataset);
    if (!dataset.has_role(Role::test)) dataset = with_held_out(std::move(dataset), Role::test);
    dataset.check();
    return dataset;
  }

  [[nodiscard]] std::optional<ProductionFault> fault_of(const std::string& serial) const {
    const auto fault = faults_.find(std::stoull(serial.substr(serial.find('#') + 1)));
    return fault == faults_.end() ? std::nullopt : std::optional(fault->second);
  }

  [[nodiscard]] ModelChoice choice_for(const Dataset& dataset) const {
    return model_choices(dataset, request_.model, request_.inputs).front();
  }

  /// Its model; none where the checks fail (`failure`) or joints are only compared.
  std::optional<ModelFile> calibrate(const FleetJoint& of, CalibratedJoint& joint,
                                     const Progress& progress) {
    if (request_.simulated)
      if (const auto fault = fault_of(of.serial)) {
        joint.fault = name(*fault);
        joint.fault_trait = trait_of(*fault);
      }
    const Dataset dataset = recordings_of(of, progress);
    const ModelChoice choice = choice_for(dataset);
    if (!request_.simulated) add_findings(check_dataset(dataset, choice.features), joint);
    if (!joint.failure.empty()) return std::nullopt;
    const std::shared_ptr<const Base> base = base_of(of.type, progress);
    joint.traits = joint_traits(base->file, all_as(dataset, Role::test), progress);
    if (request_.only_compares) return std::nullopt;

    joint.methods.push_back(
        {.name = kBase, .test_rmse = rmse_on(base->file, dataset, Role::test, progress)});
    if (base->serial == of.serial) {
      joint.chosen = kBase;
      joint.test_rmse = joint.methods.front().test_rmse;
      return base->file;
    }
    ModelFile model = best_model(*base, dataset, choice, joint, progress);
    model.card.device_serial = of.serial;
    model.card.held_out = kHeldOut;
    model.card.metrics = {{"rmse", joint.test_rmse}};
    return model;
  }

  /// The best on the held-out samples of the base, the base transferred to the joint, and a fit to the joint.
  ModelFile best_model(const Base& base, const Dataset& dataset, const ModelChoice& choice,
                       CalibratedJoint& joint, const Progress& progress) const {
    std::optional<TransferTrial> best = transferred(base.file, dataset, joint, progress);
    if (best)
      joint.methods.push_back({.name = fmt::format("transfer: {}", name(best->method)),
                               .held_out_rmse = best->held_out_rmse,
                               .test_rmse = rmse_on(best->file, dataset, Role::test, progress)});

    const Dataset cut = with_held_out(dataset, Role::validation);
    const ModelFile first_part = train_model(cut, choice, request_.seed, progress).file;
    ModelFile own = train_model(dataset, choice, request_.seed, progress).file;
    joint.methods.push_back({.name = kOwnFit,
                             .held_out_rmse = rmse_on(first_part, cut, Role::validation, progress),
                             .test_rmse = rmse_on(own, dataset, Role::test, progress)});
    const auto chosen =
        std::ranges::min_element(joint.methods, {}, [](const CalibratedJoint::Method& method) {
          return std::isfinite(method.held_out_rmse) ? method.held_out_rmse
                                                     : std::numeric_limits<double>::infinity();
        });
    joint.chosen = chosen->name;
    joint.test_rmse = chosen->test_rmse;
    if (joint.chosen == kOwnFit) return own;
    joint.base_sha256 = base.sha256;
    if (joint.chosen == kBase) return base.file;
    return std::move(best->file);
  }

  /// The best way to bring the base to the joint; none for a family that cannot be transferred.
  static std::optional<TransferTrial> transferred(const ModelFile& base, const Dataset& dataset,
                                                  CalibratedJoint& joint,
                                                  const Progress& progress) {
    try {
      TransferResult result =
          transfer_model(base, dataset, {.held_out_share = kHeldOutShare}, progress);
      for (const TransferTrial& trial : result.trials)
        if (trial.method == TransferMethod::none)
          joint.methods.front().held_out_rmse = trial.held_out_rmse;
      return std::move(result.trials[result.chosen]);
    } catch (const UsageError& error) {
      joint.warnings.push_back(fmt::format("no transfer: {}", error.what()));
      return std::nullopt;
    }
  }

  static void add_findings(const std::vector<Finding>& findings, CalibratedJoint& joint) {
    for (const Finding& finding : findings) {
      if (finding.verdict == Verdict::pass) continue;
      std::string text = finding.check + ": " + finding.message;
      if (finding.verdict == Verdict::fail) {
        if (!joint.failure.empty()) joint.failure += "; ";
        joint.failure += text;
      } else {
        joint.warnings.push_back(std::move(text));
      }
    }
  }

  /// The base of a type, made once.
  std::shared_ptr<const Base> base_of(const std::string& type, const Progress& progress) {
    const std::scoped_lock lock(guard_);
    std::shared_ptr<const Base>& known = bases_[request_.base.empty() ? type : ""];
    if (!known)
      known = std::make_shared<const Base>(request_.base.empty() ? first_model(type, progress)
                                                                 : base_in_file());
    return known;
  }

  [[nodiscard]] Base base_in_file() const {
    const std::vector<std::byte> bytes = read_whole_file(request_.base, kMaxModelFileBytes);
    std::string sha256 = sha256_hex(text_of(bytes));
    refuse_changed_recording(request_.base, request_.sha256.at(request_.base), sha256);
    return {.file = parse_model(bytes, request_.base), .sha256 = std::move(sha256), .serial = {}};
  }

  /// The model of the first joint of a type whose recordings are usable.
  [[nodiscard]] Base first_model(const std::string& type, const Progress& progress) const {
    if (request_.simulated)
      return model_as_base(
          {.serial = simulated_serial(*request_.simulated, request_.simulated->first),
           .type = type},
          progress);
    std::string last_problem;
    for (const FleetJoint& joint : request_.joints) {
      if (joint.type != type) continue;
      try {
        return model_as_base(joint, progress);
      } catch (const Cancelled&) {
        throw;
      } catch (const ChangedRecording&) {
        throw;
      } catch (const Error& error) {
        last_problem = error.what();
      }
    }
    throw Error({.place = "type " + type,
                 .problem = "none of its joints has recordings from which a base can be made: " +
                            last_problem});
  }

  [[nodiscard]] Base model_as_base(const FleetJoint& joint, const Progress& progress) const {
    const Dataset dataset = recordings_of(joint, progress);
    const ModelChoice choice = choice_for(dataset);
    if (!request_.simulated && has_failed(check_dataset(dataset, choice.features)))
      throw Error({.place = joint.serial, .problem = "its recordings do not pass the checks"});
    Base base{.file = train_model(dataset, choice, request_.seed, progress).file,
              .sha256 = {},
              .serial = joint.serial};
    // It becomes the model of this joint as it is, so that the hash leads to it.
    base.file.card.device_serial = joint.serial;
    base.file.card.held_out = kHeldOut;
    base.file.card.metrics = {{"rmse", rmse_on(base.file, dataset, Role::test, progress)}};
    base.sha256 = sha256_hex(text_of(model_bytes(base.file)));
    return base;
  }

  CalibrationRequest request_;
  std::map<std::uint64_t, ProductionFault> faults_;
  std::mutex guard_;
  std::map<std::string, std::shared_ptr<const Base>> bases_;
};

CalibrationStudy::CalibrationStudy(CalibrationRequest request)
    : plan_(std::make_unique<Plan>(std::move(request))) {}
CalibrationStudy::~CalibrationStudy() = default;

const CalibrationRequest& CalibrationStudy::request() const noexcept { return plan_->request(); }
std::vector<Trial> CalibrationStudy::first_trials() const { return plan_->first_trials(); }
TrialResult CalibrationStudy::run(const Claim& claim, const Progress& progress) {
  return plan_->run(claim, progress);
}

LoadOptions load_options(const CalibrationRequest& request, const Progress& progress) {
  LoadOptions options;
  options.progress = progress;
  if (!request.mapping.empty()) options.mapping = request.mapping;
  if (request.rate_Hz > 0.0) options.rate_Hz = request.rate_Hz;
  options.target = request.target;
  return options;
}

StoredStudy begin_calibration(StudyStore& store, const std::string& name,
                              const CalibrationStudy& kind) {
  const CalibrationRequest& request = kind.request();
  const std::string text = calibration_text(request);
  if (const auto known = store.find_study(name); known && known->kind == kCalibrationStudy) {
    for (const auto& [file, before] : calibration_from_text(known->spec).sha256)
      if (const auto now = request.sha256.find(file); now != request.sha256.end())
        refuse_changed_recording(file, before, now->second);
    if (known->spec != text && known->torsio_version == kVersion)
      throw UsageError(
          {.place = store.address().name(),
           .problem = fmt::format("study '{}' is another calibration; it differs in {}", name,
                                  calibration_differences(known->spec, text)),
           .advice = "Give this one a name of its own (--study NAME), or repeat the command that "
                     "began the other one to continue it."});
  }
  return store.create_or_resume({.name = name,
                                 .kind = std::string(kCalibrationStudy),
                                 .spec = text,
                                 .torsio_version = kVersion},
                                kind.first_trials());
}

std::unique_ptr<CalibrationStudy> calibration_study(const StoredStudy& study) {
  return std::make_unique<CalibrationStudy>(calibration_from_text(study.spec));
}

}  // namespace torsio
