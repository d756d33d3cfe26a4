#pragma once

#include <algorithm>
#include <cstdint>

#include "torsio/realtime/realtime_loop.hpp"

namespace torsio::test {

/// A clock that advances only when a thread sleeps, or when the test advances it.
class SimulatedClock final : public LoopClock {
 public:
  [[nodiscard]] std::int64_t now_ns() noexcept override { return now_ns_; }
  void sleep_until(std::int64_t point_ns) noexcept override {
    now_ns_ = std::max(now_ns_, point_ns) + wakes_late_by_ns;
  }
  [[nodiscard]] std::int64_t cpu_ns() noexcept override { return cpu_ns_; }

  /// What a step does that takes this long.
  void pass(std::int64_t duration_ns, std::int64_t of_it_cpu_ns = 0) noexcept {
    now_ns_ += duration_ns;
    cpu_ns_ += of_it_cpu_ns;
  }

  std::int64_t wakes_late_by_ns = 0;

 private:
  std::int64_t now_ns_ = 1'000'000'000;
  std::int64_t cpu_ns_ = 0;
};

}  // namespace torsio::test
