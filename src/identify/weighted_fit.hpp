#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace torsio {

[[nodiscard]] inline Eigen::Index eigen_index(std::size_t i) {
  return static_cast<Eigen::Index>(i);
}

/// Equations of several joints in the same windows: row `window * joints + joint`.
struct JointEquations {
  Eigen::MatrixXd columns;
  Eigen::VectorXd target;
  Eigen::VectorXd torque;  ///< the part of the target that is measured
  std::size_t joints = 0;
  std::span<const std::size_t> motion = {};  ///< the motion of each window
  /// Standard deviation of the scale of each joint's torque; empty: exact.
  std::vector<double> scale_std = {};
};

/// The parameters are expected to be `mean`, with the covariance 1 / `precision`, positive definite.
struct FitPrior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd precision;
};

struct WeightedFit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd jackknife;              ///< covariance over blocks, and of the prior
  Eigen::MatrixXd model;                  ///< inverse of the information matrix
  std::vector<double> residual_rms = {};  ///< one per joint
  std::size_t blocks = 0;
  std::size_t block_windows = 0;

  /// The standard error of gradientᵀ parameters: the larger one of both.
  [[nodiscard]] double standard_error(const Eigen::VectorXd& gradient) const;
};

/// θ = μ + (Xᵀ W X + P)⁻¹ Xᵀ W (y − X μ). W has for each joint 1 / (σ² T): σ² the variance of its
/// residuals, T = 1 + 2 Σ r_k their correlation time in windows; both are found by repetition. Covariance: the
/// jackknife over blocks (CR3) plus A⁻¹ P A⁻¹, the part of the prior. A block has at least 2 T
/// windows and belongs to one motion; the scales of the torques are not estimated, since a torque with noise as a
/// regressor would bias them to 0: the change of θ by one standard deviation of each is added to both covariances; at least `kLeastFitBlocks` are formed.
[[nodiscard]] WeightedFit weighted_fit(const JointEquations& equations, const FitPrior& prior);
inline constexpr std::size_t kLeastFitBlocks = 8;

}  // namespace torsio
