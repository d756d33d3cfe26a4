#include "data/log_summary.hpp"

#include <algorithm>
#include <cmath>

#include "data/mapping/column_advice.hpp"
#include "data/marks_of_changes.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

void state_unit(const LogColumn& column, ColumnSummary& summary) {
  if (column.time != TimeKind::none) {
    summary.unit = "s";
    summary.unit_origin = UnitOrigin::dates;
  } else if (!column.unit.empty()) {
    summary.unit = column.unit;
    const auto in_brackets = unit_in_brackets(column.name);
    summary.unit_origin = in_brackets && in_brackets->unit->suffix == column.unit
                              ? UnitOrigin::brackets
                              : UnitOrigin::row_of_units;
  } else if (const auto name = split_channel_name(column.name)) {
    summary.unit = name->unit->suffix;
    summary.unit_origin = UnitOrigin::name;
  }
}

ColumnSummary summary_of(const LogColumn& column) {
  constexpr std::size_t kFirst = 4;
  ColumnSummary summary{.name = column.name};
  state_unit(column, summary);
  for (const double value : column.values) {
    if (std::isnan(value)) {
      ++summary.empty;
      continue;
    }
    if (summary.measured == 0) summary.lowest = summary.highest = value;
    summary.lowest = std::min(summary.lowest, value);
    summary.highest = std::max(summary.highest, value);
    if (summary.first.size() < kFirst) summary.first.push_back(value);
    ++summary.measured;
  }
  if (!column.fresh.empty()) {
    summary.fresh = static_cast<std::size_t>(std::ranges::count(column.fresh, 1));
    return summary;
  }
  std::vector<double> measured;
  std::ranges::copy_if(column.values, std::back_inserter(measured),
                       [](double value) { return !std::isnan(value); });
  summary.fresh = static_cast<std::size_t>(std::ranges::count(marks_of_changes(measured), 1));
  return summary;
}

}  // namespace

std::string_view name(UnitOrigin origin) noexcept {
  switch (origin) {
    case UnitOrigin::none: return "";
    case UnitOrigin::name: return "name";
    case UnitOrigin::brackets: return "brackets";
    case UnitOrigin::row_of_units: return "row of units";
    case UnitOrigin::dates: return "dates";
  }
  return "";
}

std::vector<ColumnSummary> column_summaries(const LogTable& table) {
  std::vector<ColumnSummary> columns;
  columns.reserve(table.columns.size());
  for (const LogColumn& column : table.columns) columns.push_back(summary_of(column));
  return columns;
}

}  // namespace torsio
