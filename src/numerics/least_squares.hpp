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

/// Orthonormal basis (samples x rank) of the columns that `least_squares` would keep.
[[nodiscard]] Matrix orthonormal_basis(const Matrix& design);

}  // namespace torsio
