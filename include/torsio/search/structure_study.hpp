#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// Whether fits are cut short to find out which are worth a full one.
enum class Halving {
  off,        ///< every candidate is fitted on every fold
  by_family,  ///< the better half of each family continues; its last candidate is never pruned
  by_all,     ///< the better half of all candidates continues: families may be lost
};

struct SearchSettings {
  std::size_t folds = kSearchFolds;
  std::uint64_t seed = 1;
  bool allow_leak = false;
  Halving halving = Halving::by_family;
  /// A family is halved if one of its fits is expected to take this long: pruning quick ones saves
  /// nothing and may lose its best. It does not apply to `Halving::by_all`.
  double halve_from_s = 1.0;
};

/// All that a worker on another machine needs to run the trials of a search: its files are read by
/// their paths, and compared by their hashes.
struct SearchRequest {
  std::vector<std::string> recordings;  ///< to train on, or manifests
  std::vector<std::string> validation = {};
  std::string mapping = {};
  std::string joint = {};
  double rate_Hz = 0.0;  ///< 0: that of the logs
  std::string target = {};
  std::string load_file = {};
  std::vector<std::vector<std::string>> inputs = {};  ///< input sets; empty: the default
  std::size_t initialise = Dataset{}.initialise_samples;
  std::string models{kSearch};  ///< as for `model_choices`, or "search"
  SearchSettings settings = {};
};

/// The recordings of a request with the target.
/// @throws Error as `load_dataset`.
[[nodiscard]] Dataset load_search_data(const SearchRequest& request, const Progress& progress = {});
/// The candidates of a request, for each of its input sets.
[[nodiscard]] std::vector<ModelChoice> search_choices(const Dataset& dataset,
                                                      const SearchRequest& request);

/// A search over structures as a study: a trial fits one candidate on one fold.
///
/// Halving steps, if wanted: the candidates of a group are fitted on the first fold with a quarter of
/// the iterations, epochs or updates of the family's fit or, where it has none, of the training
/// samples, in blocks that are spread over each record. The better half by RMSE on the held-out part
/// is fitted with half of them, while more than two are left; the better half of these with all, on
/// all folds. A candidate whose fit fails on a part of the samples continues. A
/// group of one candidate, and recordings too short to be cut, begin with the last step. Which
/// candidates continue depends on the errors alone, not on the order in which the trials end.
class StructureStudy : public StudyKind {
 public:
  /// @throws UsageError as `cross_validate`.
  StructureStudy(Dataset dataset, std::vector<ModelChoice> candidates,
                 const SearchSettings& settings);
  ~StructureStudy() override;

  /// The trials that a study begins with.
  [[nodiscard]] std::vector<Trial> first_trials() const;

  [[nodiscard]] TrialResult run(const Claim& claim, const Progress& progress) override;
  [[nodiscard]] HalvingDecision decide(const std::string& group, int step,
                                       std::span<const TrialRecord> trials) override;
  [[nodiscard]] std::string label(const Claim& claim) const override;

  /// The scores of all candidates and the best of each family, after the study is complete.
  /// @throws Error if results are missing.
  [[nodiscard]] StructureSearch result(StudyStore& store, std::int64_t study);

 private:
  class Plan;
  std::unique_ptr<Plan> plan_;
};

/// The name of this kind in a store.
inline constexpr std::string_view kStructureStudy = "search";

/// The text of a request that is kept in a store, with the hashes of the files of its dataset.
[[nodiscard]] std::string request_text(const SearchRequest& request, const Dataset& dataset);
/// Refuses a dataset that is not the one that a study began with.
/// @throws Error naming the recording that has changed.
void refuse_changed_data(const StoredStudy& study, const Dataset& dataset);
/// Reads the request of a study, and the recordings. @throws Error if a recording has changed since.
[[nodiscard]] std::unique_ptr<StructureStudy> structure_study(const StoredStudy& study,
                                                              const Progress& progress = {});

/// `StructureSearch` on this machine without a study that is kept: the search of `compare`.
/// @param threads 0: as many as the process may use
/// @throws UsageError as `cross_validate`, Cancelled.
[[nodiscard]] StructureSearch search_structures(Dataset dataset,
                                                const std::vector<ModelChoice>& candidates,
                                                const SearchSettings& settings,
                                                const Progress& progress = {},
                                                std::size_t threads = 0);

}  // namespace torsio
