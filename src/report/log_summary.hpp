#pragma once

#include <string>
#include <utility>
#include <vector>

#include "data/log_summary.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Topics with their rates, largest gaps and fields, or columns with units, ranges and rates.
[[nodiscard]] std::string log_summary_text(const LogSummary& summary);

/// `{"topics": [{"topic", "schema", "encoding", "messages", "rate_Hz", "duration_s",
/// "largest_gap_s", "fields", "problem"}], "unfinished"}`; of a file without topics also `"columns": [{"column", "unit",
/// "unit_from", "lowest", "highest", "measured", "new_values", "empty", "first"}], "rows", "clock", "duration_s",
/// "not_read", "notes"`.
[[nodiscard]] std::string log_summary_json(const LogSummary& summary);
/// For several files: `{"files": [{"file", ..}]}` with the members above.
[[nodiscard]] std::string log_summaries_json(
    const std::vector<std::pair<std::string, LogSummary>>& summaries);

/// "run: motor xl330, trajectory sin_sin"
[[nodiscard]] std::string labels_text(const Recording& recording);

}  // namespace torsio
