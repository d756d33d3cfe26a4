#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// The posterior of values u at inducing points Z, in closed form for a fixed kernel. With
///
///     Lambda_n = k(x_n, x_n) - q_n . K^-1 q_n + sigma^2  (FITC), or sigma^2 (the optimum of Titsias'
///     bound), and A = K + sum_n q_n q_n^T / Lambda_n:
///     alpha = A^-1 sum_n q_n y_n / Lambda_n,   C = K^-1 - A^-1
struct SparsePosterior {
  std::vector<double> weights;  ///< alpha
  Matrix explained;             ///< C
};

enum class SparseNoise { fitc, variational };

/// @throws Error if K has no factor, Cancelled.
[[nodiscard]] SparsePosterior sparse_posterior(const Kernel& kernel, const Matrix& points,
                                               double noise_variance, const Matrix& features,
                                               std::span<const double> target, SparseNoise noise,
                                               const Progress& progress = {});

/// Minus Titsias' collapsed bound over some samples, and its gradient.
class CollapsedBound {
 public:
  CollapsedBound(Kernel kernel, Matrix points, const Matrix& features, std::vector<double> target);

  /// Numbers of the kernel, then ln sigma^2. Infinity where K has no factor.
  double evaluate(std::span<const double> parameters, std::span<double> gradient);

 private:
  Kernel kernel_;
  Matrix points_;
  PackedPoints packed_;
  const Matrix& features_;
  std::vector<double> target_;
};

}  // namespace torsio
