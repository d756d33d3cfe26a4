#pragma once

#include <cstdint>
#include <functional>

#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

class AnyModel;
struct TrainingCheckpoint;

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
};

}  // namespace torsio
