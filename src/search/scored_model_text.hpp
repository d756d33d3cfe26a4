#pragma once

#include <string>
#include <string_view>

#include "evaluate/fit_and_score.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// The rows of a model as JSON from which `rows_from_text` makes the same numbers, bit for bit. The
/// names of family, variant, input set and fold are not in it.
[[nodiscard]] std::string rows_text(const std::vector<ResultRow>& rows);
/// @throws Error if the text is not of `rows_text`.
[[nodiscard]] std::vector<ResultRow> rows_from_text(std::string_view text);

/// The result of a trial from the rows of its model: its value is the RMSE on all held-out samples
/// together; without such a score it has failed, with the reason of that row or of the fit.
[[nodiscard]] TrialResult trial_result(const std::vector<ResultRow>& rows);

/// The estimates of a model on each recording of a role, packed.
[[nodiscard]] std::string pack_estimates(const std::vector<MeasuredEstimates>& recordings);
/// @throws Error if the bytes are not of `pack_estimates`.
[[nodiscard]] std::vector<MeasuredEstimates> unpack_estimates(std::string_view bytes);

}  // namespace torsio
