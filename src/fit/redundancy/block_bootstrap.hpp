#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

struct BlockBootstrap {
  std::vector<double> standard_errors;  ///< one per coefficient; NaN below `kLeastBlocks`
  std::size_t block_samples = 1;
  double effective_samples = 0.0;  ///< N / (1 + 2 sum r_k)

  static constexpr std::size_t kLeastBlocks = 10;
};

/// Standard errors of coefficients that were fitted by least squares to a time series, from
/// `resamples` records of randomly chosen blocks of rows. Block length and corrections:
/// `fit_deflection_torque`.
/// @param basis samples x coefficients, orthonormal columns that span the design
/// @param residual the residual of the fit
/// @param to_coefficients from coordinates in the basis to coefficients
[[nodiscard]] BlockBootstrap block_bootstrap(const Matrix& basis, std::span<const double> residual,
                                             const Matrix& to_coefficients, std::size_t resamples,
                                             std::uint64_t seed);

}  // namespace torsio
