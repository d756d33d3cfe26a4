#pragma once

#include <array>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <stop_token>
#include <string>
#include <type_traits>
#include <utility>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A histogram of durations in memory of fixed size: 16 buckets for each power of two, so that a
/// quantile is at most 1/16 too large and never too small, from 0 ns to 18 minutes; longer ones are
/// counted in the last bucket, their maximum is in `max_ns`.
class DurationHistogram {
 public:
  /// A negative duration counts as 0.
  void add(std::int64_t duration_ns) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::int64_t max_ns() const noexcept { return max_ns_; }  ///< exact
  /// The smallest bucket end that is not exceeded by at least this part of all durations; 0 if
  /// there are none. @param part in [0, 1], e.g. 0.999
  [[nodiscard]] std::int64_t quantile_ns(double part) const noexcept;

 private:
  static constexpr std::size_t kBuckets = 592;

  static std::size_t bucket_of(std::int64_t duration_ns) noexcept;
  static std::int64_t last_of(std::size_t bucket) noexcept;

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

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

struct LoopOptions {
  double period_s = 1e-3;  ///< from 10 us to 10 s
  /// SCHED_FIFO priority, 1 to 99; 0: the thread is scheduled like any other. Above 50 it has
  /// priority over the interrupt threads of a PREEMPT_RT kernel.
  int priority = 80;
  bool lock_memory = true;  ///< mlockall: the whole process, also after the loop has ended
  int cpu = -1;             ///< the core to stay on; -1: any
  /// Ends the loop after this many overruns in a row; 0: never.
  std::uint64_t stop_after_overruns = 0;
  /// A request above that is not permitted is an Error instead of a remark in the report.
  bool must_be_granted = false;
};

/// The argument of a step.
struct Tick {
  std::int64_t index = 0;        ///< period from 0; jumps where periods were skipped
  std::int64_t due_ns = 0;       ///< when the period began: start + index * period
  std::int64_t lateness_ns = 0;  ///< how long after that the step was called
  std::uint64_t overruns = 0;    ///< so far
};

/// What the operating system granted to the loop.
struct LoopGrants {
  bool fifo = false;
  bool memory_locked = false;
  bool cpu = false;
  std::string refused =
      {};  ///< what was requested and not granted, with the reason; empty: nothing
};

enum class LoopEnd : std::uint8_t {
  step_is_done,    ///< the step returned false
  stop_requested,  ///< `request_stop`, or the token
  overruns,        ///< `stop_after_overruns` in a row
};

/// The report of a loop at its end.
struct LoopReport {
  LoopEnd end = LoopEnd::step_is_done;
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;         ///< steps that ended after the next period had begun
  std::uint64_t skipped_periods = 0;  ///< periods in which no step began, because of them
  DurationHistogram lateness;         ///< from the beginning of the period to the step
  DurationHistogram cpu_time;         ///< each step
  LoopGrants grants;
};

/// A step that cannot throw: `step(tick)` is noexcept and returns whether the loop continues.
template <class Step>
concept LoopStep = requires(Step& step, const Tick& tick) {
  { step(tick) } noexcept -> std::same_as<bool>;
};

/// Calls a step at a fixed rate, on its own thread or on the caller's.
///
/// Period n begins at start + n * period on a monotonic clock. A step that ends after the next
/// period has begun is an overrun: it is counted, and the loop continues with the first period that
/// has not begun yet, so that there is no burst of steps that catch up. Denormal numbers are off
/// while it runs; 256 KiB of stack are touched before.
///
/// The loop neither allocates nor locks nor writes between the first step and the last. It is over
/// after `stop_requested`, `overruns` or the step's own end, and never starts again by itself:
/// bring the drive into its safe state when `run` or `wait` returns.
class RealtimeLoop {
 public:
  /// @param clock for tests; must outlive the loop
  /// @throws UsageError if the options are out of range.
  explicit RealtimeLoop(const LoopOptions& options, LoopClock* clock = nullptr);
  ~RealtimeLoop();  ///< stops and waits
  RealtimeLoop(const RealtimeLoop&) = delete;
  RealtimeLoop& operator=(const RealtimeLoop&) = delete;

  /// On the caller's thread, whose scheduling is as before when it returns.
  /// @throws Error if something is refused that `must_be_granted`.
  template <LoopStep Step>
  LoopReport run(Step&& step, const std::stop_token& stop = {}) {
    using Callee = std::remove_reference_t<Step>;
    return run_steps({.callee = std::addressof(step),
                      .call =
                          [](const void* callee, const Tick& tick) noexcept {
                            return (*static_cast<Callee*>(const_cast<void*>(callee)))(tick);
                          }},
                     stop);
  }

  /// On a thread of its own. @throws Error if one is running already.
  template <LoopStep Step>
  void start(Step step) {
    refuse_to_start_twice();
    running_ = std::async(std::launch::async,
                          [this, own = std::move(step)]() mutable { return run(own); });
  }
  /// Ends the loop of `run` or `start` before its next step: within a period. May be called from
  /// any thread or a signal handler. A request remains active until `run` or `wait` returns: one
  /// that comes before `run` or `start` ends that before its first step.
  void request_stop() noexcept { is_stop_requested_.store(true, std::memory_order_release); }
  /// Waits for the end of what was started. @throws Error as `run`, or if nothing was started.
  LoopReport wait();

 private:
  struct StepCall {
    const void* callee = nullptr;
    bool (*call)(const void* callee, const Tick& tick) noexcept = nullptr;
  };

  LoopReport run_steps(StepCall step, const std::stop_token& stop);
  LoopReport run_until_stopped(StepCall step, const std::stop_token& stop);
  void refuse_to_start_twice() const;

  LoopOptions options_;
  std::int64_t period_ns_ = 0;
  MonotonicClock monotonic_;
  LoopClock* clock_;
  std::atomic<bool> is_stop_requested_{false};
  static_assert(std::atomic<bool>::is_always_lock_free);
  std::future<LoopReport> running_;
};

/// The enumerator's own spelling, for logs.
[[nodiscard]] const char* name(LoopEnd end) noexcept;

}  // namespace torsio
