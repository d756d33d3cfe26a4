#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"

namespace torsio {

/// A sum of squares to be minimised: r(θ) and, if it can be computed, J = ∂r/∂θ.
struct ResidualProblem {
  std::size_t residuals = 0;
  /// Fills the residuals and, unless it is empty, the Jacobian (residuals x parameters, row by row).
  /// @returns false where r cannot be computed (a run that diverges): the search takes a shorter
  /// step.
  std::function<bool(std::span<const double> theta, std::span<double> residuals,
                     std::span<double> jacobian)>
      evaluate;
  bool has_jacobian = false;  ///< else J is taken from central differences ..
  /// Half-width of the differences, relative to the larger of typical and |θ|: about the cube
  /// root of rounding, which is right for a smooth r; a rough one requires more.
  double difference = 1e-6;
  /// Number of samples that the residuals represent, where they are the triangle of a longer list;
  /// 0: as many.
  std::size_t samples = 0;
};

struct SearchOptions {
  std::size_t max_iterations = 100;
  std::vector<double> lower = {};  ///< bounds, one a parameter, or empty
  std::vector<double> upper = {};
  std::vector<double> typical = {};  ///< size of a change that matters, > 0; empty: |θ|, or 1 at 0
  /// Relative fall of Σ r² below which it has converged; long valleys: a slow step is not the end.
  double tolerance = 1e-9;
  Progress progress = {};  ///< called in each iteration, may cancel
};

struct SearchResult {
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  bool has_converged = false;
  std::size_t iterations = 0;
};

/// argmin_θ Σ r², by `levenberg_marquardt`, one thread, deterministic.
/// @throws Error if r cannot be computed at the start, UsageError for contradicting bounds,
/// Cancelled.
[[nodiscard]] SearchResult minimise_squares(const ResidualProblem& problem,
                                            std::vector<double> start,
                                            const SearchOptions& options = {});

/// The minima from several starts, the best first; starts from which r cannot be computed are left
/// out.
/// @throws as `minimise_squares`.
[[nodiscard]] std::vector<SearchResult> minimise_squares_each(
    const ResidualProblem& problem, const std::vector<std::vector<double>>& starts,
    const SearchOptions& options = {});

/// The best of several starts; those from which r cannot be computed are skipped.
/// @throws Error if that holds for all of them.
[[nodiscard]] SearchResult minimise_squares_from(const ResidualProblem& problem,
                                                 const std::vector<std::vector<double>>& starts,
                                                 const SearchOptions& options = {});

/// How well the data determine the parameters, from the Jacobian at the optimum.
struct ParameterUncertainty {
  /// sqrt(diag(s² (JᵀJ)⁻¹)), s² = Σ r² / (n − p): right for white residuals, too small for coloured
  /// ones. NaN for a parameter that has a part in a null direction.
  std::vector<double> std_error;
  /// Directions in θ / typical along which r does not change: unit vectors, singular value below
  /// 1e-6 of the largest.
  std::vector<std::vector<double>> null_directions;
};
[[nodiscard]] ParameterUncertainty uncertainty_of(const ResidualProblem& problem,
                                                  std::span<const double> theta,
                                                  std::span<const double> typical = {});

/// "k1 - 0.7 k2" of a null direction and the parameters' names; parts below 5 % are left out, and
/// all beyond the first eight.
[[nodiscard]] std::string description_of(std::span<const double> direction,
                                         std::span<const std::string> names);

}  // namespace torsio
