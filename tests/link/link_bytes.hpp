#pragma once

#include <array>
#include <cstdint>
#include <ostream>
#include <span>
#include <vector>

#include "torsio/link/ndlcom_frame.hpp"

namespace torsio::test {

using LinkBytes = std::vector<std::uint8_t>;

/// A frame that owns its payload.
struct StoredFrame {
  std::uint8_t receiver = 0;
  std::uint8_t sender = 0;
  std::uint8_t counter = 0;
  LinkBytes payload = {};

  bool operator==(const StoredFrame&) const = default;
  friend std::ostream& operator<<(std::ostream& out, const StoredFrame& frame) {
    return out << int{frame.receiver} << " <- " << int{frame.sender} << " #" << int{frame.counter}
               << ", " << frame.payload.size() << " bytes";
  }
};

inline LinkBytes encoded(const StoredFrame& frame) {
  LinkBytes out(kNdlcomMaxEncodedBytes);
  out.resize(encode_ndlcom({.receiver = frame.receiver,
                            .sender = frame.sender,
                            .counter = frame.counter,
                            .payload = frame.payload},
                           out));
  return out;
}

inline std::vector<StoredFrame> decoded(NdlcomDecoder& decoder,
                                        std::span<const std::uint8_t> bytes) {
  std::vector<StoredFrame> frames;
  while (const auto frame = decoder.next(bytes))
    frames.push_back({frame->receiver, frame->sender, frame->counter,
                      LinkBytes(frame->payload.begin(), frame->payload.end())});
  return frames;
}

}  // namespace torsio::test
