#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace torsio {

/// A sum of squares within bounds, as `levenberg_marquardt` takes it.
struct BoxedSquares {
  std::size_t residuals = 0;
  /// Fills r and, unless it is empty, J = ∂r/∂θ row by row. @returns false where they cannot be computed.
  std::function<bool(std::span<const double> theta, std::span<double> residuals,
                     std::span<double> jacobian)>
      evaluate;
  std::span<const double> lower = {};  ///< one a parameter, or empty; lower <= θ <= upper
  std::span<const double> upper = {};
  std::size_t max_iterations = 100;
  double tolerance = 1e-9;  ///< relative fall of Σ r² below which it has converged
  /// Called with each iteration and its Σ r²; may throw.
  std::function<void(std::size_t iteration, double sum_of_squares)> report = {};
};

struct BoxedMinimum {
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  bool has_converged = false;
  std::size_t iterations = 0;  ///< the start is one
};

/// argmin_θ Σ r² by Levenberg-Marquardt: the step minimises |r + J δ|² + |D δ|² / radius within the
/// bounds, where D² is the diagonal of JᵀJ. The radius follows the ratio of the real fall to that of
/// the linear model (Madsen, Nielsen and Tingleff 2004, section 3.2). A parameter on a bound from
/// which the gradient points out is held for the step. One thread, deterministic.
/// Σ r² is that of the start, with `has_converged` false, if r or J cannot be computed there.
[[nodiscard]] BoxedMinimum levenberg_marquardt(const BoxedSquares& problem,
                                               std::vector<double> start);

}  // namespace torsio
