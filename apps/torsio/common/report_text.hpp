#pragma once

#include <string>

#include "report/cross_validation.hpp"
#include "torsio/report/results.hpp"

/// The text of a comparison: target and inputs, the ranked test table, and the
/// remarks to its rows.
[[nodiscard]] std::string comparison_text(const torsio::Results& results);

/// The ranking over the folds, with the held-out part of each.
[[nodiscard]] std::string cross_validation_text(const torsio::CrossValidation& validation);

/// The scores of one model on each role and recording.
[[nodiscard]] std::string evaluation_text(const torsio::Results& results);

/// Why nothing could be fitted.
[[nodiscard]] std::string first_failure(const torsio::Results& results);
