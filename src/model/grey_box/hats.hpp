#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace torsio::detail {

/// Between which knots a value lies, and how far it is on its way to the right one. Hat functions are 1
/// at their knot, 0 at its neighbours and straight between them: here 1 - share and share.
struct HatCell {
  std::size_t left = 0;
  double share = 0.0;  ///< below 0 and above 1 beyond the ends
};

/// @param knots ascending, at least 2
[[nodiscard]] inline HatCell hat_cell(std::span<const double> knots, double x) noexcept {
  const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, x);
  const auto left = static_cast<std::size_t>(above - knots.begin()) - 1;
  return {.left = left, .share = (x - knots[left]) / (knots[left + 1] - knots[left])};
}

/// The same, held beyond the ends. @param knots ascending; one: a hat that is 1 everywhere
[[nodiscard]] inline HatCell held_hat_cell(std::span<const double> knots, double x) noexcept {
  if (knots.size() < 2) return {};
  HatCell cell = hat_cell(knots, x);
  cell.share = std::min(std::max(cell.share, 0.0), 1.0);
  return cell;
}

}  // namespace torsio::detail
