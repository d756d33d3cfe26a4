#pragma once

#include <cstddef>

#include "model/mixture/mixture_regression.hpp"

namespace torsio::mixture_kernels {

/// Components are stored in blocks; inside a block, row r holds parameter r of each component.
/// `scan`: mean [d], whitening [d(d+1)/2] (rows of the lower triangle of L^-1 / sqrt 2), offset.
/// `exact`, in double, continues with: output mean, slope [d], output variance.
/// `rounded`, in float, is `exact` followed by the rounding errors of the mean [d].
/// Padding has offset -infinity.
inline constexpr std::size_t kScanLanes = 16;
inline constexpr std::size_t kExactLanes = 8;

constexpr std::size_t scan_rows(std::size_t inputs) {
  return inputs + inputs * (inputs + 1) / 2 + 1;
}
constexpr std::size_t exact_rows(std::size_t inputs) { return scan_rows(inputs) + inputs + 2; }
constexpr std::size_t rounded_rows(std::size_t inputs) { return exact_rows(inputs) + inputs; }

/// Float32 log weights of all components. @returns their maximum.
float scan(const float* packed, std::size_t blocks, std::size_t inputs, const float* z,
           float* log_weights) noexcept;

/// Components that matter.
struct Selection {
  std::size_t count;  ///< blocks of `kExactLanes` that hold one not below the threshold
  std::size_t best;   ///< slot of one with the largest log weight
};

/// Lists the selected blocks in `candidates`, ascending.
Selection select(const float* log_weights, std::size_t exact_blocks, float threshold, float largest,
                 std::size_t* candidates) noexcept;

/// Log weights, in double, of the candidates' components, and then the mixture's moments.
Conditional finish(const double* packed, std::size_t inputs, const double* z,
                   const std::size_t* candidates, std::size_t count, double* log_weights) noexcept;

/// The mixture's moments in float32, over candidate blocks of `kScanLanes`.
/// @param z the given quantities rounded to float, then what rounding took from them.
/// @param best slot of the component about whose output mean the moments are taken.
/// @param largest log weight that the weights are relative to.
Conditional finish_rounded(const float* packed, std::size_t inputs, const float* z,
                           const std::size_t* candidates, std::size_t count, std::size_t best,
                           float largest) noexcept;

}  // namespace torsio::mixture_kernels
