#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// AᵀA, Aᵀy and yᵀy of a least-squares problem, gathered row by row, so that A need not be kept.
struct NormalEquations {
  explicit NormalEquations(std::size_t columns)
      : product(columns, columns), projection(columns, 0.0) {}

  Matrix product;                  ///< AᵀA, columns x columns
  std::vector<double> projection;  ///< Aᵀy
  double square = 0.0;             ///< yᵀy
  std::size_t rows = 0;

  [[nodiscard]] std::size_t columns() const noexcept { return projection.size(); }
  void add(std::span<const double> row, double target) noexcept;

  /// |A c - y|²; rounding may leave 1e-15 of yᵀy where it is 0.
  [[nodiscard]] double error(std::span<const double> coefficients) const;
};

[[nodiscard]] NormalEquations normal_equations(const Matrix& design,
                                               std::span<const double> target);

struct NonNegativeFit {
  std::vector<double> coefficients;  ///< one per column
  std::vector<std::size_t> dropped;  ///< free columns that depend linearly on free ones before them
  bool has_converged = false;        ///< false: the active sets went in circles; the best one found
};

/// argmin |A c - y|² with c_j >= 0 where `is_free[j]` is 0: the active-set method of Lawson and
/// Hanson (Solving Least Squares Problems, 1974, chapter 23) with the free columns always in the
/// passive set. Columns are scaled to length 1; one that the passive columns explain to 1e-10 of its
/// squared length stays out, so a solution always exists. Deterministic. Working on AᵀA costs half
/// the digits: coefficients are good to about 1e-16 times the squared condition number.
/// @param is_free one per column
[[nodiscard]] NonNegativeFit non_negative_least_squares(const NormalEquations& equations,
                                                        std::span<const std::uint8_t> is_free);

/// sqrt(diag(s² (AᵀA)⁻¹)) over the columns whose coefficient is not 0, s² = |A c - y|² / (rows -
/// columns); NaN for the others, and for all if these columns are dependent.
[[nodiscard]] std::vector<double> standard_errors(const NormalEquations& equations,
                                                  std::span<const double> coefficients);

}  // namespace torsio
