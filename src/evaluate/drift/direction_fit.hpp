#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// The part of a residual that does not average out: the error of the model, which a motion of the same kind repeats.
struct LastingError {
  double rms = 0.0;
  /// False: white noise hides it, and `rms` is what so many samples of the noise cannot exclude.
  bool is_resolved = false;
};

/// Least squares of a residual on directions of change.
struct DirectionFit {
  std::vector<double> coefficients;     ///< 0 where the direction was left out
  std::vector<double> standard_errors;  ///< NaN where it was left out, or too few blocks are there
  /// Length of each column without what the other columns explain, over the square root of the samples.
  std::vector<double> own_rms;
  std::vector<double> residual;
  double effective_samples = kNotMeasured;

  [[nodiscard]] double residual_rms() const noexcept;
  /// From the covariance of samples that are `lag` to 4 `lag` apart, in which noise of a sensor has no part.
  [[nodiscard]] LastingError lasting_error(std::size_t lag) const noexcept;
};

/// A column of which the others explain all but `kLeastOwnShare` of its length is left out, the last first.
inline constexpr double kLeastOwnShare = 0.02;
[[nodiscard]] DirectionFit fit_directions(const Matrix& columns, std::span<const double> residual,
                                          std::size_t resamples, std::uint64_t seed);

}  // namespace torsio
