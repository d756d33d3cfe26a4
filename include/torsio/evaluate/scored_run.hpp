#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/any_estimator.hpp"

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

/// One model on one recording of a dataset: scores, the report of a fit and the pages are made of
/// this run, so that the model is run once.
struct ScoredRun {
  const DatasetRecord* record = nullptr;
  const Channel* target = nullptr;
  Prediction prediction;                    ///< in free run
  std::optional<Prediction> one_step = {};  ///< one step ahead, for a model with feedback

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
};

/// @throws Error as `predict`.
[[nodiscard]] ScoredRun scored_run(const Estimator& estimator, const Dataset& dataset,
                                   const DatasetRecord& record);
/// The runs of all recordings. The dataset must outlive them.
/// @throws Error also as `Dataset::check`.
[[nodiscard]] std::vector<ScoredRun> scored_runs(const Estimator& estimator, const Dataset& dataset,
                                                 const Progress& progress = {});

}  // namespace torsio
