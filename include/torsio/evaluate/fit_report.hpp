#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/check/check.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/evaluate/results.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// Correlation of the residuals e_n = y_n - target_n with themselves or an input x over lags of k
/// samples:
///
///     r_k = sum_n e_n x_(n-k) / sqrt(sum e^2 sum x^2),   both without their means
///
/// Without correlation, 99 % of all |r_k| are below 2.58 / sqrt(N).
struct ResidualCorrelation {
  std::string with;            ///< an input's expression, or "residual" for the autocorrelation
  double strongest = 0.0;      ///< r_k of the largest |r_k|; k >= 1 for the autocorrelation
  double lag_s = 0.0;          ///< lag of `strongest`
  double bound = 0.0;          ///< 2.58 / sqrt(N)
  double share_outside = 0.0;  ///< share of lags with |r_k| > `bound`: 0.01 for white residuals
};

/// Correlation of the residuals, and how well the data determine the parameters.
struct FitReport {
  std::string split;  ///< "test", "validation" or "train": the first of these that exists
  std::size_t samples = 0;
  std::vector<ResidualCorrelation>
      correlations;  ///< autocorrelation of the residuals, then with each input
  double memory_s =
      kNotMeasured;  ///< correlation time: lag at which the autocorrelation falls below 1/e
  /// Effective sample size N / (1 + 2 sum_k r_k) up to the first r_k <= 0, or a tenth of the longest recording.
  double effective_samples = kNotMeasured;
  /// As fitted; the standard errors are multiplied by sqrt(N / effective_samples), since those of
  /// the fit assume white residuals.
  std::vector<FittedParameter> table;
};

/// Residuals of the estimator's streamed run, at new samples of the split, over lags of up to a
/// tenth of the longest recording or `kMaxLags`.
inline constexpr std::size_t kMaxLags = 500;
[[nodiscard]] FitReport fit_report(const TrainedModel& model, const Dataset& dataset);
/// @param scored the runs of the model through the recordings of the dataset
/// @param data with the model's inputs; those of the split are made if they are not there
[[nodiscard]] FitReport fit_report(const TrainedModel& model, const Dataset& dataset,
                                   const std::vector<ScoredRun>& scored, const LearningData* data);

/// A fitted model with all that `torsio fit` states about it.
struct ReportedFit {
  TrainedModel trained;         ///< its card has the scores on held-out recordings
  std::vector<ScoredRun> runs;  ///< one for each recording
  Results results;              ///< diverged, if it diverges on its training data
  FitReport report;
};
/// Runs each recording once through the pipeline, unless the check has done it, and once through
/// the model.
/// @param check of the dataset with the inputs of the choice
/// @throws Error as `train_model`, Cancelled.
[[nodiscard]] ReportedFit fit_and_report(const Dataset& dataset, const FitCheck& check,
                                         const ModelChoice& choice, const FitContext& context);

}  // namespace torsio
