#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/gaussian_process/cholesky.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// Values u ~ N(m, S) of a Gaussian process at inducing points Z, learned sample by sample, and
/// gradients by the kernel's numbers. See `fit_parametric_gp` for the equations.
class ParametricGpTrainer {
 public:
  /// m = 0, S = K.
  /// @throws Error if K has no factor.
  ParametricGpTrainer(Kernel kernel, Matrix points, double noise_variance);

  /// Numbers of the kernel, then ln sigma^2. Factorises K.
  /// @returns false, with the numbers taken back, if K has no factor or a number is not within -60..60.
  [[nodiscard]] bool set_parameters(std::span<const double> parameters);
  void set_noise_variance(double variance) noexcept { noise_variance_ = variance; }
  [[nodiscard]] std::vector<double> parameters() const;
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return kernel_.parameter_count() + 1;
  }

  struct Prediction {
    double mean = 0.0;
    double variance = 0.0;  ///< variance of f, without noise
  };
  /// Prepares what the calls below need of this input. NaN outside the kernel's domain.
  Prediction predict(std::span<const double> x);

  /// What follows is summed until `take_gradient` reads it: the gradient of (16) at the prepared
  /// input, `share` times that of KL(N(m, S) | N(0, K)), and that of
  /// m . K^-1 m / 2 + ln det K / 2.
  void add_data_gradient(double target, double share);
  void add_noise_gradient(double target, double share);
  void add_divergence_gradient(double share);
  void add_nlml_gradient();
  /// The gradient for all `parameters()`; the next sum begins at 0.
  void take_gradient(std::span<double> gradient);

  /// (m, S) after the prepared sample.
  void take_in(double target);

  /// (20) and (21) as paper 002 prints them, q for q^T in (20) and the outer product in (21), without
  /// which their dimensions differ: m += q (y - mu) / Sigma, S -= q q^T / Sigma.
  void take_in_as_printed(double target);

  /// S half way back to K.
  void widen();

  [[nodiscard]] const Kernel& kernel() const noexcept { return kernel_; }
  [[nodiscard]] const Matrix& points() const noexcept { return points_; }
  [[nodiscard]] double noise_variance() const noexcept { return noise_variance_; }
  [[nodiscard]] const Eigen::VectorXd& mean() const noexcept { return m_; }
  [[nodiscard]] const Eigen::MatrixXd& covariance() const noexcept { return s_; }
  [[nodiscard]] const Eigen::MatrixXd& inverse() const noexcept { return inverse_; }
  /// K with its jitter.
  [[nodiscard]] const Eigen::MatrixXd& prior() const noexcept { return k_; }
  [[nodiscard]] double jitter() const noexcept { return jitter_; }

 private:
  bool factorise();

  Kernel kernel_;
  Matrix points_;
  double noise_variance_;
  PackedPoints packed_;  ///< Z followed by the present input
  double jitter_ = 0.0;
  Eigen::MatrixXd k_;
  Eigen::MatrixXd inverse_;
  Eigen::MatrixXd s_;
  Eigen::VectorXd m_;
  // Values at the present input.
  std::vector<double> x_;
  Prediction prediction_;
  Eigen::VectorXd q_;
  Eigen::VectorXd a_;
  Eigen::VectorXd g_;
  Eigen::VectorXd b_;  ///< K^-1 g
  Eigen::VectorXd alpha_;
  // Sums of a gradient: weights of dK, of all else, and of the noise.
  Eigen::MatrixXd weights_;
  KernelGradient sums_;
  double noise_gradient_ = 0.0;
  // Scratch.
  Eigen::MatrixXd product_;
  SquareMatrix factor_;
  detail::AlignedVector<double> row_;
};

}  // namespace torsio
