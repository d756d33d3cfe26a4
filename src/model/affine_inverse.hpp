#pragma once

#include <cmath>
#include <cstddef>

#include "torsio/model/schedule.hpp"

namespace torsio {

/// x_0 from rest = sum_j c_(first + j) x_j, or the given x_0 with a fault where there is none.
inline Estimate affine_inverse(const ScheduledCoefficients& coefficients,
                               const ScheduledCoefficients::Position& at, std::size_t first,
                               double rest, Features features) noexcept {
  const CoefficientSchedule& schedule = coefficients.schedule();
  const double slope = coefficients.coefficient(at, first);
  const double others = coefficients.weighted_sum(at, first, features) - slope * features[0];
  const double value = (rest - others) / slope;
  if (!std::isfinite(value) || (schedule.scheduled && schedule.feature == 0))
    return {.value = features[0], .fault = Fault::model_not_finite};
  return {.value = value};
}

}  // namespace torsio
