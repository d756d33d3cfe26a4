#pragma once

#include <algorithm>
#include <cmath>
#include <span>

namespace torsio {

inline bool all_finite(std::span<const double> values) noexcept {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace torsio
