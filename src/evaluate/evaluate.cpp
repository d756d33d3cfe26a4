#include "torsio/evaluate/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/report_progress.hpp"
#include "evaluate/measured_samples.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "numerics/quantile.hpp"

namespace torsio {
namespace {

/// Counts how often the target is within one and two error bars, and adds up their width.
struct Coverage {
  std::size_t samples = 0;
  std::size_t without = 0;
  std::size_t within = 0;
  std::size_t within_2 = 0;
  double sum = 0.0;

  void add(double error, double std_dev) {
    if (!std::isfinite(std_dev)) {
      ++without;
      return;
    }
    sum += std_dev;
    ++samples;
    if (std::abs(error) <= std_dev) ++within;
    if (std::abs(error) <= 2.0 * std_dev) ++within_2;
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

/// Appends the measured samples of a segment.
void append(MeasuredEstimates& estimates, const ScoredRun& run, const Segment& segment) {
  for (std::size_t i = segment.begin; i < segment.end; ++i) {
    if (!is_measured(*run.target, i)) continue;
    const Estimate& estimate = run.prediction.estimates[i];
    const bool scored = run.is_scored(i);
    estimates.values.push_back(scored ? estimate.value : kNotMeasured);
    estimates.guarded.push_back(scored && estimate.fault != Fault::none);
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

  void add(const ScoredRun& run, const Segment& segment) {
    const Channel& target = *run.target;
    for (std::size_t i = segment.begin; i < segment.end; ++i) {
      const Estimate& estimate = run.prediction.estimates[i];
      step_ns.push_back(run.prediction.step_ns[i]);
      if (!is_measured(target, i)) continue;
      if (!run.is_scored(i)) {
        ++initialised;
        continue;
      }
      if (estimate.fault != Fault::none) ++guarded;
      if (estimate.fault == Fault::diverged || estimate.fault == Fault::model_not_finite)
        ++diverged;
      metrics.add(estimate.value, target.values[i]);
      coverage.add(estimate.value - target.values[i], run.compared_std_dev(i));
    }
    if (run.one_step) add_one_step(*run.one_step, target, segment);
  }
  void add_one_step(const Prediction& prediction, const Channel& target, const Segment& segment) {
    for (std::size_t i = segment.begin; i < segment.end; ++i)
      if (target.is_fresh(i) && prediction.estimates[i].fault != Fault::warming_up)
        one_step.add(prediction.estimates[i].value, target.values[i]);
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

/// Scores the runs of one role, one after the other.
class SplitTally {
 public:
  explicit SplitTally(Role role) : role_(role) {}

  void add(const ScoredRun& run) {
    if (!run.record->has_role(role_)) return;
    Tally own;
    MeasuredEstimates estimates;
    for (const Segment& segment : run.record->segments) {
      if (segment.role != role_) continue;
      append(estimates, run, segment);
      for (Tally* tally : {&own, &together_}) tally->add(run, segment);
    }
    split_.recordings.push_back({run.record->recording.name(), own.score(), std::move(estimates)});
  }

  [[nodiscard]] SplitScore score() && {
    split_.together = together_.score();
    return std::move(split_);
  }

 private:
  Role role_;
  SplitScore split_;
  Tally together_;
};

}  // namespace

SplitScore evaluate(const std::vector<ScoredRun>& runs, Role role) {
  SplitTally tally(role);
  for (const ScoredRun& run : runs) tally.add(run);
  return std::move(tally).score();
}

std::vector<SplitScore> evaluate(const Estimator& estimator, const Dataset& dataset,
                                 std::span<const Role> roles, const Progress& progress) {
  std::vector<SplitTally> tallies(roles.begin(), roles.end());
  std::size_t done = 0;
  for (const DatasetRecord& record : dataset.records) {
    report_progress(progress,
                    static_cast<double>(done++) / static_cast<double>(dataset.records.size()),
                    "scoring");
    if (std::ranges::none_of(roles, [&](Role role) { return record.has_role(role); })) continue;
    const ScoredRun run = scored_run(estimator, dataset, record);
    for (SplitTally& tally : tallies) tally.add(run);
  }
  std::vector<SplitScore> scores;
  scores.reserve(tallies.size());
  for (SplitTally& tally : tallies) scores.push_back(std::move(tally).score());
  return scores;
}

SplitScore evaluate(const Estimator& estimator, const Dataset& dataset, Role role,
                    const Progress& progress) {
  return std::move(evaluate(estimator, dataset, std::span(&role, 1), progress).front());
}

}  // namespace torsio
