#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/gaussian_process/cholesky.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// The prediction of an exact Gaussian process for each training sample when that sample is left
/// out.
struct LeaveOneOut {
  double rmse = 0.0;
  double log_density = 0.0;  ///< mean, of the left-out target
  double covered_95 = 0.0;   ///< share within 1.96 standard deviations
};

/// An exact Gaussian process while it is fitted: K = k(X, X) + sigma^2 I,
///
///     -ln p(y) = (y . alpha + ln det K + N ln 2 pi) / 2,   alpha = K^-1 y
///     d / dp = sum_ij (K^-1 - alpha alpha^T)_ij dK_ij / 2
///
/// Source: Rasmussen and Williams 2006, equations 2.30, 5.9, 5.12 (leave one out). Cost of a
/// gradient: N^3 operations and N^2 / 2 kernels.
class MarginalLikelihood {
 public:
  /// @param points standardised, as the target.
  MarginalLikelihood(Kernel kernel, Matrix points, std::vector<double> target);

  /// The kernel's own, then ln sigma^2.
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return kernel_.parameter_count() + 1;
  }

  /// -ln p(y) and its gradient; infinity where K has no factor.
  double evaluate(std::span<const double> parameters, std::span<double> gradient);

  /// Factorises K of these numbers. @returns -ln p(y), or infinity.
  double fix(std::span<const double> parameters);
  /// The kernel that was set last.
  [[nodiscard]] const Kernel& kernel() const noexcept { return kernel_; }
  [[nodiscard]] const std::vector<double>& weights() const noexcept { return weights_; }
  [[nodiscard]] double noise_variance() const noexcept { return noise_variance_; }
  [[nodiscard]] double jitter() const noexcept { return jitter_; }

  /// To be called after `fix`, once: the factor becomes the inverse.
  [[nodiscard]] LeaveOneOut leave_one_out();

  /// Memory that N points take.
  [[nodiscard]] static double bytes(std::size_t points) noexcept;

 private:
  Kernel kernel_;
  Matrix points_;
  PackedPoints packed_;
  std::vector<double> target_;
  std::vector<double> weights_;
  double noise_variance_ = 0.0;
  double jitter_ = 0.0;
  SquareMatrix matrix_;
  KernelGradient gradient_;
  detail::AlignedVector<double> row_;
};

}  // namespace torsio
