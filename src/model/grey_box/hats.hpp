#pragma once

#include <cstddef>
#include <span>

#include "core/cells.hpp"
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

/// @param knots, near as `cell_of`
template <class Number>
[[nodiscard]] HatCell<Number> hat_cell(std::span<const double> knots, Number x,
                                       std::size_t near = 0) noexcept {
  const std::size_t left = cell_of(knots, value_of(x), near);
  return {.left = left, .share = (x - knots[left]) / (knots[left + 1] - knots[left])};
}

/// The same, held beyond the ends. @param knots ascending; one: a hat that is 1 everywhere
template <class Number>
[[nodiscard]] HatCell<Number> held_hat_cell(std::span<const double> knots, Number x,
                                            std::size_t near = 0) noexcept {
  if (knots.size() < 2) return {};
  HatCell<Number> cell = hat_cell(knots, x, near);
  cell.share = limited(cell.share, 0.0, 1.0);
  return cell;
}

/// Calls term(column, value) for both hats of a cell, times `factor`; or term.hats(column, share, factor) once, where
/// the term has that.
/// @param column of the left hat
template <class Number, class Factor, class Term>
void visit_hats(Term& term, std::size_t column, const Number& share,
                const Factor& factor) noexcept {
  if constexpr (requires { term.hats(column, share, factor); }) {
    term.hats(column, share, factor);
  } else {
    term(column, (1.0 - share) * factor);
    term(column + 1, share * factor);
  }
}

}  // namespace torsio::detail
