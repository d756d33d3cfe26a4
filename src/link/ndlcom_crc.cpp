#include <array>
#include <cstring>

#include "link/frame_crc.hpp"
#include "torsio/link/ndlcom_frame.hpp"

#if defined(__x86_64__) && !defined(TORSIO_LINK_PORTABLE)
#include <immintrin.h>
#define TORSIO_LINK_CLMUL
#endif

namespace torsio {
namespace {

using detail::kCrcBlock;

constexpr std::uint16_t kReflectedPolynomial = 0x8408;

using CrcTables = std::array<std::array<std::uint16_t, 256>, kCrcBlock>;

/// Table s has the CRC of a byte followed by s zeros.
constexpr CrcTables crc_tables() {
  CrcTables tables{};
  for (std::size_t byte = 0; byte < 256; ++byte) {
    auto crc = static_cast<std::uint16_t>(byte);
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc >> 1U) ^ ((crc & 1U) != 0 ? kReflectedPolynomial : 0U));
    tables[0][byte] = crc;
  }
  for (std::size_t slice = 1; slice < kCrcBlock; ++slice)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint16_t crc = tables[slice - 1][byte];
      tables[slice][byte] = static_cast<std::uint16_t>((crc >> 8U) ^ tables[0][crc & 0xFFU]);
    }
  return tables;
}

alignas(64) constexpr CrcTables kCrcTables = crc_tables();

using StartEffects = std::array<std::uint16_t, kNdlcomMaxDecodedBytes + 1>;

/// What a start with FFFF instead of 0 changes, by the number of bytes.
constexpr StartEffects start_effects() {
  StartEffects effects{};
  std::uint16_t crc = 0xFFFF;
  for (std::uint16_t& effect : effects) {
    effect = crc;
    crc = static_cast<std::uint16_t>((crc >> 8U) ^ kCrcTables[0][crc & 0xFFU]);
  }
  return effects;
}

constexpr StartEffects kStartEffects = start_effects();

/// Eight of the sixteen tables: those of `first` - 7 to `first`.
std::uint32_t eight_bytes(std::uint64_t word, std::size_t first) noexcept {
  const CrcTables& t = kCrcTables;
  return static_cast<std::uint32_t>(
      t[first][word & 0xFFU] ^ t[first - 1][(word >> 8U) & 0xFFU] ^
      t[first - 2][(word >> 16U) & 0xFFU] ^ t[first - 3][(word >> 24U) & 0xFFU] ^
      t[first - 4][(word >> 32U) & 0xFFU] ^ t[first - 5][(word >> 40U) & 0xFFU] ^
      t[first - 6][(word >> 48U) & 0xFFU] ^ t[first - 7][word >> 56U]);
}

std::uint32_t crc_of_blocks(const std::uint8_t* at, std::size_t blocks,
                            std::uint32_t crc) noexcept {
  for (; blocks > 0; --blocks, at += kCrcBlock) {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    std::memcpy(&low, at, sizeof(low));
    std::memcpy(&high, at + sizeof(low), sizeof(high));
    // Only the first two bytes meet the CRC so far.
    crc = eight_bytes(high, 7) ^ eight_bytes(low ^ crc, 15);
  }
  return crc;
}

#if defined(TORSIO_LINK_CLMUL)

/// x^exponent modulo the polynomial, as a word of 64 reflected coefficients: that of x^63 in bit 0.
constexpr std::uint64_t reflected_power(unsigned exponent) {
  std::uint32_t rest = 1;
  for (unsigned n = 0; n < exponent; ++n) {
    rest <<= 1U;
    if ((rest & 0x10000U) != 0) rest ^= 0x11021U;
  }
  std::uint64_t word = 0;
  for (unsigned degree = 0; degree < 16; ++degree)
    if ((rest >> degree & 1U) != 0) word |= std::uint64_t{1} << (63U - degree);
  return word;
}

/// Products without carries reduce the blocks to one that has the same CRC: a block A x^64 + B before another one counts
/// x^128 times, and A x^192 + B x^128 = A (x^191 mod P) x + B (x^127 mod P) x modulo P, with the x that the product of two
/// reflected words adds. Source: Gopal et al., Fast CRC computation using PCLMULQDQ (Intel, 2009).
__attribute__((target("pclmul,sse2"))) std::uint32_t folded_crc(const std::uint8_t* at,
                                                                std::size_t blocks) noexcept {
  constexpr std::uint64_t kFirst = reflected_power(191);
  constexpr std::uint64_t kSecond = reflected_power(127);
  const __m128i factors =
      _mm_set_epi64x(static_cast<long long>(kSecond), static_cast<long long>(kFirst));
  __m128i sum = _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
  for (; blocks > 1; --blocks) {
    at += kCrcBlock;
    const __m128i next = _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
    const __m128i low = _mm_clmulepi64_si128(sum, factors, 0x00);
    const __m128i high = _mm_clmulepi64_si128(sum, factors, 0x11);
    sum = _mm_xor_si128(_mm_xor_si128(low, next), high);
  }
  std::array<std::uint8_t, kCrcBlock> rest;
  _mm_storeu_si128(reinterpret_cast<__m128i*>(rest.data()), sum);
  return crc_of_blocks(rest.data(), 1, 0);
}

const auto kHasClmul = static_cast<bool>(__builtin_cpu_supports("pclmul"));

#endif

std::uint32_t crc_from_zero(const std::uint8_t* at, std::size_t blocks) noexcept {
#if defined(TORSIO_LINK_CLMUL)
  if (kHasClmul && blocks > 1) return folded_crc(at, blocks);
#endif
  return crc_of_blocks(at, blocks, 0);
}

}  // namespace

std::uint16_t ndlcom_crc(std::span<const std::uint8_t> bytes, std::uint16_t before) noexcept {
  const std::size_t blocks = bytes.size() / kCrcBlock;
  std::uint32_t crc = crc_of_blocks(bytes.data(), blocks, before);
  for (const std::uint8_t byte : bytes.subspan(blocks * kCrcBlock))
    crc = (crc >> 8U) ^ kCrcTables[0][(crc ^ byte) & 0xFFU];
  return static_cast<std::uint16_t>(crc);
}

std::uint16_t detail::frame_crc(const std::uint8_t* frame, std::size_t size) noexcept {
  const std::size_t blocks = (size + kCrcBlock - 1) / kCrcBlock;
  const std::uint32_t crc = crc_from_zero(frame + size - blocks * kCrcBlock, blocks);
  return static_cast<std::uint16_t>(crc ^ kStartEffects[size]);
}

}  // namespace torsio
