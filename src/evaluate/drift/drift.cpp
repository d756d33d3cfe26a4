#include "torsio/evaluate/drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "check/advise/strokes.hpp"
#include "core/report_progress.hpp"
#include "evaluate/drift/compared_run.hpp"
#include "evaluate/drift/direction_fit.hpp"
#include "evaluate/drift/drive_friction.hpp"
#include "evaluate/drift/joint_difference.hpp"
#include "evaluate/drift/torque_parts.hpp"
#include "evaluate/drift/verdicts.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

// Thresholds: chosen on the seeds of `--campaign` from 1000 on, which are not those of the results
// (docs/robot/drift.md).
constexpr double kScaleTolerance = 0.012;  // a load cell that was remounted
constexpr double kSmallestScale = 0.03;
constexpr double kFrictionTolerance = 0.04;
constexpr double kSmallestFriction = 0.10;
constexpr double kPlayTolerance = 0.0025;  // over half of the range of x
constexpr double kSmallestPlay = 0.01;
constexpr double kPlayWidth = 0.01;
constexpr double kZeroTolerance = 0.002;  // over the largest torque of the model

constexpr double kLeastTravel = 0.1;  // over the range of the training
constexpr double kReversal = 0.05;    // over the range of the training
constexpr std::size_t kLeastReversals = 2;
constexpr double kLeastFriction = 0.5;  // loop of the model over its error

double root_mean_square(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// RMSE of the model file: of its held-out data, else of its error bars.
double calibration_rmse(const ModelFile& model) {
  if (const auto found = model.card.metrics.find("rmse");
      found != model.card.metrics.end() && std::isfinite(found->second))
    return found->second;
  std::vector<double> errors;
  for (const double error : model.settings.residuals.std_dev)
    if (std::isfinite(error)) errors.push_back(error);
  return errors.empty() ? kNotMeasured : root_mean_square(errors);
}

/// Directions besides zero, scale, friction and backlash.
struct FurtherDirections {
  bool has_widening = false;
  bool has_asymmetry = false;

  [[nodiscard]] std::size_t count() const noexcept {
    return (has_widening ? 1U : 0U) + (has_asymmetry ? 1U : 0U);
  }
};

/// The comparison of all recordings.
class Comparison {
 public:
  Comparison(const ModelFile& model, const Dataset& dataset, const DriftOptions& options,
             const Progress& progress)
      : model_(model), options_(options) {
    TrainingData data = training_data(dataset, model.settings.features, Role::test);
    auto sequence = data.sequences.begin();
    for (std::size_t index = 0; index < dataset.records.size(); ++index) {
      const DatasetRecord& record = dataset.records[index];
      if (!record.has_role(Role::test)) continue;
      records_.push_back(index);
      report_progress(
          progress, static_cast<double>(runs_.size()) / static_cast<double>(dataset.records.size()),
          "comparing");
      runs_.push_back(compared_run(model, record, dataset, std::move(*sequence++)));
    }
    const FeatureRanges& ranges = model.settings.ranges;
    lowest_ = ranges.lowest.front();
    highest_ = ranges.highest.front();
    if (output_falls()) mirror();
    observe_motion();
    std::vector<PartsRun> parts;
    for (const ComparedRun& run : runs_)
      parts.push_back(
          {.x = run.x, .features = &run.features, .output = run.output, .rows = run.rows});
    parts_ = torque_parts(parts, lowest_, highest_);
  }

  [[nodiscard]] Drift drift() {
    Drift drift = errors();
    DirectionFit fit = fit_of_directions({});
    // Friction that has changed much may have other break-away angles, too.
    if (has_much_other_friction(fit)) fit = fit_of_directions({.has_widening = true});
    describe(fit, drift);
    conclude(drift);
    return drift;
  }

  [[nodiscard]] Drift difference() {
    Drift drift = errors();
    const DirectionFit fit = fit_of_directions({.has_widening = true, .has_asymmetry = true});
    describe(fit, drift);
    const LastingError model_error = fit.lasting_error(noise_lag(runs_.front()));
    drift.quantities.push_back(
        further_quantity(drift_names::kAsymmetry, fit, kAsymmetry, model_error, kSmallestScale));
    drift.quantities.push_back(
        further_quantity(drift_names::kBreakAway, fit, kWidening, model_error, kSmallestFriction));
    conclude(drift);
    return drift;
  }

  [[nodiscard]] const std::vector<ComparedRun>& runs() const noexcept { return runs_; }

 private:
  static constexpr std::size_t kWidening = 4;
  static constexpr std::size_t kAsymmetry = 5;  // with the widening

  [[nodiscard]] Drift errors() {
    Drift drift;
    drift.calibration_rmse = calibration_rmse(model_);
    collect(drift);
    return drift;
  }

  /// What remains, and the four quantities.
  void describe(const DirectionFit& fit, Drift& drift) const {
    drift.samples = residual_.size();
    drift.effective_samples = fit.effective_samples;
    drift.corrected_rmse = fit.residual_rms();
    const LastingError model_error = fit.lasting_error(noise_lag(runs_.front()));
    drift.quantities = {zero(fit, model_error), scale(fit, model_error), friction(fit, model_error),
                        backlash(fit, model_error)};
    if (options_.with_residual) list_residual(fit, drift);
  }

  [[nodiscard]] double half() const { return 0.5 * (highest_ - lowest_); }

  /// Whether the torque falls with x, as where the deflection is counted the other way.
  [[nodiscard]] bool output_falls() const {
    double covariance = 0.0;
    for (const ComparedRun& run : runs_) {
      const auto count = static_cast<double>(run.rows.size());
      double x = 0.0;
      double y = 0.0;
      for (const std::size_t n : run.rows) {
        x += run.x[n] / count;
        y += run.output[n] / count;
      }
      for (const std::size_t n : run.rows) covariance += (run.x[n] - x) * (run.output[n] - y);
    }
    return covariance < 0.0;
  }

  /// Counts x the other way, so that friction and stiffness are positive.
  void mirror() {
    for (ComparedRun& run : runs_)
      for (double& value : run.x) value = -value;
    std::swap(lowest_, highest_);
    lowest_ = -lowest_;
    highest_ = -highest_;
  }

  void observe_motion() {
    double least = runs_.front().x.front();
    double most = least;
    for (const ComparedRun& run : runs_) {
      for (const std::size_t n : run.rows) {
        least = std::min(least, run.x[n]);
        most = std::max(most, run.x[n]);
      }
      const auto strokes =
          strokes_of(run.x, 2.0 * kReversal * half(), run.recording->sample_rate_Hz());
      reversals_ += strokes.empty() ? 0 : strokes.size() - 1;
    }
    travel_ = (most - least) / (highest_ - lowest_);
    if (travel_ >= kLeastTravel) return;
    throw Error(
        {.place = runs_.front().recording->name(),
         .problem = "too little motion to compare it with the model",
         .expected = fmt::format("{} that varies over {:.0f} % of its range in the training",
                                 model_.settings.features.inputs.front(), 100.0 * kLeastTravel),
         .found = fmt::format("{:.2g} %", 100.0 * travel_),
         .advice = "Load the joint as in the recordings of the calibration."});
  }

  void collect(Drift& drift) {
    for (const ComparedRun& run : runs_) {
      for (const std::size_t n : run.rows)
        residual_.push_back(run.target->values[n] - run.output[n]);
      drift.outside_samples += run.outside;
    }
    const auto count = static_cast<double>(residual_.size());
    const double mean = std::accumulate(residual_.begin(), residual_.end(), 0.0) / count;
    drift.rmse = root_mean_square(residual_);
    double zeroed = 0.0;
    for (const double error : residual_) zeroed += (error - mean) * (error - mean);
    drift.zeroed_rmse = std::sqrt(zeroed / count);
  }

  void list_residual(const DirectionFit& fit, Drift& drift) const {
    drift.residual.reserve(fit.residual.size());
    for (std::size_t r = 0; r < runs_.size(); ++r)
      for (const std::size_t n : runs_[r].rows) {
        const std::size_t row = drift.residual.size();
        drift.residual.push_back({.record = records_[r],
                                  .sample = n,
                                  .value = fit.residual[row],
                                  .elastic = parts_.elastic[row],
                                  .stiffness = parts_.stiffness[row]});
      }
  }

  [[nodiscard]] DirectionFit fit_of_directions(const FurtherDirections& further) const {
    return fit_directions(columns(further), residual_, options_.resamples, options_.seed);
  }

  [[nodiscard]] bool has_much_other_friction(const DirectionFit& fit) const {
    const DriftQuantity of = friction(fit, fit.lasting_error(noise_lag(runs_.front())));
    return of.verdict == DriftVerdict::changed && std::abs(of.relative) > kSmallestFriction;
  }

  [[nodiscard]] Matrix columns(const FurtherDirections& further) const {
    const std::size_t inputs = runs_.front().features.columns;
    const std::size_t own = 4 + further.count();
    Matrix columns(residual_.size(), own + inputs - 1);
    std::size_t row = 0;
    for (const ComparedRun& run : runs_)
      for (const std::size_t n : run.rows) {
        columns(row, 0) = 1.0;
        columns(row, 1) = parts_.elastic[row];
        columns(row, 2) = parts_.friction[row];
        if (std::isfinite(parts_.middle))
          columns(row, 3) =
              -parts_.stiffness[row] *
              std::clamp((run.x[n] - parts_.middle) / (kPlayWidth * half()), -1.0, 1.0);
        if (further.has_widening) columns(row, kWidening) = parts_.widening[row];
        if (further.has_asymmetry) columns(row, kAsymmetry) = std::abs(parts_.elastic[row]);
        for (std::size_t j = 1; j < inputs; ++j) columns(row, own + j - 1) = run.features(n, j);
        ++row;
      }
    return columns;
  }

  [[nodiscard]] DriftQuantity zero(const DirectionFit& fit, const LastingError& model_error) const {
    double largest = 0.0;
    for (const double torque : parts_.elastic) largest = std::max(largest, std::abs(torque));
    DriftQuantity result = direction_quantity(
        drift_names::kZero, unit_label(model_.settings.target), kNotMeasured, fit, 0, model_error,
        kZeroTolerance * largest, 2.0 * kZeroTolerance * largest);
    result.is_of_joint = false;
    return result;
  }

  [[nodiscard]] DriftQuantity scale(const DirectionFit& fit,
                                    const LastingError& model_error) const {
    double mean = 0.0;
    for (const double slope : parts_.stiffness) mean += slope;
    mean /= static_cast<double>(parts_.stiffness.size());
    return direction_quantity(drift_names::kScale, unit_label(model_.settings.target) + "/rad",
                              mean, fit, 1, model_error, kScaleTolerance, kSmallestScale);
  }

  [[nodiscard]] DriftQuantity friction(const DirectionFit& fit,
                                       const LastingError& model_error) const {
    double level = 0.0;
    for (const double torque : parts_.friction) level += std::abs(torque);
    level /= static_cast<double>(parts_.friction.size());
    DriftQuantity result =
        direction_quantity(drift_names::kFriction, unit_label(model_.settings.target), level, fit,
                           2, model_error, kFrictionTolerance, kSmallestFriction);
    if (level < kLeastFriction * model_error.rms) {
      result.verdict = DriftVerdict::undetermined;
      result.times_as_long = std::numeric_limits<double>::infinity();
      result.reason = "the model has no hysteresis loop above its error: fit one that has";
    } else if (reversals_ < kLeastReversals) {
      result.verdict = DriftVerdict::undetermined;
      result.times_as_long = kNotMeasured;
      result.reason = fmt::format("the motion reverses {} times: move to and fro", reversals_);
    }
    return result;
  }

  [[nodiscard]] DriftQuantity backlash(const DirectionFit& fit,
                                       const LastingError& model_error) const {
    DriftQuantity result = direction_quantity("backlash", "rad", kNotMeasured, fit, 3, model_error,
                                              kPlayTolerance * half(), kSmallestPlay * half());
    if (!std::isfinite(parts_.middle)) result.reason = "the torque does not pass through zero";
    return result;
  }

  /// @param smallest the smallest that counts; two fifths of it are tolerated, as of the scale and the friction
  [[nodiscard]] static DriftQuantity further_quantity(const char* of, const DirectionFit& fit,
                                                      std::size_t column,
                                                      const LastingError& model_error,
                                                      double smallest) {
    constexpr double kTolerated = 0.4;
    return direction_quantity(of, {}, 1.0, fit, column, model_error, kTolerated * smallest,
                              smallest);
  }

  const ModelFile& model_;
  const DriftOptions& options_;
  std::vector<ComparedRun> runs_;
  std::vector<std::size_t> records_;  ///< their places in the dataset
  double lowest_ = 0.0;
  double highest_ = 0.0;
  double travel_ = 0.0;
  std::size_t reversals_ = 0;
  TorqueParts parts_;
  std::vector<double> residual_;
};

void check_comparison(const ModelFile& model, const Dataset& dataset, const DriftOptions& options) {
  constexpr std::size_t kLeastResamples = 100;
  if (options.resamples < kLeastResamples)
    throw UsageError({.place = "resamples",
                      .expected = fmt::format("at least {}", kLeastResamples),
                      .found = fmt::format("{}", options.resamples)});
  for (const DatasetRecord& record : dataset.records) {
    require_length(record.recording);
    const std::string mistake = unit_doubt(record.recording, model.settings);
    if (!mistake.empty())
      throw Error(
          {.place = record.recording.name(),
           .problem =
               fmt::format("{} over {} differs from the training by the factor between {}",
                           model.settings.target, model.settings.features.inputs.front(), mistake),
           .expected = "the units of the training data",
           .found = mistake,
           .advice = "Check the units of the recording, or give the mapping of the training."});
  }
}

}  // namespace

std::string_view name(DriftVerdict verdict) noexcept {
  switch (verdict) {
    case DriftVerdict::not_changed: return "not changed";
    case DriftVerdict::changed: return "changed";
    case DriftVerdict::undetermined: break;
  }
  return "cannot be determined";
}

std::string_view name(DriftAdvice advice) noexcept {
  switch (advice) {
    case DriftAdvice::none: return "none";
    case DriftAdvice::set_zero: return "set the zero";
    case DriftAdvice::calibrate: return "calibrate";
    case DriftAdvice::other_motion: return "other motion";
    case DriftAdvice::check_sensor: return "check the sensor";
    case DriftAdvice::better_model: return "fit a better model";
    case DriftAdvice::record_more: break;
  }
  return "record more";
}

Drift detect_drift(const ModelFile& model, const Dataset& dataset, const DriftOptions& options,
                   const Progress& progress) {
  check_comparison(model, dataset, options);
  Drift drift = Comparison(model, dataset, options, progress).drift();
  if (options.reference != nullptr) {
    if (options.reference->settings.target != model.settings.target)
      throw UsageError({.place = "reference of the drift",
                        .expected = "a model of " + model.settings.target,
                        .found = "one of " + options.reference->settings.target});
    DriftOptions alone = options;
    alone.reference = nullptr;
    Comparison comparison(*options.reference, dataset, alone, progress);
    Drift reference = comparison.drift();
    const auto friction = drive_friction(*options.reference, dataset, comparison.runs(), alone);
    if (friction && !std::isfinite(friction->before)) distrust_scale(reference, friction->reason);
    separate_gain(drift, reference);
    if (friction) {
      const auto after =
          std::ranges::find(drift.quantities, drift_names::kFriction, &DriftQuantity::name);
      drift.quantities.insert(after + 1, *friction);
    }
  }
  return drift;
}

Drift joint_difference(const ModelFile& model, const Dataset& dataset, const DriftOptions& options,
                       const Progress& progress) {
  check_comparison(model, dataset, options);
  return Comparison(model, dataset, options, progress).difference();
}

}  // namespace torsio
