#pragma once

#include <cstddef>

#include "core/aligned_vector.hpp"

namespace torsio::double_gemm {

/// Element (i, j) of a factor is values[i * row_step + j * column_step].
struct Factor {
  const double* values;
  std::size_t row_step;
  std::size_t column_step;

  [[nodiscard]] Factor transposed() const noexcept { return {values, column_step, row_step}; }
};

/// Row-major.
struct Result {
  double* values;
  std::size_t stride;
  std::size_t rows;
  std::size_t columns;
};

/// What a product does to its result.
enum class Mode { set, add, subtract };

/// Memory that `multiply` works in.
struct Scratch {
  detail::AlignedVector<double> left;
  detail::AlignedVector<double> right;
};

/// C = A B, C += A B or C -= A B, with A [C.rows x depth] and B [depth x C.columns].
/// @param lower_only leave out blocks that lie above the diagonal; others are written whole.
void multiply(const Factor& a, const Factor& b, std::size_t depth, Mode mode, const Result& c,
              bool lower_only, Scratch& scratch);

}  // namespace torsio::double_gemm
