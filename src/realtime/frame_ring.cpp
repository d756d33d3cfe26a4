#include "realtime/frame_ring.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace torsio {

FrameRing::FrameRing(std::size_t channels, std::size_t frames)
    : channels_(channels),
      mask_(std::bit_ceil(frames) - 1),
      stamps_(mask_ + 1),
      values_((mask_ + 1) * channels),
      last_tick_(std::numeric_limits<std::int64_t>::min()) {}

bool FrameRing::push(std::int64_t tick, std::span<const double> values) noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  if (head - tail_seen_ > mask_) tail_seen_ = tail_.load(std::memory_order_acquire);
  const std::uint64_t dropped = dropped_.load(std::memory_order_relaxed);
  if (head - tail_seen_ > mask_ || values.size() != channels_ || tick <= last_tick_) {
    dropped_.store(dropped + 1, std::memory_order_relaxed);  // this thread alone writes it
    return false;
  }
  const std::size_t slot = head & mask_;
  stamps_[slot] = {.tick = tick, .dropped = dropped};
  std::ranges::copy(values, values_.data() + slot * channels_);
  last_tick_ = tick;
  head_.store(head + 1, std::memory_order_release);
  return true;
}

void FrameRing::drain(FrameBlock& block, std::size_t most) {
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  for (; tail != head && block.ticks.size() < most; ++tail) {
    const std::size_t slot = tail & mask_;
    block.ticks.push_back(stamps_[slot].tick);
    block.dropped = stamps_[slot].dropped;
    const auto values = std::span(values_).subspan(slot * channels_, channels_);
    block.values.insert(block.values.end(), values.begin(), values.end());
  }
  tail_.store(tail, std::memory_order_release);
}

}  // namespace torsio
