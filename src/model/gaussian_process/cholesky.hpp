#pragma once

#include <cstddef>
#include <span>

#include "core/aligned_vector.hpp"

namespace torsio {

/// A square matrix, row-major, rows on cache lines.
class SquareMatrix {
 public:
  SquareMatrix() = default;
  explicit SquareMatrix(std::size_t size)
      : size_(size), stride_((size + 7) / 8 * 8), values_(size * stride_, 0.0) {}

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  [[nodiscard]] double* row(std::size_t i) noexcept { return values_.data() + i * stride_; }
  [[nodiscard]] const double* row(std::size_t i) const noexcept {
    return values_.data() + i * stride_;
  }
  double& operator()(std::size_t i, std::size_t j) noexcept { return row(i)[j]; }
  double operator()(std::size_t i, std::size_t j) const noexcept { return row(i)[j]; }

 private:
  std::size_t size_ = 0;
  std::size_t stride_ = 0;
  detail::AlignedVector<double> values_;
};

/// A = L L^T: reads the lower triangle only; the part above it is overwritten. Recursive by halves,
/// so that nearly all of it is products of matrices (double_gemm).
/// @returns false, with all of it overwritten, if A is not positive definite.
[[nodiscard]] bool cholesky(SquareMatrix& a);

/// b = A^-1 b.
void solve(const SquareMatrix& factor, std::span<double> b) noexcept;

/// L becomes the lower triangle of A^-1; the part above it is overwritten.
void invert(SquareMatrix& factor);

/// ln det A.
[[nodiscard]] double log_determinant(const SquareMatrix& factor) noexcept;

}  // namespace torsio
