#pragma once

#include <cstdint>
#include <string_view>

namespace torsio {

/// FNV-1a: the same on every platform, which std::hash is not.
class FnvHash {
 public:
  /// A byte; or a whole word, for which one step suffices where only changes of data must show.
  constexpr void add(std::uint64_t word) noexcept { value_ = (value_ ^ word) * 0x100000001b3U; }
  [[nodiscard]] constexpr std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

constexpr std::uint64_t text_hash(std::string_view text) noexcept {
  FnvHash hash;
  for (const char letter : text) hash.add(static_cast<unsigned char>(letter));
  return hash.value();
}

}  // namespace torsio
