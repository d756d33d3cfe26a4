#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "model/mixture/dgmm.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Specification 3.1: the spread of a new component, and how far it is to the next.
inline constexpr double kDefaultSpread = 0.15;
inline constexpr double kNoveltyPerSpread = 0.25 / kDefaultSpread;

struct SpreadChoice {
  double spread = kDefaultSpread;
  std::string note;  ///< what was chosen and why, with the scores
};

/// Joint samples (target, then inputs) -> a mixture of that spread. Called from several threads; the
/// progress may be, too.
using FitWithSpread =
    std::function<Dgmm::Parameters(const Matrix& samples, double spread, const Progress& progress)>;

/// Leaves one record out at a time (a single record: every fifth of 50 blocks) and takes the spread
/// with the least error on what was left out, mean square of the records' RMSE. Two rules keep the
/// choice unbiased:
/// - A left-out sample counts only if its inputs lie within the range of the other records, by the
///   margin of the estimator's guard: outside, the estimator does not use the model.
/// - The default is kept unless the best spread is better by more than the standard error of the
///   difference over the records.
/// @param samples all usable samples of `data`, in order.
[[nodiscard]] SpreadChoice choose_spread(const Matrix& samples, const TrainingData& data,
                                         const FitWithSpread& fit, std::size_t threads,
                                         const Progress& progress);

}  // namespace torsio
