#pragma once

#include <cstdint>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The clock of a loop. A test replaces it by a simulated one.
class LoopClock {
 public:
  LoopClock() = default;
  virtual ~LoopClock() = default;
  LoopClock(const LoopClock&) = delete;
  LoopClock& operator=(const LoopClock&) = delete;

  /// Never runs backwards, even if the time of day is changed.
  [[nodiscard]] virtual std::int64_t now_ns() noexcept TORSIO_REALTIME = 0;
  /// Waits until that point of `now_ns()`; returns at once if it has passed.
  virtual void sleep_until(std::int64_t point_ns) noexcept = 0;
  /// CPU time that the calling thread has used.
  [[nodiscard]] virtual std::int64_t cpu_ns() noexcept TORSIO_REALTIME = 0;
};

/// CLOCK_MONOTONIC with sleep to absolute times: a late wake-up does not delay the next one.
class MonotonicClock final : public LoopClock {
 public:
  [[nodiscard]] std::int64_t now_ns() noexcept override;
  void sleep_until(std::int64_t point_ns) noexcept override;
  [[nodiscard]] std::int64_t cpu_ns() noexcept override;
};

}  // namespace torsio
