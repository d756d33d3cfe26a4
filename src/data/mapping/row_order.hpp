#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "data/log_table.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/record_rows.hpp"

namespace torsio {

/// Rows in the order of their stamps.
struct RowOrder {
  std::vector<std::size_t> rows;  ///< indices in the table, without rows that are repeated
  std::size_t late = 0;           ///< rows after one with a later stamp
  std::size_t furthest = 0;       ///< how many rows one is from its place
  std::size_t repeated = 0;       ///< rows with the stamp and every value of another one
};

/// By how many rows messages may come late and are sorted without being asked for.
inline constexpr std::size_t kMaxLateRows = 100;

/// The order of rows that came late or twice. Nothing if their stamps increase, or if they do not show that it is
/// only their order: each at most `kMaxLateRows` from its place, at most a quarter late, and sorted on an even clock in
/// which few samples are missing.
/// @param is_stated the mapping states that only the order is wrong, so nothing is required of the stamps
[[nodiscard]] std::optional<RowOrder> find_row_order(const TableChannels& columns, Rows rows,
                                                     bool is_stated);

/// Whether every channel has the same value in two rows.
[[nodiscard]] bool are_equal_rows(const TableChannels& columns, std::size_t a, std::size_t b);

/// Brings the rows of table and channels into an order; the places in messages remain those of the file.
void put_in_order(LogTable& table, TableChannels& columns, const std::vector<std::size_t>& order);

}  // namespace torsio
