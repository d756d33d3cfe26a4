#pragma once

#include <cstddef>
#include <string_view>

namespace torsio {

/// Whether arrays and objects of a JSON text are nested so deeply that code which calls itself for each of them
/// could use up the stack.
[[nodiscard]] inline bool is_nested_too_deeply(std::string_view json) noexcept {
  constexpr std::size_t kDeepest = 64;
  std::size_t depth = 0;
  bool is_in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (is_in_text) {
      if (c == '\\') ++i;
      is_in_text = c != '"';
    } else if (c == '"') {
      is_in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepest) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

}  // namespace torsio
