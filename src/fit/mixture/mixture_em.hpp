#pragma once

#include <cstddef>
#include <span>

#include "core/aligned_vector.hpp"
#include "fit/mixture/online_mixture.hpp"
#include "model/mixture/gaussian_mixture.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// Refines a mixture by expectation maximisation with full covariances.
///
///     r_ki = w_i N(x~_k; mu_i, Sigma_i) / sum_j w_j N(x~_k; mu_j, Sigma_j)
///     n_i = sum_k r_ki
///     w_i = n_i / N
///     mu_i = sum_k r_ki x~_k / n_i
///     Sigma_i = (nu0 s0^2 I + sum_k r_ki (x~_k - mu_i)(x~_k - mu_i)^T) / (nu0 + n_i)
///
/// nu0 = prior_count and s0 = prior_spread are the inverse-Wishart prior of `OnlineMixture`, so
/// that no component collapses. Computed in double; the result does not depend on the number of
/// threads. Responsibilities below e^-40 of a sample's largest are dropped.
///
/// Source: specification 3.1 step 4; Dempster, Laird, Rubin 1977. Cost: about N m (D^2 + 12)
/// operations.
class MixtureEm {
 public:
  struct Prior {
    double count = 0.0;
    double spread = 0.0;  ///< standardised
  };

  /// @param samples [N x D], physical units, all finite.
  MixtureEm(const Matrix& samples, const Standardisation& standardisation, Prior prior);

  /// One iteration, in place. Components that no sample belongs to any more are removed.
  /// @param threads 0: as many as the machine has.
  /// @returns the mean log likelihood of a sample under the mixture as it came in.
  /// @throws Error if the mixture is not sound or of another dimension.
  double iterate(GaussianMixture& mixture, std::size_t threads = 0) const;

 private:
  void maximise(GaussianMixture& mixture, std::span<const double> sums) const;

  Prior prior_;
  std::size_t dimension_;
  std::size_t samples_;
  detail::AlignedVector<double>
      tiles_;  ///< tiles of samples, in each a row of values for every quantity
};

}  // namespace torsio
