#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// Largest D: what is prepared for a query grows with its square.
inline constexpr std::size_t kMaxMixtureQuantities = 64;

/// A mixture of Gaussians over D quantities, in standardised coordinates x~ = (x - centre) / scale:
///
///     p(x~) = sum_i w_i N(x~; mu_i, Sigma_i),    sum_i w_i = 1
///
/// Plain data. Source: specification 3.1 (paper 000, equations 1 to 7; 001, 1 to 5).
struct GaussianMixture {
  std::vector<double> centre;   ///< [D], physical units
  std::vector<double> scale;    ///< [D], physical units, positive
  std::vector<double> weights;  ///< [m], positive, their sum is 1
  Matrix means;                 ///< [m x D]
  Matrix covariances;           ///< [m x D*D], each row a symmetric positive definite matrix

  [[nodiscard]] std::size_t dimension() const noexcept { return centre.size(); }
  [[nodiscard]] std::size_t size() const noexcept { return weights.size(); }
  bool operator==(const GaussianMixture&) const = default;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("centre", self.centre);
    visit("scale", self.scale);
    visit("weights", self.weights);
    visit("means", self.means);
    visit("covariances", self.covariances);
  }
};

/// @throws Error that names the component and what is wrong with it: no component, more than
/// `kMaxMixtureQuantities` quantities, a shape that disagrees, a value that is not finite, a weight that is not positive (or weights whose sum is
/// not 1), a covariance that is not symmetric or not positive definite.
void check(const GaussianMixture& mixture, const std::string& place = "mixture");

}  // namespace torsio
