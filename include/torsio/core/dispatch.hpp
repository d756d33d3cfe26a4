#pragma once

#include <cstddef>
#include <type_traits>
#include <variant>

namespace torsio::detail {

/// Calls `visit(alternative)` and returns its result: std::visit without the exception for a
/// variant without a value. No variant of torsio gets into this state: only a failed assignment
/// leads to it, and these assignments cannot fail.
template <std::size_t Index = 0, class Variant, class Visit>
decltype(auto) dispatch(Variant& variant, const Visit& visit) noexcept {
  if constexpr (Index + 1 < std::variant_size_v<std::remove_const_t<Variant>>) {
    if (variant.index() != Index) return dispatch<Index + 1>(variant, visit);
  }
  return visit(*std::get_if<Index>(&variant));
}

}  // namespace torsio::detail
