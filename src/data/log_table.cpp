#include "data/log_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

bool LogColumn::has_unit() const noexcept {
  return !unit.empty() || split_channel_name(name).has_value();
}

std::string LogColumn::full_name() const {
  if (unit.empty() || split_channel_name(name)) return name;
  const auto in_brackets = unit_in_brackets(name);
  return fmt::format("{}_{}", in_brackets ? in_brackets->quantity : name, unit);
}

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

std::vector<std::string> LogTable::column_names() const {
  std::vector<std::string> names;
  for (const LogColumn& column : columns) names.push_back(column.name);
  names.insert(names.end(), other_columns.begin(), other_columns.end());
  return names;
}

std::string LogTable::column_list() const {
  constexpr std::size_t kMaxListed = 50;
  return listed(column_names(), kMaxListed) +
         (not_read.empty() ? "" : "; not read: " + listed(not_read));
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

std::string note_of_left_out(const std::vector<std::string>& columns) {
  std::vector<std::string> shown;
  shown.reserve(columns.size());
  for (const std::string& column : columns) shown.push_back(printable(column));
  return "columns without a unit that the mapping does not name are not read: " + listed(shown, 8);
}

}  // namespace torsio
