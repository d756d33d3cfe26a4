#pragma once

#include <cstddef>
#include <string>

namespace torsio::detail {

/// The first name of a list that is empty or used twice; none: nullptr.
/// @param name_of the name of an element, by reference
template <class List, class NameOf>
[[nodiscard]] const std::string* first_not_own(const List& list, const NameOf& name_of) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string& name = name_of(list[i]);
    if (name.empty()) return &name;
    for (std::size_t j = 0; j < i; ++j)
      if (name == name_of(list[j])) return &name;
  }
  return nullptr;
}

}  // namespace torsio::detail
