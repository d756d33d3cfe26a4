#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include "core/report_progress.hpp"
#include "data/recording_rows.hpp"
#include "evaluate/initial_state.hpp"
#include "evaluate/measured_samples.hpp"
#include "fit/common/finite_input.hpp"
#include "fit/common/passes.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/signal/feature_pipeline.hpp"

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
  ++passes().predictions;
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

SensorUncertainty common_uncertainty(const EstimatorSettings& settings, const std::string& target) {
  return target == settings.target ? settings.target_uncertainty : SensorUncertainty{};
}

ScoredRun scored_run(const Estimator& estimator, const Dataset& dataset,
                     const DatasetRecord& record) {
  const Channel& target = record.recording.channel(dataset.target);
  // The torque of a known load has no error of the sensor.
  const bool is_same_sensor = !dataset.load_target.is_used();
  ScoredRun run{
      .record = &record,
      .target = &target,
      .prediction = predict(estimator, record.recording, {&target, dataset.initialise_samples}),
      .common = is_same_sensor ? common_uncertainty(estimator.settings(), dataset.target)
                               : SensorUncertainty{}};
  if (estimator.model().feeds_back())
    run.one_step = predict(estimator, record.recording, {&target, record.recording.size()});
  return run;
}

std::vector<ScoredRun> scored_runs(const Estimator& estimator, const Dataset& dataset,
                                   const Progress& progress) {
  dataset.check();
  std::vector<ScoredRun> runs;
  for (const DatasetRecord& record : dataset.records) {
    report_progress(progress,
                    static_cast<double>(runs.size()) / static_cast<double>(dataset.records.size()),
                    "scoring");
    if (!record.segments.empty()) runs.push_back(scored_run(estimator, dataset, record));
  }
  return runs;
}

}  // namespace torsio
