#pragma once

#include <span>
#include <vector>

#include "evaluate/fit_and_score.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"

// The samples on which models can be compared. Where a guard acts, its linear fallback replaces the
// model; it is nearly the same for all families, and an error there is that of the fallback.
namespace torsio {

/// Scores models on the samples that none of them guarded (`Score::common` of their rows), unless
/// these are too few (`Ranking::is_possible`). A model that a guard replaced in more than half of
/// its samples, one that failed and one that diverged are not ranked and exclude no samples.
/// @param models scored on `role` of this dataset.
Ranking rank_on_common_samples(const Dataset& dataset, Role role, std::span<ScoredModel> models);

}  // namespace torsio
