#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "evaluate/model_label.hpp"
#include "files/json_text.hpp"
#include "torsio/evaluate/results.hpp"
#include "torsio/report/text_table.hpp"

// Parts of the tables and documents of scores.
namespace torsio {

[[nodiscard]] nlohmann::ordered_json text_or_null(const std::string& text);
/// `results_json` before it becomes text.
[[nodiscard]] nlohmann::ordered_json results_document(const Results& results);

/// `ranked_table` before it becomes text.
struct RankedRows {
  TextTable table;
  std::vector<const ResultRow*> rows;  ///< those that the table has, in its order
  struct Other {
    const ResultRow* row;
    std::string reason;
  };
  std::vector<Other> others;  ///< not in the ranking
};
[[nodiscard]] RankedRows ranked_rows(const Results& results, Role split);
/// Three decimals below 1e6; three significant digits in a table whose smallest error needs
/// more decimals.
[[nodiscard]] std::string error_text(double value, double smallest = 1.0);
[[nodiscard]] std::string seconds_text(double seconds);
/// A share as a percentage with one decimal; "-" if it was not measured.
[[nodiscard]] std::string percent_text(double share);

}  // namespace torsio
