#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <span>
#include <vector>

#include "check/signal_pair.hpp"

namespace torsio {

/// The columns of a static curve with hysteresis over a signal, at the given samples:
///
///     1, z, z |z|, z^3, max(z - h, 0) for six h, s_r(z) for four r;   s_r <- clip(s_r + dz, -r, r)
///
/// z is the signal scaled to -1 ... 1. The hinges h follow curves that a cubic does not: a backlash,
/// a spring that softens. The stop operators s_r are those of Maxwell slip (Brokate and Sprekels,
/// Hysteresis and Phase Transitions, 1996, 2.1); they do not depend on the rate of the signal.
/// Samples that are not finite are passed over.
/// @param extent the range that is scaled to -1 ... 1
[[nodiscard]] Eigen::MatrixXd hysteresis_columns(const std::vector<double>& signal,
                                                 std::span<const std::size_t> samples,
                                                 const Extent& extent);
/// As many of them, the first ones, are the static curve.
inline constexpr Eigen::Index kStaticColumns = 10;
[[nodiscard]] inline Eigen::MatrixXd hysteresis_columns(const std::vector<double>& signal,
                                                        std::span<const std::size_t> samples) {
  return hysteresis_columns(signal, samples, extent_of(signal));
}

/// The input minus low-passes of it of first order, with time constants from 0.02 to 20 s: what a spring that relaxes adds
/// to a torque. They are larger in a faster motion.
[[nodiscard]] Eigen::MatrixXd relaxation_columns(const std::vector<double>& input,
                                                 std::span<const std::size_t> samples,
                                                 double sample_rate_Hz);

/// So many samples determine the columns.
inline constexpr std::size_t kSamplesOfAFit = 10000;

/// Every n-th sample of [begin, end) at which the signal is finite, so that about `enough` remain.
[[nodiscard]] std::vector<std::size_t> samples_for_fit(const std::vector<double>& signal,
                                                       std::size_t begin, std::size_t end,
                                                       std::size_t enough = kSamplesOfAFit);
/// The same over a whole recording, where input and target are finite.
[[nodiscard]] std::vector<std::size_t> known_samples(const Pair& pair,
                                                     std::size_t enough = kSamplesOfAFit);

/// The values at these samples.
[[nodiscard]] Eigen::VectorXd at_samples(const std::vector<double>& values,
                                         std::span<const std::size_t> samples,
                                         std::ptrdiff_t shift = 0);

/// Least squares on fixed columns, whose first one is constant, for many right-hand sides.
class FixedColumns {
 public:
  explicit FixedColumns(const Eigen::MatrixXd& columns);

  /// Share of the variance of `values` that the columns leave; 1 if they do not vary.
  [[nodiscard]] double unexplained(const Eigen::VectorXd& values) const;
  /// What the columns leave of `values`.
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::VectorXd& values) const;
  [[nodiscard]] const Eigen::MatrixXd& basis() const noexcept { return basis_; }

 private:
  Eigen::MatrixXd basis_;  ///< orthonormal
};

/// Share of the variance of `values` that a residual of it is.
[[nodiscard]] double share_of_variance(const Eigen::VectorXd& residual,
                                       const Eigen::VectorXd& values);

/// Slope of values over z, by least squares; 0 if z does not vary.
[[nodiscard]] double slope_over(const Eigen::VectorXd& z, const Eigen::VectorXd& values);

}  // namespace torsio
