#include <array>
#include <bit>
#include <cstring>

#include "link/copy_plain.hpp"
#include "link/frame_crc.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {
namespace {

using detail::kEscape;
using detail::kEscapeBit;
using detail::kFlag;
using detail::kPlainBlock;

/// A frame with its CRC; zeros before it for the CRC, and space after it for the last block.
using FlatFrame =
    std::array<std::uint8_t, detail::kCrcBlock + kNdlcomMaxDecodedBytes + kPlainBlock>;

/// `std::memcpy` with a size that is not known costs a call, and a branch that cannot be predicted.
void copy_payload(std::span<const std::uint8_t> from, std::uint8_t* to) noexcept {
  const std::size_t size = from.size();
  if (size < kPlainBlock) {
    for (std::size_t k = 0; k < size; ++k) to[k] = from[k];
    return;
  }
  for (std::size_t k = 0; k + kPlainBlock < size; k += kPlainBlock)
    std::memcpy(to + k, from.data() + k, kPlainBlock);
  std::memcpy(to + size - kPlainBlock, from.data() + size - kPlainBlock, kPlainBlock);
}

/// Without a branch. Writes up to two bytes.
std::uint8_t* put_escaped(std::uint8_t byte, std::uint8_t* to) noexcept {
  const auto is_special = static_cast<std::uint8_t>(byte == kFlag || byte == kEscape);
  *to = kEscape;
  to += is_special;
  *to = static_cast<std::uint8_t>(byte ^ (is_special * kEscapeBit));
  return to + 1;
}

/// After `from` there are 16 zeros, and `to` has space for two bytes per byte and 16 more.
std::uint8_t* put_all_escaped(std::span<const std::uint8_t> from, std::uint8_t* to) noexcept {
  const std::uint8_t* at = from.data();
  const std::uint8_t* const end = at + from.size();
  while (at < end) {
    const unsigned mask = detail::copy_block(at, to);
    const auto left = static_cast<std::size_t>(end - at);
    const std::size_t size = left < kPlainBlock ? left : kPlainBlock;
    if (mask == 0) {
      at += size;
      to += size;
    } else if ((mask & (mask - 1U)) == 0) {  // one: the usual case
      const std::size_t plain = detail::first_of(mask);
      to[plain] = kEscape;
      std::memcpy(to + plain + 1, at + plain, kPlainBlock);
      to[plain + 1] ^= kEscapeBit;
      at += size;
      to += size + 1;
    } else {
      for (std::size_t k = 0; k < size; ++k) to = put_escaped(at[k], to);
      at += size;
    }
  }
  return to;
}

/// @returns the end, in an `out` of `kNdlcomMaxEncodedBytes` and a block
std::uint8_t* put_frame(const NdlcomFrame& frame, std::uint8_t* out) noexcept {
  FlatFrame flat;
  std::uint8_t* const begin = flat.data() + detail::kCrcBlock;
  std::memset(flat.data(), 0, detail::kCrcBlock);
  begin[0] = frame.receiver;
  begin[1] = frame.sender;
  begin[2] = frame.counter;
  begin[3] = static_cast<std::uint8_t>(frame.payload.size());
  copy_payload(frame.payload, begin + kNdlcomHeaderBytes);
  const std::size_t size = kNdlcomHeaderBytes + frame.payload.size();
  const std::uint16_t crc = detail::frame_crc(begin, size);
  std::memcpy(begin + size, &crc, sizeof(crc));
  std::memset(begin + size + sizeof(crc), 0, kPlainBlock);
  *out++ = kFlag;
  out = put_all_escaped({begin, size + sizeof(crc)}, out);
  *out++ = kFlag;
  return out;
}

}  // namespace

std::size_t encode_ndlcom(const NdlcomFrame& frame, std::span<std::uint8_t> out) noexcept {
  if (frame.payload.size() > kNdlcomMaxPayloadBytes) return 0;
  // Blocks are stored whole: 16 bytes and an escape after the last byte.
  constexpr std::size_t kStored = kNdlcomMaxEncodedBytes + kPlainBlock + 1;
  if (out.size() >= 2 * (frame.payload.size() + kNdlcomHeaderBytes + 2) + 2 + kPlainBlock + 1)
    return static_cast<std::size_t>(put_frame(frame, out.data()) - out.data());
  std::array<std::uint8_t, kStored> buffer;
  const auto size = static_cast<std::size_t>(put_frame(frame, buffer.data()) - buffer.data());
  if (size > out.size()) return 0;
  std::memcpy(out.data(), buffer.data(), size);
  return size;
}

}  // namespace torsio
