#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The last rows of numbers before a stop, for the report afterwards. A ring of fixed size:
/// `record` neither allocates nor throws.
class History {
 public:
  /// @throws Error if there is no row or column, or more than 10^7 numbers.
  History(std::size_t rows, std::size_t columns);

  /// Keeps a row, in place of the oldest one. A row of another size, and every row after `freeze`,
  /// is ignored.
  void record(std::span<const double> row) noexcept TORSIO_REALTIME;
  /// Keeps what is recorded until `reset`.
  void freeze() noexcept { is_frozen_ = true; }
  void reset() noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }  ///< recorded rows
  [[nodiscard]] std::size_t columns() const noexcept { return columns_; }
  [[nodiscard]] bool is_frozen() const noexcept { return is_frozen_; }
  /// @param row 0 is the oldest; below `size()`
  [[nodiscard]] std::span<const double> row(std::size_t row) const noexcept;

 private:
  std::size_t rows_;
  std::size_t columns_;
  std::vector<double> numbers_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  bool is_frozen_ = false;
};

}  // namespace torsio
