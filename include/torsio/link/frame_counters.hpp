#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The counters of one sender of NDLCom frames: one per receiver, the broadcast has its own. Each starts at 0 and wraps
/// after 255.
class SentFrames {
 public:
  [[nodiscard]] std::uint8_t next(std::uint8_t receiver) noexcept TORSIO_REALTIME {
    return next_[receiver]++;
  }

 private:
  std::array<std::uint8_t, 256> next_ = {};
};

/// Lost frames, from the 8-bit counters of NDLCom: per pair of sender and receiver, since a sender has one counter per
/// receiver. Of 256 frames lost in a row it finds none: a counter of 8 bits is evidence for the quality of a line, never
/// for the order or the age of a command.
class ReceivedFrames {
 public:
  static constexpr std::size_t kPairs = 64;

  struct Pair {
    std::uint64_t received = 0;
    std::uint64_t lost =
        0;  ///< counters that were passed over; a frame that arrives late is one, too
    std::uint64_t repeated = 0;  ///< the counter of the frame before
    std::uint64_t late = 0;      ///< a counter before the last one
    std::uint64_t restarts =
        0;  ///< two consecutive counters before the last one: the sender has started again
  };

  /// A frame that was accepted.
  void add(std::uint8_t sender, std::uint8_t receiver,
           std::uint8_t counter) noexcept TORSIO_REALTIME;

  /// @returns zeros for a pair without frames
  [[nodiscard]] Pair pair(std::uint8_t sender, std::uint8_t receiver) const noexcept;
  /// The sum over all pairs.
  [[nodiscard]] Pair total() const noexcept;
  [[nodiscard]] std::uint64_t untracked() const noexcept {
    return untracked_;
  }  ///< frames of pairs after the first 64

 private:
  struct Entry {
    std::uint16_t key = 0;
    std::uint8_t last = 0;
    std::uint8_t last_late = 0;
    bool has_late = false;
    Pair pair = {};
  };
  [[nodiscard]] const Entry* find(std::uint16_t key) const noexcept;

  std::array<Entry, kPairs> entries_ = {};
  std::size_t count_ = 0;
  std::uint64_t untracked_ = 0;
};

}  // namespace torsio
