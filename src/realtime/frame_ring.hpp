#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// Frames that belong together, as a recording keeps them: one row of values to each tick.
struct FrameBlock {
  std::vector<std::int64_t> ticks;
  std::vector<double> values;  ///< row-major: ticks.size() rows of one value per channel
  std::uint64_t dropped = 0;   ///< frames lost since the start, up to the last one in here

  void clear() noexcept {
    ticks.clear();
    values.clear();
  }
};

/// Frames on their way from one thread to one other: a lock-free ring of fixed size. Both ends are
/// wait-free; a full ring drops the new frame and counts it.
class FrameRing {
 public:
  /// @param frames how many it holds, rounded up to a power of two
  FrameRing(std::size_t channels, std::size_t frames);

  /// By the one thread that fills it. False, and counted as dropped: the ring is full, there is not
  /// one value for each channel, or the tick is not after the one before.
  bool push(std::int64_t tick, std::span<const double> values) noexcept TORSIO_REALTIME;
  /// By the one thread that empties it: appends frames until the block holds `most` of them.
  void drain(FrameBlock& block, std::size_t most);

  [[nodiscard]] std::size_t channels() const noexcept { return channels_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return mask_ + 1; }
  /// Frames dropped so far; by any thread.
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::size_t kCacheLine = 64;

  struct Stamp {
    std::int64_t tick = 0;
    std::uint64_t dropped = 0;  ///< before this frame
  };

  std::size_t channels_;
  std::size_t mask_;
  std::vector<Stamp> stamps_;
  std::vector<double> values_;
  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};  ///< frames ever inserted
  std::uint64_t tail_seen_ = 0;                             ///< by the filling thread
  std::int64_t last_tick_;
  std::atomic<std::uint64_t> dropped_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> tail_{0};  ///< frames that were ever taken out
};

}  // namespace torsio
