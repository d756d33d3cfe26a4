#pragma once

#include <cstddef>

#include "torsio/model/mixture_regression.hpp"

namespace torsio::mixture_kernels {

/// Components stand in blocks; inside a block, row r holds parameter r of each component:
/// mean [d], whitening [d(d+1)/2] (rows of the lower triangle of L^-1 / sqrt 2), offset; blocks in
/// double then go on with output mean, slope [d], output variance. Padding has offset -infinity.
inline constexpr std::size_t kScanLanes = 16;
inline constexpr std::size_t kExactLanes = 8;

constexpr std::size_t scan_rows(std::size_t inputs) {
  return inputs + inputs * (inputs + 1) / 2 + 1;
}
constexpr std::size_t exact_rows(std::size_t inputs) { return scan_rows(inputs) + inputs + 2; }

/// Float32 log weights of all components. @returns their maximum.
float scan(const float* packed, std::size_t blocks, std::size_t inputs, const float* z,
           float* log_weights) noexcept;

/// Lists the blocks of `kExactLanes` in which some component is not below `threshold`. @returns how
/// many.
std::size_t select(const float* log_weights, std::size_t exact_blocks, float threshold,
                   std::size_t* candidates) noexcept;

/// Log weights, in double, of the candidates' components, and then the mixture's moments.
Conditional finish(const double* packed, std::size_t inputs, const double* z,
                   const std::size_t* candidates, std::size_t count, double* log_weights) noexcept;

}  // namespace torsio::mixture_kernels
