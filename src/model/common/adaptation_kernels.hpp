#pragma once

#include <cstddef>

namespace torsio::adaptation_kernels {

/// Doubles in one vector of this machine. Every vector below is aligned and padded with 0 to a
/// multiple of it.
[[nodiscard]] std::size_t lanes() noexcept;

/// The lower triangle of a symmetric matrix in square blocks of `lanes()`: block row by block row up
/// to the diagonal, each block row by row; the diagonal blocks are whole.
[[nodiscard]] std::size_t triangle_size(std::size_t padded) noexcept;
/// Index of its diagonal element `row`.
[[nodiscard]] std::size_t diagonal_index(std::size_t row) noexcept;

struct Sums {
  double dot = 0.0;
  double square = 0.0;
};
/// extended = [features; 1; 0...]. @returns weights . extended, and extended's square
Sums extend(const float* features, std::size_t count, const double* weights,
            double* extended) noexcept;

/// target = keep target + gain direction. @returns its square
double blend(double* target, double keep, double gain, const double* direction,
             std::size_t padded) noexcept;

/// P = scale (P - g g'), product = P x, in one pass. What is symmetric stays so, to the bit.
/// @returns the trace of P
double update_and_multiply(double* triangle, std::size_t padded, double scale, const double* g,
                           const double* x, double* product) noexcept;

[[nodiscard]] double dot(const double* a, const double* b, std::size_t padded) noexcept;

}  // namespace torsio::adaptation_kernels
