#include "parts/maxwell_slip.hpp"

#include <cmath>
#include <numeric>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "Maxwell-slip bank";

}  // namespace

template <std::size_t Count>
MaxwellSlip<Count>::MaxwellSlip(const Parameters& parameters)
    : parameters_(parameters), total_limit_Nm_(parameters.constant_Nm) {
  require_not_negative(kPlace, "constant_Nm", parameters.constant_Nm);
  require_not_negative(kPlace, "load_factor", parameters.load_factor);
  for (std::size_t i = 0; i < Count; ++i) {
    require_not_negative(kPlace, "share", parameters.share[i]);
    require_positive(kPlace, "break_away_rad", parameters.break_away_rad[i]);
    share_per_rad_[i] = parameters.share[i] / parameters.break_away_rad[i];
  }
}

template <std::size_t Count>
double MaxwellSlip<Count>::stiffness(double load_Nm) const noexcept {
  const double limit = parameters_.constant_Nm + parameters_.load_factor * std::abs(load_Nm);
  return limit * std::accumulate(share_per_rad_.begin(), share_per_rad_.end(), 0.0);
}

template class MaxwellSlip<1>;
template class MaxwellSlip<3>;
template class MaxwellSlip<4>;

}  // namespace torsio
