#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"
#include "torsio/fit/train_model.hpp"

// The steps of `compare` and `crossvalidate` for each model.
namespace torsio {

/// The data of the input sets, each made once for the models that share it. For several threads.
class InputSets {
 public:
  /// @param dataset must outlive this.
  InputSets(const Dataset& dataset, bool allow_leak);
  /// @param examined those of a dataset with the same recordings, or more of them: its leaks are not
  /// searched for again.
  InputSets(const Dataset& dataset, InputSets& examined);

  /// An input that the target was computed from, or empty. @throws UsageError as `refuse_leak`.
  [[nodiscard]] std::string leak_of(const FeatureSpec& features);
  /// The data are kept for the last few input sets that were asked for.
  /// @throws Error as `learning_data`, each time again.
  [[nodiscard]] std::shared_ptr<const LearningData> data_of(const FeatureSpec& features);
  /// Call after a change of the dataset's segments: leaks are kept, the data are computed again.
  void forget_data();

 private:
  const Dataset& dataset_;
  bool allow_leak_;
  std::mutex guard_;
  std::vector<std::pair<FeatureSpec, std::string>> leaks_;
  std::vector<std::pair<FeatureSpec, std::shared_ptr<const LearningData>>> data_;  // last used last
};

struct ScoredModel {
  /// The estimates on the recordings of a held-out role, in the order of their rows.
  struct OfRole {
    Role role;
    std::vector<MeasuredEstimates> recordings;
  };
  std::optional<TrainedModel> trained;  ///< none if the fit failed
  std::vector<ResultRow> rows;
  std::vector<OfRole> estimates = {};
};

/// Trains a choice and scores it on `roles`, of which train is one. A fit that fails is one row with
/// the reason; a model that diverges on its training data has the status `diverged` in all rows.
/// @throws UsageError for a wrong setting or a leak that is not allowed, Cancelled.
[[nodiscard]] ScoredModel fit_and_score(const Dataset& dataset, InputSets& input_sets,
                                        const ModelChoice& choice, std::uint64_t seed,
                                        std::span<const Role> roles, const Progress& progress);

/// The rows of one model on one role: on all of the role together, then on each recording.
[[nodiscard]] std::vector<ResultRow> rows_of(const ModelFile& file, Role role,
                                             const SplitScore& scores);

/// Results without rows.
[[nodiscard]] Results empty_results(const Dataset& dataset);
/// Enters the inputs of a choice, unless its input set is known already.
void note_inputs(Results& results, const ModelChoice& choice);
/// A single input set without a name is not listed.
void forget_only_set(Results& results);

/// Refuses a file that is used for training and test, whose scores would be biased. (Blocks of one
/// recording are allowed.) @throws UsageError naming it.
void refuse_seen_test_records(const Dataset& dataset);

/// The share of work `index` of `count` in the whole work's progress. `progress` must outlive it.
[[nodiscard]] Progress part_of(const Progress& progress, std::size_t index, std::size_t count,
                               const std::string& doing);

}  // namespace torsio
