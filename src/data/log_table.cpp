#include "data/log_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data/names.hpp"

namespace torsio {

const LogColumn* LogTable::find(std::string_view name) const noexcept {
  const auto at = std::ranges::find(columns, name, &LogColumn::name);
  return at == columns.end() ? nullptr : &*at;
}

std::size_t LogTable::line_of(std::size_t row) const noexcept {
  const auto after =
      std::ranges::upper_bound(line_marks, row, {}, &std::pair<std::size_t, std::size_t>::first);
  if (after == line_marks.begin()) return 0;
  const auto& [first_row, first_line] = *(after - 1);
  return first_line + row - first_row;
}

std::string LogTable::column_list() const {
  std::vector<std::string> names;
  for (const LogColumn& column : columns) names.push_back(column.name);
  return joined(names);
}

std::string LogTable::place(std::size_t row, const LogColumn& column) const {
  if (header_line == 0)
    return fmt::format("{}: {} {}, {}", source.file, row_word, line_of(row), column.name);
  return fmt::format("{}: line {}, column {} ({})", source.file, line_of(row), column.number,
                     column.name);
}

std::string LogTable::header_place(const LogColumn& column) const {
  if (header_line == 0) return fmt::format("{}: {}", source.file, column.name);
  return fmt::format("{}: line {}, column {} ({})", source.file, header_line, column.number,
                     column.name);
}

std::string LogTable::header_place() const {
  if (header_line == 0) return source.file;
  return fmt::format("{}: line {}", source.file, header_line);
}

}  // namespace torsio
