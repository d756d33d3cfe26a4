#pragma once

#include <cstddef>
#include <type_traits>
#include <variant>

namespace torsio::detail {

/// Calls `visit(alternative)` and returns what it returns: std::visit without the exception that it
/// throws for a variant that holds nothing. No variant of torsio is left so: a failed assignment is
/// the only way there, and theirs cannot fail.
template <std::size_t Index = 0, class Variant, class Visit>
decltype(auto) dispatch(Variant& variant, const Visit& visit) noexcept {
  if constexpr (Index + 1 < std::variant_size_v<std::remove_const_t<Variant>>) {
    if (variant.index() != Index) return dispatch<Index + 1>(variant, visit);
  }
  return visit(*std::get_if<Index>(&variant));
}

}  // namespace torsio::detail
