#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

namespace torsio {

inline bool all_finite(std::span<const double> values) noexcept {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

/// Finite, each number above the one before.
inline bool all_ascending(std::span<const double> values) noexcept {
  return all_finite(values) &&
         std::ranges::adjacent_find(values, std::greater_equal<>()) == values.end();
}

/// Finite, each number above 0.
inline bool all_positive(std::span<const double> values) noexcept {
  return all_finite(values) &&
         std::ranges::all_of(values, [](double value) { return value > 0.0; });
}

}  // namespace torsio
