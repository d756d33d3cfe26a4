#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace torsio::detail {

/// Absolute difference of two stamps of one clock, without overflow. Never negative.
[[nodiscard]] constexpr std::int64_t distance_ns(std::int64_t a_ns, std::int64_t b_ns) noexcept {
  const auto later = static_cast<std::uint64_t>(std::max(a_ns, b_ns));
  const auto earlier = static_cast<std::uint64_t>(std::min(a_ns, b_ns));
  constexpr auto kLargest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  return static_cast<std::int64_t>(std::min(later - earlier, kLargest));
}

}  // namespace torsio::detail
