#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/any_estimator.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// How well and how fast an estimator did on some samples, in free run (no past target is fed
/// back).
struct Score {
  Metrics metrics;
  Metrics one_step = {};  ///< of a model that feeds back, each past output measured; else 0 samples
  std::size_t initialised_samples = 0;  ///< not scored: filters had not settled
  std::size_t guarded_samples = 0;      ///< scored, but answered by a guard instead of the model
  std::size_t diverged_samples = 0;     ///< of these, because the model had run away
  /// Shares of the scored samples whose error is at most one, or two, of the error bar told with them;
  /// NaN if none had one. Of an honest Gaussian error bar 0.683 and 0.954.
  double within_std_dev = kNotMeasured;
  double within_2_std_dev = kNotMeasured;
  double step_ns_p50 = kNotMeasured;  ///< of `Estimator::step`, the clock's own cost taken off
  double step_ns_p999 = kNotMeasured;
};

/// The estimator's answer to every sample of a recording, streamed through `step` from `reset()`.
struct Prediction {
  std::size_t initialised = 0;  ///< samples up to the last one that told the model where it starts
  std::vector<Estimate> estimates;
  std::vector<double> step_ns;
};

/// What a model with memory is told of the target: the first so many fresh samples. One that feeds
/// back hears each in turn, one with a state (`HasState`) starts where it fits them best.
struct Corrections {
  const Channel* target = nullptr;
  std::size_t most = 0;
};

/// Zeros of `zeroed_channels` are 0 here, whatever was set: a loaded recording had its own
/// subtracted already.
/// @throws Error naming the recording, the channel and the sample if a raw input is missing or not
/// finite, or the recording has another sample rate than the estimator.
[[nodiscard]] Prediction predict(Estimator estimator, const Recording& recording,
                                 const Corrections& corrections = {});

/// Scores of each recording that has segments of `role`, and of all of them together.
struct SplitScore {
  struct OfRecording {
    std::string recording;
    Score score;
  };
  std::vector<OfRecording> recordings;
  Score together;
};
[[nodiscard]] SplitScore evaluate(const Estimator& estimator, const Dataset& dataset, Role role,
                                  const Progress& progress = {});

}  // namespace torsio
