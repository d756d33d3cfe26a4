#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "data/csv/csv_header.hpp"
#include "data/csv/csv_table.hpp"
#include "data/csv/line_reader.hpp"

namespace torsio {

/// A line that was read ahead; its text is followed by a '\n'.
struct LineAhead {
  std::string text;
  std::size_t number = 0;

  [[nodiscard]] std::string_view line() const {
    return std::string_view(text).substr(0, text.size() - 1);
  }
};

/// What is before the rows of a table.
struct CsvStart {
  CsvHeader header;
  std::size_t line = 0;            ///< where the header is
  std::vector<std::string> units;  ///< cells of a row of units below the header; empty: none
  std::vector<LineAhead> ahead;    ///< lines after it that were read already
  std::vector<std::string> notes;
};

[[nodiscard]] inline bool is_comment_or_blank(std::string_view line) {
  return line.empty() || line.front() == '#';
}

/// Finds the header. It is the first line that is neither blank nor a comment, unless the table begins
/// later: then the line above the first row of numbers with as many cells. Below it may be a row of units.
/// @throws Error if there is no header.
[[nodiscard]] CsvStart read_start(LineReader& lines, const std::string& name,
                                  const CsvOptions& options);

}  // namespace torsio
