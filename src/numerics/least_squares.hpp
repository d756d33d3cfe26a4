#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

struct LeastSquares {
  std::vector<double> coefficients;  ///< one per column, 0 for a dropped one
  std::vector<std::size_t> dropped;  ///< columns that depend linearly on those before them
};

/// argmin |A c - y|, by Householder QR of the columns scaled to length 1. A column that the ones
/// before it explain to 1e-10 of its length is dropped.
/// @throws Error if there are fewer samples than columns that remain.
[[nodiscard]] LeastSquares least_squares(const Matrix& design, std::span<const double> target);

/// `least_squares` of rows that come one after the other: [A y] is reduced to its triangular factor
/// block by block, so that A need not be kept. By Householder reflections as above, and therefore as
/// accurate.
class StreamedLeastSquares {
 public:
  /// @param block_rows rows that are gathered before each reduction
  explicit StreamedLeastSquares(std::size_t columns, std::size_t block_rows = 1024);

  void add(std::span<const double> row, double target);

  /// @throws Error as `least_squares`.
  [[nodiscard]] LeastSquares solve();

 private:
  void reduce();

  Matrix rows_;  ///< the triangle so far, then rows that are not yet reduced; the last column is y
  std::size_t filled_ = 0;
};

/// Orthonormal basis (samples x rank) of the columns that `least_squares` would keep.
[[nodiscard]] Matrix orthonormal_basis(const Matrix& design);

}  // namespace torsio
