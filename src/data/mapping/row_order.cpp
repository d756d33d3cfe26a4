#include "data/mapping/row_order.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

namespace torsio {
namespace {

/// Whether increasing stamps are on an even clock, with samples missing here and there.
bool is_on_even_clock(const std::vector<double>& stamps_s) {
  constexpr double kNear = 0.25;
  constexpr std::size_t kFewest = 3;
  if (stamps_s.size() < kFewest) return false;
  std::vector<double> intervals_s(stamps_s.size() - 1);
  for (std::size_t i = 0; i < intervals_s.size(); ++i)
    intervals_s[i] = stamps_s[i + 1] - stamps_s[i];
  std::vector<double> sorted = intervals_s;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  const double step_s = *middle;
  return step_s > 0.0 && std::ranges::all_of(intervals_s, [&](double interval_s) {
           const double steps = interval_s / step_s;
           const double whole = std::round(steps);
           return whole >= 1.0 && whole <= static_cast<double>(kMaxLateRows) &&
                  std::abs(steps - whole) <= kNear;
         });
}

template <class Values>
void reorder(Values& values, const std::vector<std::size_t>& order) {
  Values ordered;
  ordered.reserve(order.size());
  for (const std::size_t row : order) ordered.push_back(values[row]);
  values = std::move(ordered);
}

}  // namespace

bool are_equal_rows(const TableChannels& columns, std::size_t a, std::size_t b) {
  return std::ranges::all_of(columns.channels, [&](const TableChannel& column) {
    const Channel& channel = column.channel;
    const double first = channel.values[a];
    const double second = channel.values[b];
    return (first == second || (std::isnan(first) && std::isnan(second))) &&
           (channel.fresh.empty() || channel.fresh[a] == channel.fresh[b]);
  });
}

std::optional<RowOrder> find_row_order(const TableChannels& columns, Rows rows, bool is_stated) {
  constexpr std::size_t kLateShare = 4;  // one in so many
  if (!columns.clock || rows.size() < 2) return std::nullopt;
  const std::vector<double>& stamps_s = columns.clock->channel.values;
  RowOrder order;
  bool is_other = false;
  double latest_s = stamps_s[rows.begin];
  for (std::size_t row = rows.begin; row < rows.end; ++row) {
    if (!std::isfinite(stamps_s[row])) return std::nullopt;
    if (row == rows.begin) continue;
    const bool is_twice = stamps_s[row] == stamps_s[row - 1];
    if (is_twice && !is_stated && !are_equal_rows(columns, row - 1, row)) return std::nullopt;
    if (stamps_s[row] < latest_s) ++order.late;
    is_other = is_other || is_twice || stamps_s[row] < latest_s;
    latest_s = std::max(latest_s, stamps_s[row]);
  }
  if (!is_other || (!is_stated && kLateShare * order.late > rows.size())) return std::nullopt;

  std::vector<std::size_t> sorted(rows.size());
  std::iota(sorted.begin(), sorted.end(), rows.begin);
  std::ranges::stable_sort(sorted, {}, [&](std::size_t row) { return stamps_s[row]; });
  std::vector<double> kept_s;
  for (std::size_t k = 0; k < sorted.size(); ++k) {
    const std::size_t row = sorted[k];
    const std::size_t place = rows.begin + k;
    order.furthest = std::max(order.furthest, row > place ? row - place : place - row);
    const bool is_again = !order.rows.empty() && stamps_s[row] == kept_s.back() &&
                          are_equal_rows(columns, row, order.rows.back());
    if (is_again) {
      ++order.repeated;
      continue;
    }
    order.rows.push_back(row);
    kept_s.push_back(stamps_s[row]);
  }
  if (!is_stated && (order.furthest > kMaxLateRows || !is_on_even_clock(kept_s)))
    return std::nullopt;
  return order;
}

void put_in_order(LogTable& table, TableChannels& columns, const std::vector<std::size_t>& order) {
  const std::size_t rows = columns.clock->channel.values.size();
  std::vector<std::pair<std::size_t, std::size_t>> marks;
  std::size_t last = 0;
  for (std::size_t row = 0; row < order.size(); ++row) {
    const std::size_t line = table.line_of(order[row]);
    if (row == 0 || line != last + 1) marks.emplace_back(row, line);
    last = line;
  }
  table.line_marks = std::move(marks);
  for (LogColumn& column : table.columns)  // others were moved into their channels
    if (column.values.size() == rows) reorder(column.values, order);
  reorder(columns.clock->channel.values, order);
  for (TableChannel& column : columns.channels) {
    reorder(column.channel.values, order);
    if (!column.channel.fresh.empty()) reorder(column.channel.fresh, order);
  }
}

}  // namespace torsio
