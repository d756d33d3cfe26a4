#pragma once

#include <string>

#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"

namespace torsio {

/// The JSON document of `compare`, `evaluate` and `demo`; ends with a line feed.
[[nodiscard]] std::string results_json(const Results& results);

/// The rows of a split ranked by RMSE, one line per model, with a column for each recording of the
/// split. Rows that failed come last with their reason.
[[nodiscard]] std::string ranked_table(const Results& results, Role split);

}  // namespace torsio
