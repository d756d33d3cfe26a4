#include "torsio/evaluate/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "data/recording_rows.hpp"
#include "evaluate/initial_state.hpp"
#include "evaluate/measured_samples.hpp"
#include "fit/common/finite_input.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Clock = std::chrono::steady_clock;

double nanoseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::nano>(duration).count();
}

/// The time of one reading of the clock, which every measured step includes.
double clock_cost_ns() {
  static const double cost = [] {
    double least = 1e9;
    for (int i = 0; i < 1000; ++i) {
      const auto start = Clock::now();
      least = std::min(least, nanoseconds(Clock::now() - start));
    }
    return least;
  }();
  return cost;
}

/// The raw inputs of an estimator, all of them finite.
RecordingRows raw_rows(const Estimator& estimator, const Recording& recording) {
  for (const std::string& input : estimator.raw_inputs()) (void)finite_input(recording, input);
  return {recording, estimator.raw_inputs()};
}

/// Counts how often the target is within one and two error bars, and adds up their width.
struct Coverage {
  std::size_t samples = 0;
  std::size_t without = 0;
  std::size_t within = 0;
  std::size_t within_2 = 0;
  double sum = 0.0;

  void add(const Estimate& estimate, double target) {
    if (!std::isfinite(estimate.std_dev)) {
      ++without;
      return;
    }
    sum += estimate.std_dev;
    const double error = std::abs(estimate.value - target);
    ++samples;
    if (error <= estimate.std_dev) ++within;
    if (error <= 2.0 * estimate.std_dev) ++within_2;
  }
  [[nodiscard]] double share(std::size_t count) const {
    return samples == 0 ? kNotMeasured : static_cast<double>(count) / static_cast<double>(samples);
  }
  [[nodiscard]] double mean() const {
    return samples == 0 ? kNotMeasured : sum / static_cast<double>(samples);
  }
  [[nodiscard]] double without_share() const {
    const std::size_t all = samples + without;
    return all == 0 ? kNotMeasured : static_cast<double>(without) / static_cast<double>(all);
  }
};

bool is_scored(const Prediction& prediction, std::size_t sample) {
  return prediction.estimates[sample].fault != Fault::warming_up &&
         sample >= prediction.initialised;
}

/// Appends the measured samples of a segment.
void append(MeasuredEstimates& estimates, const Prediction& prediction, const Channel& target,
            const Segment& segment) {
  for (std::size_t i = segment.begin; i < segment.end; ++i) {
    if (!is_measured(target, i)) continue;
    const bool scored = is_scored(prediction, i);
    estimates.values.push_back(scored ? prediction.estimates[i].value : kNotMeasured);
    estimates.guarded.push_back(scored && prediction.estimates[i].fault != Fault::none);
  }
}

/// Adds up one recording's, or a whole split's, samples.
struct Tally {
  MetricsAccumulator metrics;
  Coverage coverage;
  std::vector<double> step_ns;
  std::size_t initialised = 0;
  std::size_t guarded = 0;
  std::size_t diverged = 0;
  MetricsAccumulator one_step;

  void add_one_step(const Prediction& prediction, const Channel& target, const Segment& segment) {
    for (std::size_t i = segment.begin; i < segment.end; ++i)
      if (target.is_fresh(i) && prediction.estimates[i].fault != Fault::warming_up)
        one_step.add(prediction.estimates[i].value, target.values[i]);
  }
  void add(const Prediction& prediction, const Channel& target, const Segment& segment) {
    for (std::size_t i = segment.begin; i < segment.end; ++i) {
      const Estimate& estimate = prediction.estimates[i];
      step_ns.push_back(prediction.step_ns[i]);
      if (!is_measured(target, i)) continue;
      if (!is_scored(prediction, i)) {
        ++initialised;
        continue;
      }
      if (estimate.fault != Fault::none) ++guarded;
      if (estimate.fault == Fault::diverged || estimate.fault == Fault::model_not_finite)
        ++diverged;
      metrics.add(estimate.value, target.values[i]);
      coverage.add(estimate, target.values[i]);
    }
  }

  [[nodiscard]] Score score() const {
    return {.metrics = metrics.metrics(),
            .one_step = one_step.metrics(),
            .initialised_samples = initialised,
            .guarded_samples = guarded,
            .diverged_samples = diverged,
            .common = {},
            .within_std_dev = coverage.share(coverage.within),
            .within_2_std_dev = coverage.share(coverage.within_2),
            .mean_std_dev = coverage.mean(),
            .without_std_dev = coverage.without_share(),
            .step_ns_p50 = quantile(step_ns, 0.5),
            .step_ns_p999 = quantile(step_ns, 0.999)};
  }
};

/// The usual error of a model in the first samples of a recording: root mean square over the
/// regions of the residual table. NaN without a table, and for a family that integrates its input
/// (`FamilyTraits`), whose speed such a start would move towards rest.
double usual_error(const EstimatorSettings& settings, FamilyTraits traits) {
  if (traits.integrates) return kNotMeasured;
  double sum = 0.0;
  double count = 0.0;
  for (const double std_dev : settings.residuals.std_dev) {
    if (!std::isfinite(std_dev)) continue;
    sum += std_dev * std_dev;
    ++count;
  }
  return std::sqrt(sum / count);
}

/// Sets the state of the estimator's model by the first measured samples.
/// @returns how many samples these are, those between them that were not measured included.
std::size_t start_with(Estimator& estimator, RecordingRows& rows, const Corrections& corrections) {
  const Channel& target = *corrections.target;
  std::size_t samples = 0;
  for (std::size_t left = corrections.most; samples < target.values.size() && left > 0; ++samples)
    if (is_measured(target, samples)) --left;
  const EstimatorSettings& settings = estimator.settings();
  FeaturePipeline pipeline(settings.features, settings.sample_rate_Hz);
  Matrix features(samples, pipeline.feature_count());
  std::vector<double> measured(samples, kNotMeasured);
  for (std::size_t n = 0; n < samples; ++n) {
    std::ranges::copy(pipeline.step(rows.at(n)), features.row(n).begin());
    if (pipeline.is_settled() && target.is_fresh(n)) measured[n] = target.values[n];
  }
  start_where_measured(estimator.model(), features, measured,
                       usual_error(settings, estimator.model().traits()));
  return samples;
}

}  // namespace

Prediction predict(Estimator estimator, const Recording& recording,
                   const Corrections& corrections) {
  for (const std::string& channel : estimator.settings().zeroed_channels)
    estimator.set_zero(channel, 0.0);
  RecordingRows rows = raw_rows(estimator, recording);
  Prediction prediction;
  prediction.estimates.resize(recording.size());
  prediction.step_ns.resize(recording.size());
  const double clock_cost = clock_cost_ns();
  std::size_t left = estimator.model().feeds_back() ? corrections.most : 0;
  const DenormalsOff denormals_off;
  estimator.reset();
  if (!estimator.model().state().empty() && corrections.most > 0)
    prediction.initialised = start_with(estimator, rows, corrections);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const std::span<const double> raw = rows.at(i);
    const auto start = Clock::now();
    prediction.estimates[i] = estimator.step(raw);
    prediction.step_ns[i] = std::max(0.0, nanoseconds(Clock::now() - start) - clock_cost);
    if (left == 0 || !is_measured(*corrections.target, i)) continue;
    estimator.correct(corrections.target->values[i]);
    prediction.initialised = i + 1;
    --left;
  }
  return prediction;
}

SplitScore evaluate(const Estimator& estimator, const Dataset& dataset, Role role,
                    const Progress& progress) {
  SplitScore split;
  Tally together;
  std::size_t done = 0;
  for (const DatasetRecord& record : dataset.records) {
    report_progress(progress,
                    static_cast<double>(done++) / static_cast<double>(dataset.records.size()),
                    "scoring");
    if (!record.has_role(role)) continue;
    const Channel& target = record.recording.channel(dataset.target);
    const Prediction prediction =
        predict(estimator, record.recording, {&target, dataset.initialise_samples});
    std::optional<Prediction> one_step;
    if (estimator.model().feeds_back())
      one_step = predict(estimator, record.recording, {&target, record.recording.size()});
    Tally own;
    MeasuredEstimates estimates;
    for (const Segment& segment : record.segments) {
      if (segment.role != role) continue;
      append(estimates, prediction, target, segment);
      for (Tally* tally : {&own, &together}) {
        tally->add(prediction, target, segment);
        if (one_step) tally->add_one_step(*one_step, target, segment);
      }
    }
    split.recordings.push_back({record.recording.name(), own.score(), std::move(estimates)});
  }
  split.together = together.score();
  return split;
}

}  // namespace torsio
