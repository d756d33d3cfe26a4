#include "torsio/safety/history.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxNumbers = 10'000'000;

std::size_t checked_size(std::size_t rows, std::size_t columns) {
  if (rows == 0 || columns == 0 || rows > kMaxNumbers / columns)
    throw Error({.place = "history",
                 .expected = fmt::format("rows and columns of at most {} numbers", kMaxNumbers),
                 .found = fmt::format("{} rows, {} columns", rows, columns)});
  return rows * columns;
}

}  // namespace

History::History(std::size_t rows, std::size_t columns)
    : rows_(rows), columns_(columns), numbers_(checked_size(rows, columns)) {}

void History::record(std::span<const double> row) noexcept {
  if (is_frozen_ || row.size() != columns_) return;
  std::ranges::copy(row, numbers_.begin() + static_cast<std::ptrdiff_t>(next_ * columns_));
  next_ = next_ + 1 == rows_ ? 0 : next_ + 1;
  size_ = std::min(size_ + 1, rows_);
}

void History::reset() noexcept {
  next_ = size_ = 0;
  is_frozen_ = false;
}

std::span<const double> History::row(std::size_t row) const noexcept {
  const std::size_t oldest = size_ == rows_ ? next_ : 0;
  const std::size_t place = (oldest + row) % rows_;
  return std::span(numbers_).subspan(place * columns_, columns_);
}

}  // namespace torsio
