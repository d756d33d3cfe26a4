#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "data/byte_source.hpp"
#include "evaluate/fit_and_score.hpp"
#include "fleet/calibration.hpp"
#include "fleet/calibration_text.hpp"
#include "fleet/joint_traits.hpp"
#include "fleet/production_fault.hpp"
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

std::string simulated_serial(const SimulatedFleet& fleet, std::uint64_t number) {
  return fmt::format("{}#{:04}", fleet.actuator, number);
}

/// Refuses files that are not those that the study began with.
void refuse_changed_files(const JointTask& task) {
  for (const auto& [file, sha256] : task.sha256)
    if (const std::string now = sha256_of_file(file); now != sha256)
      throw Error({.place = file,
                   .problem = "this recording has changed since the study began",
                   .expected = "SHA-256 " + sha256,
                   .found = now,
                   .advice = "Restore the file, or begin a study with another name."});
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
  explicit Plan(CalibrationRequest request) : request_(std::move(request)) {}

  [[nodiscard]] std::vector<Trial> first_trials() const {
    std::vector<Trial> trials;
    const auto add = [&](const FleetJoint& joint, std::string spec) {
      trials.push_back({.key = joint.serial,
                        .spec = std::move(spec),
                        .group = "joints",
                        .device = joint.serial,
                        .priority = 1.0});
    };
    for (const FleetJoint& joint : request_.joints) add(joint, task_text(joint));
    if (request_.simulated)
      for (std::uint64_t n = request_.simulated->first; n <= request_.simulated->last; ++n) {
        FleetJoint joint{.serial = simulated_serial(*request_.simulated, n),
                         .type = request_.simulated->actuator};
        std::string spec = task_text(joint);
        add(joint, std::move(spec));
      }
    return trials;
  }

  TrialResult run(const Claim& claim, const Progress& progress) {
    const JointTask task = task_from_text(claim.spec);
    refuse_changed_files(task);
    CalibratedJoint joint{.serial = task.joint.serial, .type = task.joint.type};
    std::optional<ModelFile> model;
    try {
      model = calibrate(task.joint, joint, progress);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      joint.failure = error.what();
    }
    TrialResult result{.is_failed = !joint.failure.empty(),
                       .value = request_.only_compares ? joint.traits.rmse : joint.test_rmse,
                       .reason = joint.failure,
                       .result = joint_text(joint)};
    if (model) {
      const std::vector<std::byte> bytes = model_bytes(*model);
      result.samples.resize(bytes.size());
      std::ranges::transform(bytes, result.samples.begin(),
                             [](std::byte byte) { return static_cast<char>(byte); });
    }
    return result;
  }

 private:
  [[nodiscard]] Dataset recordings_of(const FleetJoint& joint, const Progress& progress) const {
    if (request_.simulated)
      return production_recordings(joint.serial, fault_of(joint.serial), request_.seed, progress);
    Dataset dataset = load_dataset(joint.train, joint.test, load_options(request_, progress));
    if (!dataset.has_role(Role::test)) dataset = with_held_out(std::move(dataset), Role::test);
    dataset.check();
    return dataset;
  }

  [[nodiscard]] std::optional<ProductionFault> fault_of(const std::string& serial) const {
    const std::string number = serial.substr(serial.find('#') + 1);
    return planted_fault(*request_.simulated, request_.seed, std::stoull(number));
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
    if (!request_.simulated) add_findings(dataset, choice.features, joint);
    if (!joint.failure.empty()) return std::nullopt;
    const std::shared_ptr<const ModelFile> base = base_of(of.type, progress);
    joint.traits = joint_traits(*base, all_as(dataset, Role::test), progress);

    if (request_.only_compares) return std::nullopt;
    joint.methods.push_back(
        {.name = kBase, .test_rmse = rmse_on(*base, dataset, Role::test, progress)});
    const std::optional<TransferTrial> best = transferred(*base, dataset, joint, progress);
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
    ModelFile model = std::move(own);
    if (joint.chosen == kBase)
      model = *base;
    else if (joint.chosen != kOwnFit)
      model = best->file;
    model.card.device_serial = of.serial;
    model.card.held_out = "the test recordings of its joint";
    model.card.metrics = {{"rmse", joint.test_rmse}};
    return model;
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

  static void add_findings(const Dataset& dataset, const FeatureSpec& features,
                           CalibratedJoint& joint) {
    for (const Finding& finding : check_dataset(dataset, features)) {
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

  /// The model that joints of a type are compared with.
  std::shared_ptr<const ModelFile> base_of(const std::string& type, const Progress& progress) {
    const std::scoped_lock lock(guard_);
    std::shared_ptr<const ModelFile>& known = bases_[request_.base.empty() ? type : ""];
    if (known) return known;
    if (!request_.base.empty())
      return known = std::make_shared<const ModelFile>(load_model(request_.base));
    FleetJoint first;
    if (request_.simulated)
      first = {.serial = simulated_serial(*request_.simulated, request_.simulated->first),
               .type = type};
    else
      first = *std::ranges::find(request_.joints, type, &FleetJoint::type);
    const Dataset dataset = recordings_of(first, progress);
    return known = std::make_shared<const ModelFile>(
               train_model(dataset, choice_for(dataset), request_.seed, progress).file);
  }

  CalibrationRequest request_;
  std::mutex guard_;
  std::map<std::string, std::shared_ptr<const ModelFile>> bases_;
};

CalibrationStudy::CalibrationStudy(CalibrationRequest request)
    : plan_(std::make_unique<Plan>(std::move(request))) {}
CalibrationStudy::~CalibrationStudy() = default;

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
                              const CalibrationRequest& request, const CalibrationStudy& kind) {
  return store.create_or_resume({.name = name,
                                 .kind = std::string(kCalibrationStudy),
                                 .spec = calibration_text(request),
                                 .torsio_version = kVersion},
                                kind.first_trials());
}

std::unique_ptr<CalibrationStudy> calibration_study(const StoredStudy& study) {
  return std::make_unique<CalibrationStudy>(calibration_from_text(study.spec));
}

}  // namespace torsio
