#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace torsio {

/// A dense row-major table of doubles: plain data at public borders, where no Eigen type may stand.
struct Matrix {
  std::size_t rows = 0;
  std::size_t columns = 0;
  std::vector<double> values;  ///< rows * columns, row by row

  Matrix() = default;
  Matrix(std::size_t row_count, std::size_t column_count, double fill = 0.0)
      : rows(row_count), columns(column_count), values(row_count * column_count, fill) {}

  double& operator()(std::size_t row, std::size_t column) { return values[row * columns + column]; }
  double operator()(std::size_t row, std::size_t column) const {
    return values[row * columns + column];
  }
  [[nodiscard]] std::span<double> row(std::size_t index) {
    return std::span(values).subspan(index * columns, columns);
  }
  [[nodiscard]] std::span<const double> row(std::size_t index) const {
    return std::span(values).subspan(index * columns, columns);
  }
  bool operator==(const Matrix&) const = default;
};

}  // namespace torsio
