#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__) && !defined(TORSIO_LINK_PORTABLE)
#include <emmintrin.h>
#define TORSIO_LINK_SSE2
#endif

// The bytes 7E and 7D of NDLCom are searched while 16 bytes are copied.

namespace torsio::detail {

inline constexpr std::uint8_t kFlag = 0x7E;
inline constexpr std::uint8_t kEscape = 0x7D;
inline constexpr std::uint8_t kEscapeBit = 0x20;
inline constexpr std::size_t kPlainBlock = 16;

static_assert(std::endian::native == std::endian::little, "the first byte of a word is its lowest");

/// Bit n is set if byte n of eight is 7E or 7D. Carries cannot pass from byte to byte.
inline unsigned special_of_8(const std::uint8_t* from) noexcept {
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  constexpr std::uint64_t kLow7 = 0x7F * kOnes;
  std::uint64_t word = 0;
  std::memcpy(&word, from, sizeof(word));
  const std::uint64_t flag = word ^ (kOnes * kFlag);
  const std::uint64_t escape = word ^ (kOnes * kEscape);
  const std::uint64_t is_other =
      (((flag & kLow7) + kLow7) | flag) & (((escape & kLow7) + kLow7) | escape);
  // One bit per byte, collected in the highest byte by a product.
  const std::uint64_t is_special = (~is_other >> 7U) & kOnes;
  return static_cast<unsigned>((is_special * 0x0102040810204080U) >> 56U);
}

/// Copies 16 bytes. @returns a mask with bit n set if byte n is 7E or 7D
inline unsigned copy_block_portable(const std::uint8_t* from, std::uint8_t* to) noexcept {
  const unsigned mask = special_of_8(from) | special_of_8(from + 8) << 8U;
  std::memcpy(to, from, kPlainBlock);
  return mask;
}

#if defined(TORSIO_LINK_SSE2)
/// As `copy_block_portable`.
inline unsigned copy_block(const std::uint8_t* from, std::uint8_t* to) noexcept {
  const __m128i block = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), block);
  const __m128i found =
      _mm_or_si128(_mm_cmpeq_epi8(block, _mm_set1_epi8(static_cast<char>(kFlag))),
                   _mm_cmpeq_epi8(block, _mm_set1_epi8(static_cast<char>(kEscape))));
  return static_cast<unsigned>(_mm_movemask_epi8(found));
}
#else
inline unsigned copy_block(const std::uint8_t* from, std::uint8_t* to) noexcept {
  return copy_block_portable(from, to);
}
#endif

/// The place of the lowest bit of a mask of `copy_block`; 16 without one.
inline std::size_t first_of(unsigned mask) noexcept {
  return static_cast<std::size_t>(std::countr_zero(mask | 1U << kPlainBlock));
}

}  // namespace torsio::detail
