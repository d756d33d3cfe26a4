#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace torsio::detail {

/// @returns the place of the cell's left knot; the first and the last cell have no end outside
/// @param knots ascending, at least 2
/// @param near the cell to look at first: that of the last step saves nearly every search
[[nodiscard]] inline std::size_t cell_of(std::span<const double> knots, double x,
                                         std::size_t near) noexcept {
  const bool is_near =
      (near == 0 || knots[near] <= x) && (near + 2 == knots.size() || x < knots[near + 1]);
  if (is_near) return near;
  const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, x);
  return static_cast<std::size_t>(above - knots.begin()) - 1;
}

}  // namespace torsio::detail
