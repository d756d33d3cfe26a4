#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>

#include "realtime/frame_ring.hpp"
#include "rows.hpp"
#include "torsio/realtime/mailbox.hpp"

namespace torsio::bench {
namespace {

constexpr std::int64_t kTimes = 2048;

}  // namespace

/// Set-point, stiffness, damping and feed-forward of a joint: each read finds a new value, whose
/// writing is timed with it.
Row mailbox_read() {
  Mailbox<std::array<double, 4>> mailbox;
  double sum = 0.0;
  const double seconds = best_seconds([&] {
    for (std::int64_t n = 0; n < kTimes; ++n) {
      mailbox.write({static_cast<double>(n), 1.0, 2.0, 3.0}, n);
      sum += mailbox.read().value[0];
    }
  });
  return {.value = sum > 0.0 ? 1e9 * seconds / kTimes : 0.0, .unit = "ns"};
}

/// A frame of twenty channels, as of a joint's loop, into the recorder's ring; read
/// again outside of the measured time, so that none is dropped.
Row recorder_push() {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t kChannels = 20;
  constexpr int kRuns = 300;
  FrameRing ring(kChannels, kTimes);
  FrameBlock block;
  std::array<double, kChannels> frame{};
  double best = 1.0;
  std::int64_t tick = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto start = Clock::now();
    for (std::int64_t n = 0; n < kTimes; ++n) {
      frame[0] = static_cast<double>(n);
      ring.push(tick++, frame);
    }
    best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
    block.clear();
    ring.drain(block, kTimes);
  }
  const bool has_all = ring.dropped() == 0 && block.ticks.size() == kTimes;
  return {.value = has_all ? 1e9 * best / kTimes : 0.0, .unit = "ns"};
}

}  // namespace torsio::bench
