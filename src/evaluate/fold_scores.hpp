#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "evaluate/fit_and_score.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// The roles that models are scored on in a fold: on their training data to detect divergence.
inline constexpr auto kFoldRoles = std::to_array<Role>({Role::train, Role::test});

/// A cross-validation whose folds are scored by the caller, on one machine or on several.
class FoldScores {
 public:
  /// @param choices must outlive this.
  /// @throws UsageError as `plan_folds`.
  FoldScores(const Dataset& dataset, const FoldScheme& scheme,
             const std::vector<ModelChoice>& choices, std::uint64_t seed);

  [[nodiscard]] const FoldPlan& plan() const noexcept { return validation_.plan; }
  /// Gives the recordings of the dataset the segments of that fold.
  void cut(std::size_t fold, Dataset& dataset) const;
  /// Ranks the models of a fold on their common samples; folds in order.
  /// @param dataset with the segments of the fold
  /// @param models scored on it, in the order of the choices; one without rows was not fitted
  void add(std::size_t fold, const Dataset& dataset, std::vector<ScoredModel> models);
  /// Call once, after all folds.
  [[nodiscard]] CrossValidation summary() &&;

 private:
  const std::vector<ModelChoice>& choices_;
  CrossValidation validation_;
  std::vector<std::vector<std::vector<Segment>>> segments_;  // by fold and recording
  std::vector<std::vector<ResultRow>> totals_;               // by choice: on all of each fold
};

}  // namespace torsio
