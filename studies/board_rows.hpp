#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "studies/board_sets.hpp"

namespace torsio {

/// Where a row of the board comes from.
enum class BoardOrigin : std::uint8_t {
  published,  ///< printed by others
  measured,   ///< a family of torsio, run here
  joined,     ///< predictions of others, scored here
  added,      ///< predictions that are scored by this call
};

[[nodiscard]] std::string_view name(BoardOrigin origin) noexcept;

struct BoardRow {
  std::string set;
  std::string model;
  BoardOrigin origin = BoardOrigin::measured;
  double error = kNotMeasured;   ///< NaN: the fit failed
  double spread = kNotMeasured;  ///< standard deviation of one run; NaN for fewer than two
  std::size_t runs = 1;
  std::string text = {};  ///< the error as shown: the digits as printed, or four
  std::string remark =
      {};  ///< the condition of a published figure and its source; why a fit failed

  bool operator==(const BoardRow&) const = default;
};

/// A row of an error that was measured, rounded to four digits as in the file of rows.
[[nodiscard]] BoardRow measured_row(std::string_view set, std::string_view model,
                                    BoardOrigin origin, double error);

/// What `studies/board_rows.csv` holds: the rows of the last complete run, and those that joined.
[[nodiscard]] std::vector<BoardRow> recorded_board_rows();
[[nodiscard]] std::vector<BoardRow> published_board_rows();

/// The content of `studies/board_rows.csv` with those rows, published ones left out.
[[nodiscard]] std::string board_rows_csv(std::span<const BoardRow> rows);
/// One line of it, without the end of the line.
[[nodiscard]] std::string board_row_csv(const BoardRow& row);

/// @throws UsageError unless the name has 1 to 60 characters, none of which is a comma, a quote, a vertical line or a
/// backslash.
void require_board_name(const std::string& name, const std::string& place);

/// The rows of a set, lowest error first, failed ones last.
[[nodiscard]] std::vector<BoardRow> rows_of(const BoardSet& set, std::span<const BoardRow> rows);

/// The standard deviation of one run as a cell of a table; empty for fewer than two.
[[nodiscard]] std::string spread_text(const BoardRow& row);

/// The table of a set for a terminal.
[[nodiscard]] std::string board_table(const BoardSet& set, std::span<const BoardRow> rows);

/// docs/board.md
/// @param rows of all sets, the published ones among them
[[nodiscard]] std::string board_page(std::span<const BoardRow> rows);

}  // namespace torsio
