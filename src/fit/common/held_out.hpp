#pragma once

#include <cstddef>
#include <functional>

#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What the last third of each sequence shows of a model that was fitted to the rest of it.
struct HeldOutErrors {
  double rmse = kNotMeasured;
  double constant_rmse = kNotMeasured;  ///< error of a constant, in all samples
  /// Whether the first input was there where it had been before.
  bool has_return = true;
  /// Root mean square of error over the model's own error bar, at least 1; 1 for a model without.
  double error_bar_factor = 1.0;
  double own_std_dev = 0.0;    ///< root mean square of the model's own error bars; 0: it has none
  double stroke_growth = 0.0;  ///< `StrokeGuard::growth`
  double factor = 1.0;         ///< `other_recordings_factor`, of every error bar
  /// The least error bar: where the training has no reversal, the hysteresis is not known.
  double least_std_dev = 0.0;
};

/// The error of so many recordings that were held out in turn is better evidence than that of parts of recordings.
inline constexpr std::size_t kSeveralRecords = 3;

/// How often the first input reverses, counted up to `kFewReversals`.
[[nodiscard]] std::size_t reversals_of(const TrainingData& data);

/// By what factor the error in other recordings is expected to be larger than what the training data show. Public
/// recordings that were not used for it determine each value (docs/decisions/0042-coverage-in-other-motions.md).
/// @param recordings files, or recordings made in memory
[[nodiscard]] double other_recordings_factor(std::size_t recordings, std::size_t reversals);

/// The error of a fit to n recordings over that of fits without one of `folds` groups of them, where the recordings differ by
/// more than their noise: sqrt((1 + 1/n) / (1 + 1/m)), m = n (1 - 1/folds); sqrt(1 - 1/n²) where each group is one recording.
/// @param records, folds at least 2
[[nodiscard]] double error_share_with_all(std::size_t records, std::size_t folds);

/// Standard deviation of the target over the usable samples.
[[nodiscard]] double target_std_dev(const TrainingData& data);

/// @param fit the family's fitter, with the options and the seed of the model
/// @returns NaN where the rest does not suffice for a fit, or no sample is left. @throws Cancelled.
[[nodiscard]] HeldOutErrors held_out_errors(
    const TrainingData& data, const std::function<FittedModel(const TrainingData&)>& fit);

}  // namespace torsio
