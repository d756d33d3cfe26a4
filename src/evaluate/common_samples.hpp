#pragma once

#include <span>
#include <vector>

#include "evaluate/fit_and_score.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"

// The samples on which models can be compared. Where a guard acts, an error is that of the linear
// fallback, which is nearly the same for all families, or of a model beyond its training range.
namespace torsio {

/// Scores models on the samples that none of them guarded (`Score::common` of their rows), unless
/// these are too few (`Ranking::is_possible`). A model that a guard reported in more than half of
/// its samples, one that failed and one that diverged are not ranked and exclude no samples.
/// @param models scored on `role` of this dataset.
Ranking rank_on_common_samples(const Dataset& dataset, Role role, std::span<ScoredModel> models);

}  // namespace torsio
