#pragma once

#include <cstddef>

#include "core/aligned_vector.hpp"

namespace torsio::float_gemm {

/// Columns are stored in panels of this many; results are written in whole panels.
inline constexpr std::size_t kPanel = 16;

constexpr std::size_t in_panels(std::size_t columns) {
  return (columns + kPanel - 1) / kPanel * kPanel;
}

/// The right factor of a product, its columns in panels, so that the product reads it in the order
/// in which it lies. Columns up to the next whole panel are 0.
class PackedMatrix {
 public:
  /// B(k, j) = values[k * stride + j].
  void pack(const float* values, std::size_t stride, std::size_t rows, std::size_t columns);
  /// B(k, j) = values[j * stride + k].
  void pack_transposed(const float* values, std::size_t stride, std::size_t rows,
                       std::size_t columns);

  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  [[nodiscard]] std::size_t columns() const noexcept { return columns_; }
  [[nodiscard]] const float* values() const noexcept { return values_.data(); }

 private:
  void resize(std::size_t rows, std::size_t columns);

  std::size_t rows_ = 0;
  std::size_t columns_ = 0;
  detail::AlignedVector<float> values_;  ///< [panel][row][kPanel]
};

/// C = A B (+ C if `accumulate`), A row-major [rows x B.rows()] with that stride. C's rows are
/// written up to the next whole panel: its stride must leave room for it.
void multiply(const float* a, std::size_t a_stride, std::size_t rows, const PackedMatrix& b,
              float* c, std::size_t c_stride, bool accumulate) noexcept;

/// Memory that `add_product_of_transposed` works in.
struct Scratch {
  detail::AlignedVector<float> left;
  detail::AlignedVector<float> right;
};

/// C += A^T B for A [rows x left], B [rows x right]; C [left x right] is written in whole panels.
/// The sum runs over the rows in a fixed order.
void add_product_of_transposed(const float* a, std::size_t a_stride, std::size_t left,
                               const float* b, std::size_t b_stride, std::size_t right,
                               std::size_t rows, float* c, std::size_t c_stride, Scratch& scratch);

}  // namespace torsio::float_gemm
