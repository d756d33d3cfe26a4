#include "torsio/realtime/realtime_loop.hpp"

#include <fmt/format.h>

#include <cmath>

#include "realtime/loop_privileges.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kShortestPeriod_s = 10e-6;
constexpr double kLongestPeriod_s = 10.0;
constexpr int kHighestPriority = 99;

void check(const LoopOptions& options) {
  if (!(options.period_s >= kShortestPeriod_s && options.period_s <= kLongestPeriod_s))
    throw UsageError({.place = "real-time loop: period_s",
                      .expected = "from 1e-5 to 10",
                      .found = fmt::format("{}", options.period_s)});
  if (options.priority < 0 || options.priority > kHighestPriority)
    throw UsageError({.place = "real-time loop: priority",
                      .expected = "from 1 to 99, or 0 for none",
                      .found = fmt::format("{}", options.priority)});
  if (options.cpu < -1 || options.cpu >= CPU_SETSIZE)
    throw UsageError({.place = "real-time loop: cpu",
                      .expected = fmt::format("from 0 to {}, or -1 for any", CPU_SETSIZE - 1),
                      .found = fmt::format("{}", options.cpu)});
}

/// Whole periods from the beginning of this one to the first that has not begun at `now_ns`.
std::int64_t periods_until_next(std::int64_t due_ns, std::int64_t now_ns,
                                std::int64_t period_ns) noexcept {
  const std::int64_t gone_ns = now_ns - due_ns;
  return gone_ns <= period_ns ? 1 : (gone_ns + period_ns - 1) / period_ns;
}

}  // namespace

const char* name(LoopEnd end) noexcept {
  switch (end) {
    case LoopEnd::stop_requested: return "stop_requested";
    case LoopEnd::overruns: return "overruns";
    case LoopEnd::step_is_done: break;
  }
  return "step_is_done";
}

RealtimeLoop::RealtimeLoop(const LoopOptions& options, LoopClock* clock)
    : options_(options), clock_(clock != nullptr ? clock : &monotonic_) {
  check(options_);
  period_ns_ = std::llround(options_.period_s * 1e9);
}

RealtimeLoop::~RealtimeLoop() {
  request_stop();
  if (running_.valid()) running_.wait();
}

void RealtimeLoop::refuse_to_start_twice() const {
  if (running_.valid())
    throw Error({.place = "real-time loop",
                 .problem = "it was started before",
                 .advice = "Call wait() before it starts again."});
}

LoopReport RealtimeLoop::wait() {
  if (!running_.valid()) throw Error({.place = "real-time loop", .problem = "it was not started"});
  running_.wait();
  is_stop_requested_.store(false, std::memory_order_relaxed);  // what it was for is over
  return running_.get();
}

LoopReport RealtimeLoop::run_steps(StepCall step, const std::stop_token& stop) {
  LoopReport report = run_until_stopped(step, stop);
  is_stop_requested_.store(false, std::memory_order_relaxed);
  return report;
}

LoopReport RealtimeLoop::run_until_stopped(StepCall step, const std::stop_token& stop) {
  const LoopPrivileges privileges(options_);
  const DenormalsOff denormals_off;
  LoopReport report;
  report.grants = privileges.grants();
  touch_stack();
  Tick tick{.due_ns = clock_->now_ns() + period_ns_};
  std::uint64_t overruns_in_row = 0;
  while (true) {
    clock_->sleep_until(tick.due_ns);
    if (is_stop_requested_.load(std::memory_order_acquire) || stop.stop_requested()) {
      report.end = LoopEnd::stop_requested;
      return report;
    }
    tick.lateness_ns = clock_->now_ns() - tick.due_ns;
    const std::int64_t cpu_before_ns = clock_->cpu_ns();
    const bool goes_on = step.call(step.callee, tick);
    report.cpu_time.add(clock_->cpu_ns() - cpu_before_ns);
    report.lateness.add(tick.lateness_ns);
    ++report.steps;

    const std::int64_t periods = periods_until_next(tick.due_ns, clock_->now_ns(), period_ns_);
    overruns_in_row = periods > 1 ? overruns_in_row + 1 : 0;
    if (periods > 1) ++report.overruns;
    if (!goes_on) return report;
    report.skipped_periods += static_cast<std::uint64_t>(periods - 1);
    if (overruns_in_row > 0 && overruns_in_row == options_.stop_after_overruns) {
      report.end = LoopEnd::overruns;
      return report;
    }
    tick.index += periods;
    tick.due_ns += periods * period_ns_;
    tick.overruns = report.overruns;
  }
}

}  // namespace torsio
