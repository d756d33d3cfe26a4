#pragma once

#include <cstddef>
#include <string_view>

#include "model/gaussian_process/cholesky.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// A jitter on the diagonal, in shares of its mean: from `first` ten times larger as long as the
/// matrix is not positive definite. Source: specification 3.3.
struct Jitter {
  double first = 0.0;  ///< 0: none at first, then 1e-12
  static constexpr double kLargest = 1e-4;
};

/// K = k(points, points) + noise I, lower triangle.
void fill_covariance(const Kernel& kernel, const Matrix& points, const PackedPoints& packed,
                     double noise_variance, SquareMatrix& k);

/// The Cholesky factor of `fill_covariance`. @returns the jitter that it took, or a negative number
/// if none was enough.
[[nodiscard]] double factorise_covariance(const Kernel& kernel, const Matrix& points,
                                          const PackedPoints& packed, double noise_variance,
                                          Jitter jitter, SquareMatrix& factor);

/// @throws Error that states possible causes of a kernel whose matrix has no factor.
[[noreturn]] void refuse_covariance(std::string_view place);

}  // namespace torsio
