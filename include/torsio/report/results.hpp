#pragma once

#include <string>

#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"

namespace torsio {

/// The JSON document of `compare`, `evaluate` and `demo`; ends with a line feed.
[[nodiscard]] std::string results_json(const Results& results);

/// The samples on which models are ranked, if a guard excludes any of them: their share; a warning
/// above 10 % of excluded samples; that there is no ranking, if it is not possible. Ends with a line
/// feed, or is empty.
[[nodiscard]] std::string ranking_note(const Ranking& ranking);

/// The models of a split, one line each: ranked by their RMSE on the common samples, or without a
/// ranking in the order of the call, with the errors on all samples. With a column for each
/// recording of the split. Models that are not ranked come last with the reason.
[[nodiscard]] std::string ranked_table(const Results& results, Role split);

}  // namespace torsio
