#pragma once

#include <algorithm>
#include <span>

#include "torsio/model/common/model.hpp"

namespace torsio {

/// The output of a driven mass with state {position, speed, ...}: the position or, beyond the
/// range, the end of the range, where the mass then stops.
inline Estimate bounded_position(std::span<double> state, double lowest, double highest) noexcept {
  if (state[0] >= lowest && state[0] <= highest) return {.value = state[0]};
  state[0] = std::clamp(state[0], lowest, highest);
  state[1] = 0.0;
  return {.value = state[0], .fault = Fault::diverged};
}

}  // namespace torsio
