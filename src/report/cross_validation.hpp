#pragma once

#include <string>

#include "torsio/evaluate/cross_validation.hpp"

namespace torsio {

/// The document of `results_json` with each row's `fold`, and `folds` (the held-out part of each)
/// and `summary` (mean and standard deviation over the folds, best model first) beside `results`;
/// ends with a line feed.
[[nodiscard]] std::string cross_validation_json(const CrossValidation& validation);

/// The document of `results_json` for the winners of a structure search, with `search`: the
/// `label`, `folds` and `summary` of all candidates, as in `cross_validation_json`.
[[nodiscard]] std::string search_json(const Results& results, const CrossValidation& search);

/// One line per model, best first, with its mean +- standard deviation over the folds; then the
/// held-out part of each fold.
[[nodiscard]] std::string cross_validation_table(const CrossValidation& validation);

}  // namespace torsio
