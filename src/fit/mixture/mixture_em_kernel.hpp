#pragma once

#include <cstddef>

namespace torsio::mixture_em_kernel {

/// Samples are stored in tiles of 128: a row of 128 values for each quantity.
inline constexpr std::size_t kTile = 128;
/// Sums are kept in this many lanes.
inline constexpr std::size_t kLanes = 8;

/// Parameters of one component: mean [D], whitening [D(D+1)/2] (rows of the lower triangle of
/// L^-1 / sqrt 2), offset ln w - ln|Sigma| / 2 - D/2 ln 2 pi.
/// Sums of one component: n, sum r d [D], sum r d d^T [D(D+1)/2] with d = x - mean: as many.
constexpr std::size_t rows(std::size_t dimension) {
  return dimension + dimension * (dimension + 1) / 2 + 1;
}

struct Tile {
  const double* samples;  ///< [D x kTile]
  std::size_t valid;      ///< samples from here on are padding
};

/// Adds one tile's share to `sums` [components x rows x kLanes].
/// @param scratch [components x kTile]
/// @returns the tile's log likelihood.
double add_tile(const Tile& tile, const double* parameters, std::size_t components,
                std::size_t dimension, double* scratch, double* sums) noexcept;

}  // namespace torsio::mixture_em_kernel
