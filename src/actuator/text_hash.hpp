#pragma once

#include <cstdint>
#include <string_view>

namespace torsio {

/// FNV-1a: the same on every platform, which std::hash is not.
constexpr std::uint64_t text_hash(std::string_view text) noexcept {
  std::uint64_t value = 0xcbf29ce484222325U;
  for (const char letter : text) {
    value ^= static_cast<unsigned char>(letter);
    value *= 0x100000001b3U;
  }
  return value;
}

}  // namespace torsio
