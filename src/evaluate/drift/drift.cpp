#include "torsio/evaluate/drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "check/strokes.hpp"
#include "core/report_progress.hpp"
#include "evaluate/drift/direction_fit.hpp"
#include "evaluate/drift/torque_parts.hpp"
#include "evaluate/drift/verdicts.hpp"
#include "fit/common/reference_check.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

// Thresholds: chosen on the seeds of `--campaign` from 1000 on, which are not those of the results
// (docs/drift.md).
constexpr double kQuantile = 1.96;         // 95 %
constexpr double kModelErrorShare = 0.3;   // share of the remaining residual
constexpr double kScaleTolerance = 0.012;  // a load cell that was remounted
constexpr double kSmallestScale = 0.03;
constexpr double kFrictionTolerance = 0.04;
constexpr double kSmallestFriction = 0.10;
constexpr double kPlayTolerance = 0.0025;  // over half of the range of x
constexpr double kSmallestPlay = 0.01;
constexpr double kPlayWidth = 0.01;
constexpr double kZeroTolerance = 0.002;  // over the largest torque of the model

constexpr std::size_t kLeastSamples = 200;
constexpr double kLeastDuration_s = 5.0;
constexpr double kLeastTravel = 0.1;  // over the range of the training
constexpr double kManyOutside = 0.5;
constexpr double kReversal = 0.05;  // over the range of the training
constexpr std::size_t kLeastReversals = 2;
constexpr double kLeastFriction = 0.5;  // loop of the model over its error

struct Compared {
  std::vector<double> x;
  Matrix features;
  std::vector<double> output;
  std::vector<std::size_t> rows;
  const Channel* target = nullptr;
  const Recording* recording = nullptr;
  std::size_t outside = 0;
};

double root_mean_square(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

std::string seconds(double value) { return fmt::format("{:.3g} s", value); }

void check_torque(const Compared& of) {
  std::vector<double> estimated;
  std::vector<double> measured;
  for (const std::size_t n : of.rows) {
    estimated.push_back(of.output[n]);
    measured.push_back(of.target->values[n]);
  }
  require_plausible_reference(of.recording->name() + ": " + of.target->name, {estimated, measured});
}

[[noreturn]] void refuse_short(const Recording& recording, std::string found) {
  throw Error(
      {.place = recording.name(),
       .problem = "too short to compare it with the model",
       .expected = fmt::format("at least {} and {} measured samples after the model has settled",
                               seconds(kLeastDuration_s), kLeastSamples),
       .found = std::move(found),
       .advice = "Record about a minute of slow motion in both directions."});
}

void check_length(const Recording& recording) {
  const double measured_s = static_cast<double>(recording.size()) / recording.sample_rate_Hz();
  if (measured_s < kLeastDuration_s) refuse_short(recording, seconds(measured_s));
}

Compared compare(const ModelFile& model, const DatasetRecord& record, const Dataset& dataset,
                 Sequence sequence) {
  const Recording& recording = record.recording;
  Compared of{.x = {},
              .features = std::move(sequence.features),
              .output = {},
              .rows = {},
              .target = &recording.channel(dataset.target),
              .recording = &recording};
  const Prediction prediction = predict(make_estimator(model, recording.sample_rate_Hz()),
                                        recording, {of.target, dataset.initialise_samples});
  double last = 0.0;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    if (std::isfinite(of.features(n, 0))) last = of.features(n, 0);
    of.x.push_back(last);
    const Estimate& estimate = prediction.estimates[n];
    of.output.push_back(estimate.value);
    if (sequence.use[n] == 0 || n < prediction.initialised) continue;
    if (estimate.fault == Fault::warming_up) continue;
    if (estimate.fault != Fault::none) {
      ++of.outside;
    } else {
      of.rows.push_back(n);
    }
  }
  if (static_cast<double>(of.outside) >
      kManyOutside * static_cast<double>(of.outside + of.rows.size()))
    throw Error(
        {.place = recording.name(),
         .problem = "the model cannot be compared with it",
         .expected = "a motion within the range of the training",
         .found = fmt::format("{} of {} samples with a fault of the model", of.outside,
                              of.outside + of.rows.size()),
         .advice = "torsio estimate states the faults; record a motion as in the training."});
  if (of.rows.size() < kLeastSamples)
    refuse_short(recording, fmt::format("{} samples", of.rows.size()));
  check_torque(of);
  return of;
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

/// The comparison of all recordings.
class Comparison {
 public:
  Comparison(const ModelFile& model, const Dataset& dataset, const DriftOptions& options,
             const Progress& progress)
      : model_(model), options_(options) {
    TrainingData data = training_data(dataset, model.settings.features, Role::test);
    auto sequence = data.sequences.begin();
    for (const DatasetRecord& record : dataset.records) {
      if (!record.has_role(Role::test)) continue;
      report_progress(
          progress, static_cast<double>(runs_.size()) / static_cast<double>(dataset.records.size()),
          "comparing");
      runs_.push_back(compare(model, record, dataset, std::move(*sequence++)));
    }
    const FeatureRanges& ranges = model.settings.ranges;
    lowest_ = ranges.lowest.front();
    highest_ = ranges.highest.front();
    if (output_falls()) mirror();
    observe_motion();
    std::vector<PartsRun> parts;
    for (const Compared& run : runs_)
      parts.push_back(
          {.x = run.x, .features = &run.features, .output = run.output, .rows = run.rows});
    parts_ = torque_parts(parts, lowest_, highest_);
  }

  [[nodiscard]] Drift drift() {
    Drift drift;
    drift.calibration_rmse = calibration_rmse(model_);
    collect(drift);
    build_columns();
    const DirectionFit fit = fit_directions(columns_, residual_, options_.resamples, options_.seed);
    drift.samples = residual_.size();
    drift.effective_samples = fit.effective_samples;
    drift.corrected_rmse = root_mean_square(fit.residual);
    const double model_error = drift.corrected_rmse;
    drift.quantities = {zero(fit, model_error), scale(fit, model_error), friction(fit, model_error),
                        backlash(fit, model_error)};
    conclude(drift);
    return drift;
  }

 private:
  [[nodiscard]] double half() const { return 0.5 * (highest_ - lowest_); }

  /// Whether the torque falls with x, as where the deflection is counted the other way.
  [[nodiscard]] bool output_falls() const {
    double covariance = 0.0;
    for (const Compared& run : runs_) {
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
    for (Compared& run : runs_)
      for (double& value : run.x) value = -value;
    std::swap(lowest_, highest_);
    lowest_ = -lowest_;
    highest_ = -highest_;
  }

  void observe_motion() {
    double least = runs_.front().x.front();
    double most = least;
    for (const Compared& run : runs_) {
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
    for (const Compared& run : runs_) {
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

  void build_columns() {
    const std::size_t inputs = runs_.front().features.columns;
    columns_ = Matrix(residual_.size(), 4 + inputs - 1);
    std::size_t row = 0;
    for (const Compared& run : runs_)
      for (const std::size_t n : run.rows) {
        columns_(row, 0) = 1.0;
        columns_(row, 1) = parts_.elastic[row];
        columns_(row, 2) = parts_.friction[row];
        if (std::isfinite(parts_.middle))
          columns_(row, 3) =
              -parts_.stiffness[row] *
              std::clamp((run.x[n] - parts_.middle) / (kPlayWidth * half()), -1.0, 1.0);
        for (std::size_t j = 1; j < inputs; ++j) columns_(row, 3 + j) = run.features(n, j);
        ++row;
      }
  }

  /// The change in units of `before`, with the verdict.
  [[nodiscard]] static DriftQuantity quantity(std::string of, std::string unit, double before,
                                              const DirectionFit& fit, std::size_t column,
                                              double model_error, double tolerance,
                                              double smallest) {
    DriftQuantity result{.name = std::move(of), .unit = std::move(unit), .before = before};
    const double scale = std::isfinite(before) ? before : 1.0;
    result.tolerance = tolerance * scale;
    result.smallest = smallest * scale;
    if (!(fit.own_rms[column] > 0.0)) {
      result.reason = "this motion does not separate it from the other changes";
      return result;
    }
    const double error = std::hypot(fit.standard_errors[column],
                                    kModelErrorShare * model_error / fit.own_rms[column]);
    const double change = fit.coefficients[column];
    result.change = change * scale;
    result.relative = std::isfinite(before) ? change : kNotMeasured;
    if (!std::isfinite(error)) {
      result.reason = fmt::format(
          "the remaining error changes slowly, {:.0f} independent samples: record more, or fit a "
          "model with a smaller error",
          fit.effective_samples);
      return result;
    }
    decide(result, change * scale, kQuantile * error * scale);
    return result;
  }

  [[nodiscard]] DriftQuantity zero(const DirectionFit& fit, double model_error) const {
    double largest = 0.0;
    for (const double torque : parts_.elastic) largest = std::max(largest, std::abs(torque));
    DriftQuantity result =
        quantity(drift_names::kZero, unit_label(model_.settings.target), kNotMeasured, fit, 0,
                 model_error, kZeroTolerance * largest, 2.0 * kZeroTolerance * largest);
    result.is_of_joint = false;
    return result;
  }

  [[nodiscard]] DriftQuantity scale(const DirectionFit& fit, double model_error) const {
    double mean = 0.0;
    for (const double slope : parts_.stiffness) mean += slope;
    mean /= static_cast<double>(parts_.stiffness.size());
    return quantity(drift_names::kScale, unit_label(model_.settings.target) + "/rad", mean, fit, 1,
                    model_error, kScaleTolerance, kSmallestScale);
  }

  [[nodiscard]] DriftQuantity friction(const DirectionFit& fit, double model_error) const {
    double level = 0.0;
    for (const double torque : parts_.friction) level += std::abs(torque);
    level /= static_cast<double>(parts_.friction.size());
    DriftQuantity result =
        quantity(drift_names::kFriction, unit_label(model_.settings.target), level, fit, 2,
                 model_error, kFrictionTolerance, kSmallestFriction);
    if (level < kLeastFriction * model_error) {
      result.verdict = DriftVerdict::undetermined;
      result.reason = "the model has no hysteresis loop above its error: fit one that has";
    } else if (reversals_ < kLeastReversals) {
      result.verdict = DriftVerdict::undetermined;
      result.reason = fmt::format("the motion reverses {} times: move to and fro", reversals_);
    }
    return result;
  }

  [[nodiscard]] DriftQuantity backlash(const DirectionFit& fit, double model_error) const {
    DriftQuantity result = quantity("backlash", "rad", kNotMeasured, fit, 3, model_error,
                                    kPlayTolerance * half(), kSmallestPlay * half());
    if (!std::isfinite(parts_.middle)) result.reason = "the torque does not pass through zero";
    return result;
  }

  const ModelFile& model_;
  const DriftOptions& options_;
  std::vector<Compared> runs_;
  double lowest_ = 0.0;
  double highest_ = 0.0;
  double travel_ = 0.0;
  std::size_t reversals_ = 0;
  TorqueParts parts_;
  std::vector<double> residual_;
  Matrix columns_;
};

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
    case DriftAdvice::record_more: break;
  }
  return "record more";
}

Drift detect_drift(const ModelFile& model, const Dataset& dataset, const DriftOptions& options,
                   const Progress& progress) {
  constexpr std::size_t kLeastResamples = 100;
  if (options.resamples < kLeastResamples)
    throw UsageError({.place = "resamples",
                      .expected = fmt::format("at least {}", kLeastResamples),
                      .found = fmt::format("{}", options.resamples)});
  for (const DatasetRecord& record : dataset.records) {
    check_length(record.recording);
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
  Drift drift = Comparison(model, dataset, options, progress).drift();
  if (options.reference != nullptr) {
    if (options.reference->settings.target != model.settings.target)
      throw UsageError({.place = "reference of the drift",
                        .expected = "a model of " + model.settings.target,
                        .found = "one of " + options.reference->settings.target});
    DriftOptions alone = options;
    alone.reference = nullptr;
    separate_gain(drift, detect_drift(*options.reference, dataset, alone, progress));
  }
  return drift;
}

}  // namespace torsio
