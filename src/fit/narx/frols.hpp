#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// A product of regressors by their indices, in rising order: x_0^2 x_3 is {0, 0, 3}, 1 is {}.
using Monomial = std::vector<std::size_t>;

struct FrolsOptions {
  std::size_t degree = 3;  ///< highest degree of the candidates
  std::size_t terms = 8;   ///< largest number of terms
  /// Exchanges a chosen term for another candidate wherever that explains more.
  bool exchange = true;
};

/// The terms of one size, sorted by the share of the remaining variance that they explain.
struct ChosenTerms {
  std::vector<Monomial> terms;
  std::vector<double> coefficients;      ///< least squares, of the scaled regressors' monomials
  std::vector<double> error_reductions;  ///< ERR: share of y.y that the term adds
};

struct Frols {
  std::vector<double> scales;      ///< s_i: largest magnitude of each regressor, 1 if that is 0
  std::size_t candidates = 0;      ///< number of monomials to choose from
  std::vector<ChosenTerms> sizes;  ///< with 1, 2, ... terms
};

/// The number of monomials of so many inputs with at most that degree, the constant included; the
/// largest std::size_t on overflow.
[[nodiscard]] std::size_t monomial_count(std::size_t inputs, std::size_t degree) noexcept;

inline constexpr std::size_t kMaxCandidates = 100'000;
inline constexpr std::size_t kMaxTerms = 100;

/// @throws UsageError with the largest possible degree if there are more than `kMaxCandidates`.
void check_candidates(std::size_t inputs, std::size_t degree);

/// Chooses monomials of the scaled regressors by forward regression with orthogonal least squares:
/// in every round the candidate that explains most of the remaining variance,
///
///     ERR_j = (w_j . y)^2 / (w_j . w_j  y . y),   w_j = phi_j - sum_s q_s (q_s . phi_j)
///
/// with q_s the orthonormal basis of those chosen before. Only the inner products with all
/// candidates are kept, so that a round is one pass over the samples with the newest q, in which
/// the candidates are computed and never stored. Candidates that the chosen ones explain to 1e-6 of
/// their length are skipped; the search ends early where no remaining candidate explains 1e-15 of
/// y. With `exchange`, every chosen term is then removed in turn and replaced by the best
/// candidate, until the set no longer changes (Givens rotations remove a term without a pass over
/// the samples).
///
/// Deterministic. Source: Chen, Billings and Luo 1989 (Int. J. Control 50, 1873); the exchange: Li,
/// Peng and Bai 2006 (Automatica 42, 1189). Cost: 2 multiply-adds for each candidate, sample and
/// term; memory: (regressors + terms) x samples.
/// @param regressors samples x inputs, finite; `target` has one value per sample.
/// @throws Error if the target is 0 throughout or there are fewer samples than terms; UsageError for
/// a degree or number of terms out of range, or more candidates than `kMaxCandidates`; Cancelled.
[[nodiscard]] Frols frols(const Matrix& regressors, std::span<const double> target,
                          const FrolsOptions& options, const Progress& progress = {});

}  // namespace torsio
