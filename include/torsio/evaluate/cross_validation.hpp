#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// `FoldScheme::by` for leave-one-record-out; not a possible name of a channel, which has a unit.
inline constexpr std::string_view kByRecord = "record";

/// How a dataset is cut into folds. Source: specification 3.10.
struct FoldScheme {
  /// K-fold: whole recordings are assigned to the folds. Fewer recordings than folds: each one is
  /// cut into that many contiguous blocks, and a fold holds out one block of each.
  std::size_t folds = 5;
  /// Time between a held-out block and the training samples; not used for whole recordings.
  double embargo_s = 1.0;
  /// Empty: K-fold. `kByRecord`: each record is a fold. Else a condition, or a channel that is
  /// constant in every record: all records of one value are a fold.
  std::string by = {};
};

/// One division of the dataset.
struct Fold {
  std::string name;                     ///< "fold 2", "sweep.csv", "support_m = 0.02"
  std::vector<std::string> recordings;  ///< held out, whole or in part
  std::size_t held_out_samples = 0;
  /// For each recording of the dataset, in order; held-out segments have the role test.
  std::vector<std::vector<Segment>> segments;
};

struct FoldPlan {
  std::string label;  ///< description of the folds, printed with the scores
  std::vector<Fold> folds;
};

/// Only samples with the role train are assigned to the folds: each of them is held out exactly
/// once. Test segments are used in no fold. Validation segments are kept (for error bars and early
/// stopping), except in a recording that is held out, or has the held-out condition, and in the
/// embargo. Deterministic for a seed.
/// @throws UsageError for fewer than two folds, recordings, values or samples per fold, an unknown
/// condition, a recording that is given twice, or an embargo that leaves no training samples.
[[nodiscard]] FoldPlan plan_folds(const Dataset& dataset, const FoldScheme& scheme,
                                  std::uint64_t seed);

/// Statistics over the folds with equal weights. `std_dev` is that of one fold (divided by n - 1);
/// folds share training data, so that it is not a standard error of the mean.
struct FoldStatistic {
  double mean = kNotMeasured;
  double std_dev = kNotMeasured;  ///< NaN for fewer than two folds
};

/// One model over all folds that could be fitted and scored.
struct FoldSummary {
  std::string family;
  std::string variant = {};
  std::string input_set = {};
  bool leak = false;
  std::size_t folds = 0;  ///< folds in the statistics
  std::size_t failed_folds = 0;
  std::string status = "ok";    ///< status of the first failure: failed, diverged; or pruned
  std::string reason = {};      ///< reason of the first failure, or why a search pruned it
  std::string worst_fold = {};  ///< by `common_rmse`, else by `rmse`
  FoldStatistic rmse = {};
  FoldStatistic mad = {};
  FoldStatistic max_abs = {};
  FoldStatistic fit_percent = {};
  /// The folds in which a ranking is possible; over them the `common_` statistics are those of
  /// `Score::common`. 0 folds: not ranked.
  std::size_t ranked_folds = 0;
  FoldStatistic common_rmse = {};
  FoldStatistic common_mad = {};
  FoldStatistic common_max_abs = {};
  FoldStatistic common_fit_percent = {};
  double guarded_share = kNotMeasured;  ///< share of all scored samples
  /// `Score::within_std_dev` and `within_2_std_dev` over the scored samples of all folds.
  double within_std_dev = kNotMeasured;
  double within_2_std_dev = kNotMeasured;
  double step_ns_p50 = kNotMeasured;  ///< mean over the folds
  double fit_seconds = kNotMeasured;  ///< all folds together
  std::size_t parameter_count = 0;    ///< parameters of the largest model
};

struct CrossValidation {
  /// A row for each model and fold, and for each recording of it, with `fold` set and the split
  /// `validation`: these scores are used for the selection. A fit that failed is a row with the
  /// reason. `rankings` has one for each fold.
  Results results;
  FoldPlan plan;  ///< without segments
  /// Lowest mean `common_rmse` first; models that failed in a fold come last, since their mean is
  /// over other folds, and so do those that a guard reported in more than half of a fold in which
  /// other models ran. In the order of the choices if no ranking is possible.
  std::vector<FoldSummary> ranking;

  /// The samples of all folds in which a ranking is possible, among all scored samples.
  [[nodiscard]] Ranking ranked() const noexcept;
};

/// Trains every choice on each fold's rest, as `compare` does, and scores it in free run on the
/// held-out part. Folds run one after the other: the times of a step are measured on an idle
/// machine, and fitters use several threads themselves.
/// @throws UsageError as `plan_folds` and `compare`, Cancelled.
[[nodiscard]] CrossValidation cross_validate(Dataset dataset,
                                             const std::vector<ModelChoice>& choices,
                                             const FoldScheme& scheme, std::uint64_t seed,
                                             bool allow_leak, const Progress& progress = {});

}  // namespace torsio
