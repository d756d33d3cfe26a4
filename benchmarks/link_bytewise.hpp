#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "torsio/link/ndlcom_frame.hpp"

// The frames of NDLCom byte by byte, with one table of the CRC: the baseline of `link_encode` and `link_decode`.

namespace torsio::bench {

constexpr std::array<std::uint16_t, 256> bytewise_crc_table() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t byte = 0; byte < table.size(); ++byte) {
    auto crc = static_cast<std::uint16_t>(byte);
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc >> 1U) ^ ((crc & 1U) != 0 ? 0x8408U : 0U));
    table[byte] = crc;
  }
  return table;
}
inline constexpr std::array<std::uint16_t, 256> kBytewiseCrcTable = bytewise_crc_table();

inline std::uint16_t bytewise_crc(std::uint16_t crc, std::uint8_t byte) noexcept {
  return static_cast<std::uint16_t>((crc >> 8U) ^ kBytewiseCrcTable[(crc ^ byte) & 0xFFU]);
}

/// As `encode_ndlcom`; `out` has space for the longest frame.
inline std::size_t encode_bytewise(const NdlcomFrame& frame, std::span<std::uint8_t> out) noexcept {
  std::uint8_t* to = out.data();
  const auto put = [&to](std::uint8_t byte) {
    if (byte == 0x7E || byte == 0x7D) {
      *to++ = 0x7D;
      byte ^= 0x20;
    }
    *to++ = byte;
  };
  std::uint16_t crc = 0xFFFF;
  const auto put_counted = [&](std::uint8_t byte) {
    crc = bytewise_crc(crc, byte);
    put(byte);
  };
  *to++ = 0x7E;
  put_counted(frame.receiver);
  put_counted(frame.sender);
  put_counted(frame.counter);
  put_counted(static_cast<std::uint8_t>(frame.payload.size()));
  for (const std::uint8_t byte : frame.payload) put_counted(byte);
  put(static_cast<std::uint8_t>(crc & 0xFFU));
  put(static_cast<std::uint8_t>(crc >> 8U));
  *to++ = 0x7E;
  return static_cast<std::size_t>(to - out.data());
}

/// As `NdlcomDecoder` with the strict rules.
class BytewiseDecoder {
 public:
  std::optional<NdlcomFrame> next(std::span<const std::uint8_t>& bytes) noexcept {
    std::size_t taken = 0;
    while (taken < bytes.size()) {
      std::uint8_t byte = bytes[taken++];
      if (byte == 0x7E) {
        const bool is_frame =
            is_inside_ && !is_escaped_ && size_ >= 6 && size_ == buffer_[3] + 6U && crc_ == 0;
        is_inside_ = true;
        is_escaped_ = false;
        size_ = 0;
        crc_ = 0xFFFF;
        if (!is_frame) continue;
        bytes = bytes.subspan(taken);
        return NdlcomFrame{.receiver = buffer_[0],
                           .sender = buffer_[1],
                           .counter = buffer_[2],
                           .payload = std::span(buffer_).subspan(4, buffer_[3])};
      }
      if (!is_inside_) continue;
      if (byte == 0x7D && !is_escaped_) {
        is_escaped_ = true;
        continue;
      }
      if (is_escaped_) {
        byte ^= 0x20;
        is_escaped_ = false;
        is_inside_ = byte == 0x7E || byte == 0x7D;
      }
      if (size_ == buffer_.size()) {
        is_inside_ = false;
        continue;
      }
      crc_ = bytewise_crc(crc_, byte);
      buffer_[size_++] = byte;
    }
    bytes = {};
    return std::nullopt;
  }

 private:
  std::array<std::uint8_t, kNdlcomMaxDecodedBytes> buffer_ = {};
  std::size_t size_ = 0;
  std::uint16_t crc_ = 0xFFFF;
  bool is_inside_ = false;
  bool is_escaped_ = false;
};

}  // namespace torsio::bench
