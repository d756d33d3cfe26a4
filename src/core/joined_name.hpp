#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace torsio {

/// The name of a composition, made while compiling: "narx_" and "linear" are "narx_linear".
template <const std::string_view&... kParts>
class JoinedName {
  static constexpr std::size_t kSize = (kParts.size() + ...);
  static constexpr std::array<char, kSize> kLetters = [] {
    std::array<char, kSize> letters{};
    auto at = letters.begin();
    ((at = std::copy(kParts.begin(), kParts.end(), at)), ...);
    return letters;
  }();

 public:
  static constexpr std::string_view kName{kLetters.data(), kSize};
};

}  // namespace torsio
