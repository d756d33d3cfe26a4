#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

class AnyModel;
struct TrainingCheckpoint;

/// A whole epoch of the training of a network. Errors are root mean squares over the standard deviation of the target.
struct TrainingEpoch {
  std::size_t epoch = 0;                 ///< from 1; not larger than before: another network begins
  double training_error = kNotMeasured;  ///< mean over the batches, while the weights change
  double held_out_error = kNotMeasured;  ///< after the epoch; NaN: nothing is held out
};

/// The inputs of a fit in addition to data and options. Fits that end within seconds need only the
/// first two.
struct FitContext {
  std::uint64_t seed = 0;
  Progress progress = {};
  /// Determines when to stop; null: a fitter that needs such records holds out some of the training
  /// data.
  const TrainingData* validation = nullptr;
  /// The error of a model in its intended use (for example free run for a NARX model); null: a
  /// fitter that chooses between models evaluates them by its own means.
  std::function<double(const AnyModel&)> error_of = {};
  /// Continue from this checkpoint; null: from the start.
  const TrainingCheckpoint* resume = nullptr;
  /// Called before `Cancelled` is thrown, by fitters that can resume later.
  std::function<void(const TrainingCheckpoint&)> keep = {};
  /// Called after each epoch of a network, from one thread at a time.
  std::function<void(const TrainingEpoch&)> note_epoch = {};
};

}  // namespace torsio
