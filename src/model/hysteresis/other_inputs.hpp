#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "model/hysteresis/hysteresis_checks.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// sum_j>0 k_j x_j
inline double other_inputs(std::span<const double> slopes, Features features) noexcept {
  double value = 0.0;
  for (std::size_t j = 1; j < slopes.size(); ++j) value += slopes[j] * features[j];
  return value;
}

/// @throws Error unless there is a finite slope for each input, that of the first one 0.
inline void check_other_inputs(std::span<const double> slopes, std::string_view family) {
  require(!slopes.empty(), {family, "slopes"}, "one for each input", 0.0);
  require_finite(slopes, family, "slopes");
  require(slopes[0] == 0.0, {family, "slope of the first input"}, "0, since other terms hold it",
          slopes[0]);
}

/// How many numbers a fit chose among the slopes.
inline std::size_t non_zero(std::span<const double> values) noexcept {
  std::size_t count = 0;
  for (const double each : values) count += each != 0.0 ? 1 : 0;
  return count;
}

}  // namespace torsio
