#pragma once

#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// A section, table, figure or equation of a paper, and what became of it here (`paper_items.csv`).
struct PaperItem {
  std::string_view paper;  ///< its number in docs/development/sources.md
  std::string_view item;   ///< as it is cited: Fig. 8
  std::string_view title;
  std::string_view status;  ///< done, partly, planned, not possible, nothing to run
  std::string_view run;     ///< studies, calls and tests that show it, separated by " ; "
  std::string_view
      verdict;  ///< reproduced, order only, not reproduced, holds; empty: nothing was run
  std::string_view outcome;   ///< one line
  std::string_view reason;    ///< the most likely one for what did not come out, or was not done
  std::string_view evidence;  ///< "shown: " and a run, or "supposed"; empty without a reason
};

/// A result that a paper prints (`paper_results.csv`).
struct PaperResult {
  std::string_view paper;
  std::string_view item;
  std::string_view condition;
  std::string_view quantity;
  std::string_view value;  ///< the digits as printed
  std::string_view unit;
  std::string_view table;  ///< the study whose table shows it beside ours; planned; text
};

/// Every item of the five papers, in their order.
[[nodiscard]] std::span<const PaperItem> paper_items() noexcept;
[[nodiscard]] std::span<const PaperResult> paper_results() noexcept;

/// The items as a table for a terminal, with the expected times of the studies.
[[nodiscard]] std::string paper_items_text();
/// docs/papers.md: the items with their outcomes, and the table in which each printed result is.
[[nodiscard]] std::string paper_items_page();
[[nodiscard]] std::string paper_items_json();

/// "40 s", "12 min" or "1.5 h".
[[nodiscard]] std::string duration_text(double seconds);

}  // namespace torsio
