#pragma once

#include <cstddef>

#include "model/gaussian_process/kernel.hpp"

namespace torsio::kernel_kernels {

/// Points, values and weights come in whole groups of this many.
inline constexpr std::size_t kGroup = 8;

constexpr std::size_t in_groups(std::size_t count) {
  return (count + kGroup - 1) / kGroup * kGroup;
}

struct Program {
  const KernelTerm* terms;
  std::size_t count;
  const double* weights;
  std::size_t inputs;
};

struct Points {
  const double* values;  ///< [input][stride]
  std::size_t stride;
  std::size_t count;
};

void row(const Program& program, const double* x, const Points& points, double* values) noexcept;

/// @param gradient [parameter][kGroup], added to.
void add_gradient(const Program& program, const double* x, const Points& points,
                  const double* weights, double* gradient) noexcept;

/// a . b; `count` is a whole number of groups, both are aligned.
[[nodiscard]] double dot(const double* a, const double* b, std::size_t count) noexcept;

/// q . (C q) of a C [size x in_groups(size)] whose padding is 0; q is padded with finite numbers.
[[nodiscard]] double quadratic_form(const double* c, const double* q, std::size_t size) noexcept;

/// |L^-1 k|^2 for L stored row after row, row i of in_groups(i + 1) places, 0 after element i, with
/// the inverse of the diagonal. `k` becomes L^-1 k; its padding is finite.
[[nodiscard]] double whitened_square(const double* rows, double* k, std::size_t size) noexcept;

}  // namespace torsio::kernel_kernels
