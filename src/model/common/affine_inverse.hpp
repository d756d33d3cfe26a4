#pragma once

#include <cmath>
#include <cstddef>

#include "model/common/schedule.hpp"

namespace torsio {

/// x_0 from rest = sum_j c_(first + j) x_j.
inline Estimate affine_inverse(const ScheduledCoefficients& coefficients,
                               const ScheduledCoefficients::Position& at, std::size_t first,
                               double rest, Features features) noexcept {
  const CoefficientSchedule& schedule = coefficients.schedule();
  const double others = coefficients.weighted_sum(at, first, features, 1);
  const double value = (rest - others) / coefficients.coefficient(at, first);
  if (!std::isfinite(value) || (schedule.scheduled && schedule.feature == 0))
    return detail::no_inverse(features);
  return {.value = value};
}

}  // namespace torsio
