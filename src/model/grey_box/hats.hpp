#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "model/grey_box/sloped.hpp"

namespace torsio::detail {

/// Between which knots a value lies, and how far it is on its way to the right one. Hat functions are 1
/// at their knot, 0 at its neighbours' and straight between them: here 1 - share and share.
/// @tparam Number double, or `Sloped`
template <class Number>
struct HatCell {
  std::size_t left = 0;
  Number share{};  ///< below 0 and above 1 beyond the ends
};

/// @param knots ascending, at least 2
template <class Number>
[[nodiscard]] HatCell<Number> hat_cell(std::span<const double> knots, Number x) noexcept {
  const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, value_of(x));
  const auto left = static_cast<std::size_t>(above - knots.begin()) - 1;
  return {.left = left, .share = (x - knots[left]) / (knots[left + 1] - knots[left])};
}

/// The same, held beyond the ends. @param knots ascending; one: a hat that is 1 everywhere
template <class Number>
[[nodiscard]] HatCell<Number> held_hat_cell(std::span<const double> knots, Number x) noexcept {
  if (knots.size() < 2) return {};
  HatCell<Number> cell = hat_cell(knots, x);
  cell.share = limited(cell.share, 0.0, 1.0);
  return cell;
}

}  // namespace torsio::detail
