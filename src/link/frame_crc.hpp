#pragma once

#include <cstddef>
#include <cstdint>

namespace torsio::detail {

inline constexpr std::size_t kCrcBlock = 16;

/// As `ndlcom_crc`, without a rest of single bytes: before the first byte there are 15 zeros. They do not change the CRC
/// that starts with 0, and the effect of the start with FFFF depends on the size only.
/// @param size at most `kNdlcomMaxDecodedBytes`
[[nodiscard]] std::uint16_t frame_crc(const std::uint8_t* frame, std::size_t size) noexcept;

}  // namespace torsio::detail
