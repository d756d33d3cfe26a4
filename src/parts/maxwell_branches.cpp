#include "parts/maxwell_branches.hpp"

#include <cmath>
#include <numeric>

#include "core/checks.hpp"

namespace torsio {

double mean_decay(double a) noexcept { return a > 0.0 ? -std::expm1(-a) / a : 1.0; }

template <std::size_t Count>
MaxwellBranches<Count>::MaxwellBranches(const Parameters& parameters) : parameters_(parameters) {
  for (std::size_t i = 0; i < Count; ++i) {
    require_not_negative("Maxwell branches", "stiffness_Nm_rad", parameters.stiffness_Nm_rad[i]);
    require_positive("Maxwell branches", "relaxation_s", parameters.relaxation_s[i]);
  }
  set_period(0.0);
}

template <std::size_t Count>
void MaxwellBranches<Count>::set_period(double dt_s) noexcept {
  for (std::size_t i = 0; i < Count; ++i) {
    const double a = dt_s / parameters_.relaxation_s[i];
    decay_[i] = std::exp(-a);
    gain_Nm_rad_[i] = parameters_.stiffness_Nm_rad[i] * mean_decay(a);
  }
}

template <std::size_t Count>
double MaxwellBranches<Count>::energy() const noexcept {
  double sum_J = 0.0;
  for (std::size_t i = 0; i < Count; ++i) {
    const double stiffness = parameters_.stiffness_Nm_rad[i];
    if (stiffness > 0.0) sum_J += 0.5 * force_Nm_[i] * force_Nm_[i] / stiffness;
  }
  return sum_J;
}

template <std::size_t Count>
double MaxwellBranches<Count>::stiffness() const noexcept {
  const auto& each = parameters_.stiffness_Nm_rad;
  return std::accumulate(each.begin(), each.end(), 0.0);
}

template class MaxwellBranches<3>;

}  // namespace torsio
