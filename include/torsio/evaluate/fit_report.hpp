#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// How the residuals e_n = y_n - target_n hang together with something over lags of k samples:
///
///     r_k = sum_n e_n x_(n-k) / sqrt(sum e^2 sum x^2),   both without their means
///
/// If they do not, 99 % of all |r_k| are below 2.58 / sqrt(N).
struct ResidualCorrelation {
  std::string with;        ///< an input's expression; of the residuals themselves: "residual"
  double strongest = 0.0;  ///< r_k of the largest |r_k|; with itself k >= 1
  double lag_s = 0.0;      ///< its k
  double bound = 0.0;      ///< 2.58 / sqrt(N)
  double share_outside =
      0.0;  ///< of lags with |r_k| above it: 0.01 if there is nothing left to learn
};

/// What is left over, and how well the data tell the parameters.
struct FitReport {
  std::string split;  ///< "test", "validation" or "train": the first of these that there is
  std::size_t samples = 0;
  std::vector<ResidualCorrelation>
      correlations;                ///< of the residuals with themselves, then each input
  double memory_s = kNotMeasured;  ///< lag at which r with themselves falls below 1/e
  /// N / (1 + 2 sum_k r_k) up to the first r_k <= 0: as many white residuals would tell as much.
  double effective_samples = kNotMeasured;
  /// As fitted; the standard errors are widened by sqrt(N / effective_samples), since those of the
  /// fit take residuals for white.
  std::vector<FittedParameter> table;
};

/// Residuals of the estimator's streamed run, at fresh samples of the split, over lags of up to a
/// tenth of the longest record or `kMaxLags`.
inline constexpr std::size_t kMaxLags = 500;
[[nodiscard]] FitReport fit_report(const TrainedModel& model, const Dataset& dataset);

}  // namespace torsio
