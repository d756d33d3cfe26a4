#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// The estimates of every sample of a recording, streamed through `step` from `reset()`.
struct Prediction {
  std::size_t initialised =
      0;  ///< samples up to the last one that was used to initialise the model
  std::vector<Estimate> estimates;
  std::vector<double> step_ns;
};

/// Measured target samples that initialise a model with memory: the first `most` new samples. A
/// model with feedback is given each in turn, one with a state (`HasState`) is set to the state
/// that fits them best.
struct Corrections {
  const Channel* target = nullptr;
  std::size_t most = 0;
};

/// Zeros of `zeroed_channels` are 0 here, whatever was set: they were already
/// subtracted from a loaded recording.
/// @throws Error naming the recording, the channel and the sample if a raw input is missing or not
/// finite, or the recording has another sample rate than the estimator.
[[nodiscard]] Prediction predict(Estimator estimator, const Recording& recording,
                                 const Corrections& corrections = {});

/// What the error bars of a model contain and a comparison with this target does not show: the uncertainty of the sensor
/// from which it was learned. None if it is compared with another channel.
[[nodiscard]] SensorUncertainty common_uncertainty(const EstimatorSettings& settings,
                                                   const std::string& target);

/// One model on one recording of a dataset: scores, the report of a fit and the pages are made of
/// this run, so that the model is run once.
struct ScoredRun {
  const DatasetRecord* record = nullptr;
  const Channel* target = nullptr;
  Prediction prediction;                    ///< in free run
  std::optional<Prediction> one_step = {};  ///< one step ahead, for a model with feedback
  SensorUncertainty common = {};            ///< `common_uncertainty`

  /// Whether the filters have settled and the sample did not initialise the model.
  [[nodiscard]] bool is_scored(std::size_t sample) const noexcept {
    return prediction.estimates[sample].fault != Fault::warming_up &&
           sample >= prediction.initialised;
  }
  /// Estimate less target where the sample is scored; else NaN.
  [[nodiscard]] double residual(std::size_t sample) const noexcept {
    return is_scored(sample) ? prediction.estimates[sample].value - target->values[sample]
                             : kNotMeasured;
  }
  /// The error bar of a comparison with the target: without the error that both have.
  [[nodiscard]] double compared_std_dev(std::size_t sample) const noexcept {
    const Estimate& estimate = prediction.estimates[sample];
    return common.taken_out_of(estimate.std_dev, estimate.value);
  }
};

/// @throws Error as `predict`.
[[nodiscard]] ScoredRun scored_run(const Estimator& estimator, const Dataset& dataset,
                                   const DatasetRecord& record);
/// The runs of all recordings. The dataset must outlive them.
/// @throws Error also as `Dataset::check`.
[[nodiscard]] std::vector<ScoredRun> scored_runs(const Estimator& estimator, const Dataset& dataset,
                                                 const Progress& progress = {});

/// How well and how fast an estimator did on some samples, in free run (no past target is fed
/// back).
struct Score {
  Metrics metrics;
  Metrics one_step = {};  ///< one-step-ahead errors of a model with feedback; else 0 samples
  std::size_t initialised_samples = 0;  ///< not scored: filters not settled
  std::size_t guarded_samples = 0;      ///< scored, but with a fault
  std::size_t diverged_samples = 0;     ///< guarded samples at which the model diverged or was NaN
  /// On the samples that no model of the ranking guarded (`compare`, `cross_validate`); 0 samples:
  /// not ranked.
  Metrics common = {};
  /// Shares of the scored samples whose error is at most one, or two, of their error bars
  /// (`ScoredRun::compared_std_dev`); NaN if none had one. A calibrated Gaussian error bar gives 0.683 and 0.954.
  double within_std_dev = kNotMeasured;
  double within_2_std_dev = kNotMeasured;
  double mean_std_dev = kNotMeasured;     ///< mean error bar of the scored samples that have one
  double without_std_dev = kNotMeasured;  ///< share of the scored samples without an error bar
  double step_ns_p50 = kNotMeasured;  ///< time of `Estimator::step` without the cost of the clock
  double step_ns_p999 = kNotMeasured;
};

/// One model at the measured samples of a recording: those of its segments of one role at which the
/// target is new and finite. They are the same samples for every model.
struct MeasuredEstimates {
  std::vector<double> values;  ///< NaN: not scored, filters not settled
  std::vector<bool> guarded;   ///< scored, but with a fault
};

/// Scores of each recording that has segments of `role`, and of all of them together.
struct SplitScore {
  struct OfRecording {
    std::string recording;
    Score score;
    MeasuredEstimates estimates;
  };
  std::vector<OfRecording> recordings;
  Score together;
};
[[nodiscard]] SplitScore evaluate(const std::vector<ScoredRun>& runs, Role role);
/// Runs the recordings of that role first.
[[nodiscard]] SplitScore evaluate(const Estimator& estimator, const Dataset& dataset, Role role,
                                  const Progress& progress = {});
/// The same for several roles, in their order; a recording that has segments of several is run
/// once, and only one run is in memory at a time.
[[nodiscard]] std::vector<SplitScore> evaluate(const Estimator& estimator, const Dataset& dataset,
                                               std::span<const Role> roles,
                                               const Progress& progress = {});

}  // namespace torsio
