#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace torsio {

namespace detail {

/// A dense row-major table: plain data in public interfaces, which contain no Eigen types.
template <class Number>
struct Table2d {
  std::size_t rows = 0;
  std::size_t columns = 0;
  std::vector<Number> values;  ///< rows * columns, row by row

  Table2d() = default;
  Table2d(std::size_t row_count, std::size_t column_count, Number fill = Number{})
      : rows(row_count), columns(column_count), values(row_count * column_count, fill) {}

  Number& operator()(std::size_t row, std::size_t column) { return values[row * columns + column]; }
  Number operator()(std::size_t row, std::size_t column) const {
    return values[row * columns + column];
  }
  [[nodiscard]] std::span<Number> row(std::size_t index) {
    return std::span(values).subspan(index * columns, columns);
  }
  [[nodiscard]] std::span<const Number> row(std::size_t index) const {
    return std::span(values).subspan(index * columns, columns);
  }
  bool operator==(const Table2d&) const = default;
};

}  // namespace detail

using Matrix = detail::Table2d<double>;
using FloatMatrix = detail::Table2d<float>;  ///< weights of networks

}  // namespace torsio
