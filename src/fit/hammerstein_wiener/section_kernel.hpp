#pragma once

#include <cstddef>

namespace torsio::section_kernel {

/// Signals are interleaved: value n of signal k is values[n * stride + k]. The stride is a multiple of this.
inline constexpr std::size_t kLanes = 4;

/// One second-order section for each of the signals; all of them share the denominator:
///
///     y = b0 x + s1,  s1' = b1 x - a1 y + s2,  s2' = b2 x - a2 y
///
/// Arrays have `stride` numbers and are aligned for vectors.
struct Section {
  const double* b0;
  const double* b1;
  const double* b2;
  double a1;
  double a2;
  double* s1;  ///< states, continued from block to block
  double* s2;
};

/// Filters the signals in place.
void run(const Section& section, double* values, std::size_t samples, std::size_t stride) noexcept;

/// Columns one after the other, each with so many values. Their number is a multiple of `kLanes`.
inline constexpr std::size_t kColumnValues = 256;

/// Adds the products of each two columns to the lower triangle of `sums`, columns x columns, row by row. Blocks of
/// `kLanes` that the diagonal crosses are written whole.
void add_products(const double* values, std::size_t columns, double* sums) noexcept;

}  // namespace torsio::section_kernel
