#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/evaluate/results.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// Reads `--models`: families separated by commas, each with settings after colons
/// (`linear,polynomial:degree=7:branch=true`), or `all` in the place of one (`all,lstm`);
/// duplicates are removed. Each is paired with every input set. `all` is every family that is not
/// `only_if_named`, `polynomial` also without branches, and, where a condition takes several values
/// in training, the scheduled variants over it.
/// @throws UsageError for a family or setting that does not exist.
[[nodiscard]] std::vector<ModelChoice> model_choices(const Dataset& dataset,
                                                     std::string_view models,
                                                     const std::vector<std::string>& wanted_inputs);

/// A model of a comparison, named as its rows are.
struct ComparedModel {
  std::string family;
  std::string variant;
  std::string input_set;
  ModelFile file;
};

struct Comparison {
  Results results;
  /// Every choice that could be fitted, in the order of the call; a card has no held-out scores.
  std::vector<ComparedModel> models;
  /// First in the ranking on the validation recordings, or on the test recordings if there are no
  /// others: its card then states that its score was also used to select it. None if every fit
  /// failed or no ranking is possible.
  std::optional<TrainedModel> best;
};

/// @throws UsageError if no recording has the role test, so that `compare` has nothing to rank on.
void require_test_recordings(const Dataset& dataset);

/// Trains every choice on the training recordings and scores it on the other roles. A fit that
/// fails is a row with the reason. Models are ranked by the RMSE on the samples that no ranked model
/// guarded (`Score::common`).
/// @throws UsageError if there are no test recordings, an input is a leak and `allow_leak` is not
/// set, or a setting names an input that does not exist.
[[nodiscard]] Comparison compare(const Dataset& dataset, const std::vector<ModelChoice>& choices,
                                 std::uint64_t seed, bool allow_leak,
                                 const Progress& progress = {});

/// One model's rows on every role that the dataset has.
/// @param runs of the model through the recordings of the dataset
[[nodiscard]] Results evaluate_model(const ModelFile& file, const Dataset& dataset,
                                     const std::vector<ScoredRun>& runs);
/// Runs each recording once, with one run in memory at a time.
[[nodiscard]] Results evaluate_model(const ModelFile& file, const Dataset& dataset,
                                     const Progress& progress = {});

/// Gives all rows the status `diverged` if the model diverges in free run on its own training data or
/// if its error there is above twice the standard deviation of the target: twice that of a constant.
/// @param rows of one model, the rows of role train those of its training data.
void mark_divergence_in_training(std::vector<ResultRow>& rows);

/// Writes a model's scores on all test recordings (validation, if there are no test recordings) to
/// its card, with a description of the samples. Without held-out recordings nothing changes.
void note_held_out_scores(ModelCard& card, const std::vector<ResultRow>& rows);

/// How `--models` asks for a search.
inline constexpr std::string_view kSearch = "search";
/// Fits of each candidate.
inline constexpr std::size_t kSearchFolds = 3;

/// Structures chosen by cross-validation over the training records alone, so that held-out ones
/// still choose nothing (`search_structures`).
struct StructureSearch {
  std::vector<ModelChoice> winners;  ///< the best of each family, best family first
  CrossValidation scores;  ///< scores of all candidates but those that a halving step pruned
};

/// What a search tries: every choice of `model_choices(..., "all")`, linear systems, hysteresis and
/// networks of springs and dashpots that are slower to fit, and of each the orders, sizes and
/// structures that people vary first, one at a time.
[[nodiscard]] std::vector<ModelChoice> search_candidates(
    const Dataset& dataset, const std::vector<std::string>& wanted_inputs);

}  // namespace torsio
