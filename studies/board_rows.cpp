#include "studies/board_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

/// A line of board_rows.csv.
struct RecordedRow {
  std::string_view set;
  std::string_view model;
  std::string_view origin;
  std::string_view error;
  std::string_view spread;
  std::string_view runs;
  std::string_view remark;
};

constexpr auto kRecordedRows = std::to_array<RecordedRow>({
#include "board_rows.inc"
});

constexpr std::array<std::pair<BoardOrigin, std::string_view>, 4> kOrigins{
    {{BoardOrigin::published, "published"},
     {BoardOrigin::measured, "measured here"},
     {BoardOrigin::joined, "joined"},
     {BoardOrigin::added, "your predictions"}}};

double number_of(std::string_view text) {
  double value = kNotMeasured;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// Four digits, as in the file of rows.
std::string digits(double value) {
  return std::isnan(value) ? std::string() : fmt::format("{:.4g}", value);
}

BoardOrigin origin_of(std::string_view name) {
  const auto* const found =
      std::ranges::find(kOrigins, name, &std::pair<BoardOrigin, std::string_view>::second);
  return found == kOrigins.end() ? BoardOrigin::joined : found->first;
}

}  // namespace

std::string_view name(BoardOrigin origin) noexcept {
  return kOrigins[static_cast<std::size_t>(origin)].second;
}

BoardRow measured_row(std::string_view set, std::string_view model, BoardOrigin origin,
                      double error) {
  const std::string text = digits(error);
  return {.set = std::string(set),
          .model = std::string(model),
          .origin = origin,
          .error = number_of(text),
          .text = text};
}

std::vector<BoardRow> recorded_board_rows() {
  std::vector<BoardRow> rows;
  rows.reserve(kRecordedRows.size());
  for (const RecordedRow& recorded : kRecordedRows) {
    BoardRow row = measured_row(recorded.set, recorded.model, origin_of(recorded.origin),
                                number_of(recorded.error));
    row.spread = number_of(recorded.spread);
    row.runs = static_cast<std::size_t>(number_of(recorded.runs));
    row.remark = recorded.remark;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<BoardRow> published_board_rows() {
  std::vector<BoardRow> rows;
  rows.reserve(board_published().size());
  for (const BoardPublished& figure : board_published())
    rows.push_back({.set = std::string(figure.set),
                    .model = std::string(figure.model),
                    .origin = BoardOrigin::published,
                    .error = figure.value,
                    .runs = 0,
                    .text = std::string(figure.text),
                    .remark = fmt::format("{}; {}", figure.condition, figure.source)});
  return rows;
}

std::string board_row_csv(const BoardRow& row) {
  const BoardOrigin origin = row.origin == BoardOrigin::added ? BoardOrigin::joined : row.origin;
  return fmt::format("{},{},{},{},{},{},{}", row.set, row.model, name(origin), row.text,
                     digits(row.spread), row.runs, row.remark);
}

std::string board_rows_csv(std::span<const BoardRow> rows) {
  std::string csv = "set,model,origin,error,spread,runs,remark\n";
  for (const BoardSet& set : board_sets())
    for (const BoardRow& row : rows_of(set, rows))
      if (row.origin != BoardOrigin::published) csv += board_row_csv(row) + "\n";
  return csv;
}

void require_board_name(const std::string& name, const std::string& place) {
  constexpr std::size_t kLongest = 60;
  const bool has_sign = name.find_first_of(",\"\\|\n\r\t") != std::string::npos;
  const bool is_blank = name.find_first_not_of(' ') == std::string::npos;
  if (!is_blank && name.size() <= kLongest && !has_sign) return;
  throw UsageError({.place = place,
                    .expected = fmt::format("a name of 1 to {} characters without comma, quote, "
                                            "vertical line and backslash",
                                            kLongest),
                    .found = fmt::format("\"{}\"", name)});
}

std::vector<BoardRow> rows_of(const BoardSet& set, std::span<const BoardRow> rows) {
  std::vector<BoardRow> own;
  for (const BoardRow& row : rows)
    if (row.set == set.name) own.push_back(row);
  std::ranges::stable_sort(own, [](const BoardRow& a, const BoardRow& b) {
    return std::isnan(b.error) ? !std::isnan(a.error) : a.error < b.error;
  });
  return own;
}

std::string spread_text(const BoardRow& row) {
  return std::isfinite(row.spread) ? fmt::format("{:.2g}", row.spread) : std::string();
}

std::string board_table(const BoardSet& set, std::span<const BoardRow> rows) {
  TextTable table;
  table.header({"", "model", fmt::format("{} {}", name(set.measure), set.unit), "+-", "runs",
                "origin", "condition and source"});
  std::size_t place = 0;
  for (const BoardRow& row : rows_of(set, rows))
    table.row({fmt::format("{}", ++place), row.model, row.text.empty() ? "-" : row.text,
               spread_text(row), row.runs > 0 ? fmt::format("{}", row.runs) : std::string(),
               std::string(name(row.origin)), row.remark});
  return fmt::format("{}: {}\n{}\n{}", set.name, set.title, set.split, table.text());
}

}  // namespace torsio
