#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace torsio {

/// With small letters in the place of ASCII capitals.
[[nodiscard]] inline std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

}  // namespace torsio
