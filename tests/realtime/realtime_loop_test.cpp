#include "torsio/realtime/realtime_loop.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "realtime/simulated_clock.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::SimulatedClock;

constexpr std::int64_t kPeriodInNs = 1'000'000;

/// Nothing asked of the machine that runs the tests.
LoopOptions modest() { return {.period_s = 1e-3, .priority = 0, .lock_memory = false}; }

/// The periods in which a step began, if the steps take `durations_ns` one after the other.
struct Steps {
  std::vector<std::int64_t> indices;
  std::vector<std::int64_t> began_ns;  ///< since the first period's beginning
  LoopReport report;
};

Steps run_steps_that_take(const std::vector<std::int64_t>& durations_ns,
                          std::uint64_t stop_after_overruns = 0,
                          std::int64_t wakes_late_by_ns = 0) {
  SimulatedClock clock;
  clock.wakes_late_by_ns = wakes_late_by_ns;
  LoopOptions options = modest();
  options.stop_after_overruns = stop_after_overruns;
  RealtimeLoop loop(options, &clock);
  Steps run;
  std::int64_t start_ns = -1;
  run.report = loop.run([&](const Tick& tick) noexcept {
    if (start_ns < 0) start_ns = tick.due_ns;
    run.indices.push_back(tick.index);
    run.began_ns.push_back(clock.now_ns() - start_ns);
    clock.pass(durations_ns[run.indices.size() - 1]);
    return run.indices.size() < durations_ns.size();
  });
  return run;
}

TEST(RealtimeLoop, BeginsEachPeriodOnTheGrid) {
  const Steps run = run_steps_that_take({10, 999'000, kPeriodInNs, 10});
  EXPECT_EQ(run.indices, (std::vector<std::int64_t>{0, 1, 2, 3}));
  EXPECT_EQ(run.began_ns,
            (std::vector<std::int64_t>{0, kPeriodInNs, 2 * kPeriodInNs, 3 * kPeriodInNs}));
  EXPECT_EQ(run.report.overruns, 0U);
  EXPECT_EQ(run.report.skipped_periods, 0U);
  EXPECT_EQ(run.report.steps, 4U);
  EXPECT_EQ(run.report.end, LoopEnd::step_is_done);
  EXPECT_EQ(run.report.lateness.max_ns(), 0);
}

TEST(RealtimeLoop, AnOverrunIsCountedAndNothingCatchesUp) {
  const Steps run = run_steps_that_take({10, 4'500'000, 10, 1'000'001, 10});
  EXPECT_EQ(run.indices, (std::vector<std::int64_t>{0, 1, 6, 7, 9}));
  for (std::size_t n = 0; n < run.indices.size(); ++n)
    EXPECT_EQ(run.began_ns[n], run.indices[n] * kPeriodInNs);
  EXPECT_EQ(run.report.overruns, 2U);
  EXPECT_EQ(run.report.skipped_periods, 5U);
}

TEST(RealtimeLoop, AWakeUpThatIsLateByPeriodsIsAnOverrunToo) {
  const Steps run = run_steps_that_take({10, 10, 10}, 0, 2'300'000);
  EXPECT_EQ(run.indices, (std::vector<std::int64_t>{0, 3, 6}));
  EXPECT_EQ(run.report.overruns, 3U);
  EXPECT_EQ(run.report.lateness.max_ns(), 2'300'000);
}

TEST(RealtimeLoop, EndsAfterSoManyOverrunsInARow) {
  const std::int64_t slow = 1'500'000;
  const Steps run = run_steps_that_take({slow, slow, 10, slow, slow, slow, 10, 10}, 3);
  EXPECT_EQ(run.report.end, LoopEnd::overruns);
  EXPECT_EQ(run.report.steps, 6U);
  EXPECT_EQ(run.report.overruns, 5U);
}

TEST(RealtimeLoop, MeasuresCpuTimeApartFromTheTimeThatPasses) {
  SimulatedClock clock;
  RealtimeLoop loop(modest(), &clock);
  const LoopReport report = loop.run([&](const Tick& tick) noexcept {
    clock.pass(500'000, tick.index == 3 ? 7000 : 10);
    return tick.index < 9;
  });
  EXPECT_EQ(report.cpu_time.count(), 10U);
  EXPECT_EQ(report.cpu_time.quantile_ns(0.5), 10);
  EXPECT_EQ(report.cpu_time.max_ns(), 7000);
}

TEST(RealtimeLoop, StopsOnRequestBeforeTheNextStepAndStaysStopped) {
  SimulatedClock clock;
  RealtimeLoop loop(modest(), &clock);
  std::stop_source stop;
  std::int64_t steps = 0;
  const auto step = [&](const Tick& tick) noexcept {
    ++steps;
    if (tick.index == 4) stop.request_stop();
    return true;
  };
  EXPECT_EQ(loop.run(step, stop.get_token()).end, LoopEnd::stop_requested);
  EXPECT_EQ(steps, 5);
  EXPECT_EQ(loop.run(step, stop.get_token()).steps, 0U);
  EXPECT_EQ(steps, 5);
}

TEST(RealtimeLoop, StopsOnRequestWhatRunsOnTheCallersThread) {
  SimulatedClock clock;
  RealtimeLoop loop(modest(), &clock);
  const auto step = [&](const Tick& tick) noexcept {
    if (tick.index == 4) loop.request_stop();
    return tick.index < 499;
  };
  const LoopReport stopped = loop.run(step);
  EXPECT_EQ(stopped.end, LoopEnd::stop_requested);
  EXPECT_EQ(stopped.steps, 5U);
  // The request was for that run.
  EXPECT_EQ(loop.run([](const Tick&) noexcept { return false; }).steps, 1U);
}

TEST(RealtimeLoop, StopsOnRequestFromAnotherThread) {
  RealtimeLoop loop(modest());
  std::atomic<bool> runs{false};
  std::thread other([&] {
    while (!runs) std::this_thread::yield();
    loop.request_stop();
  });
  const LoopReport report = loop.run([&](const Tick& tick) noexcept {
    runs = true;
    return tick.index < 60'000;
  });
  other.join();
  EXPECT_EQ(report.end, LoopEnd::stop_requested);
}

TEST(RealtimeLoop, ARequestThatComesBeforeTheLoopIsNotLost) {
  SimulatedClock clock;
  RealtimeLoop loop(modest(), &clock);
  const auto step = [](const Tick&) noexcept { return false; };
  loop.request_stop();
  loop.start(step);
  EXPECT_EQ(loop.wait().steps, 0U);
  loop.request_stop();
  EXPECT_EQ(loop.run(step).end, LoopEnd::stop_requested);
  // One that comes too late is over with the loop that it was for.
  std::atomic<bool> is_over{false};
  loop.start([&](const Tick&) noexcept {
    is_over = true;
    return false;
  });
  while (!is_over) std::this_thread::yield();
  loop.request_stop();
  EXPECT_EQ(loop.wait().steps, 1U);
  EXPECT_EQ(loop.run(step).steps, 1U);
}

TEST(RealtimeLoop, RunsOnItsOwnThreadByTheMonotonicClock) {
  RealtimeLoop loop(modest());
  EXPECT_THROW((void)loop.wait(), Error);
  std::atomic<std::int64_t> index{-1};
  MonotonicClock clock;
  const std::int64_t began_ns = clock.now_ns();
  loop.start([&index](const Tick& tick) noexcept {
    index = tick.index;
    return true;
  });
  EXPECT_THROW(loop.start([](const Tick&) noexcept { return false; }), Error);
  while (index < 20) clock.sleep_until(clock.now_ns() + kPeriodInNs);
  EXPECT_GE(clock.now_ns() - began_ns, 19 * kPeriodInNs);
  loop.request_stop();
  const LoopReport report = loop.wait();
  EXPECT_EQ(report.end, LoopEnd::stop_requested);
  // After the last step periods may have been skipped, too.
  EXPECT_GE(static_cast<std::int64_t>(report.steps + report.skipped_periods), index + 1);
  loop.start([](const Tick&) noexcept { return false; });
  EXPECT_EQ(loop.wait().steps, 1U);
}

TEST(RealtimeLoop, EndsWithItsObject) {
  std::atomic<bool> ran{false};
  {
    RealtimeLoop loop(modest());
    loop.start([&ran](const Tick&) noexcept {
      ran = true;
      return true;
    });
    while (!ran) std::this_thread::yield();
    ran = false;
    while (!ran) std::this_thread::yield();
  }
  ran = false;
  MonotonicClock clock;
  clock.sleep_until(clock.now_ns() + 5 * kPeriodInNs);
  EXPECT_FALSE(ran) << "a step after the object was gone";
}

TEST(RealtimeLoop, ReportsWhatItWasGrantedAndRestoresTheThread) {
  LoopOptions options = modest();
  options.priority = 1;
  const int before = sched_getscheduler(0);
  int within = -1;
  SimulatedClock clock;
  const LoopReport report = RealtimeLoop(options, &clock).run([&](const Tick&) noexcept {
    within = sched_getscheduler(0);
    return false;
  });
  EXPECT_EQ(report.grants.fifo, within == SCHED_FIFO);
  EXPECT_EQ(report.grants.fifo, report.grants.refused.empty()) << report.grants.refused;
  EXPECT_EQ(sched_getscheduler(0), before);
}

TEST(RealtimeLoop, GoesOnWithoutWhatIsRefusedUnlessItMustBeGranted) {
  LoopOptions options = modest();
  options.cpu = CPU_SETSIZE - 1;  // no machine of ours has it
  SimulatedClock clock;
  const auto step = [](const Tick&) noexcept { return false; };
  const LoopReport report = RealtimeLoop(options, &clock).run(step);
  EXPECT_EQ(report.steps, 1U);
  EXPECT_FALSE(report.grants.cpu);
  EXPECT_NE(report.grants.refused.find("CPU 1023"), std::string::npos) << report.grants.refused;
  options.must_be_granted = true;
  RealtimeLoop strict(options, &clock);
  EXPECT_THROW((void)strict.run(step), Error);
  strict.start(step);
  EXPECT_THROW((void)strict.wait(), Error);
}

TEST(RealtimeLoop, TurnsDenormalNumbersOffWhileItRuns) {
  volatile double smallest = std::numeric_limits<double>::min();
  double half = 1.0;
  SimulatedClock clock;
  RealtimeLoop(modest(), &clock).run([&](const Tick&) noexcept {
    half = smallest / 2.0;
    return false;
  });
  EXPECT_EQ(half, 0.0);
  EXPECT_GT(smallest / 2.0, 0.0);
}

TEST(RealtimeLoop, RefusesOptionsOutOfRange) {
  const auto refused = [](void (*spoil)(LoopOptions&)) {
    LoopOptions options = modest();
    spoil(options);
    EXPECT_THROW(RealtimeLoop{options}, UsageError);
  };
  refused([](LoopOptions& options) { options.period_s = 0.0; });
  refused([](LoopOptions& options) { options.period_s = 60.0; });
  refused(
      [](LoopOptions& options) { options.period_s = std::numeric_limits<double>::quiet_NaN(); });
  refused([](LoopOptions& options) { options.priority = 100; });
  refused([](LoopOptions& options) { options.cpu = -2; });
  refused([](LoopOptions& options) { options.cpu = CPU_SETSIZE; });
}

// A function that may throw is not a step.
constexpr auto kMayThrow = [](const Tick&) { return true; };
constexpr auto kReturnsNothing = [](const Tick&) noexcept {};
constexpr auto kIsStep = [](const Tick&) noexcept { return true; };
static_assert(!LoopStep<decltype(kMayThrow)>);
static_assert(!LoopStep<decltype(kReturnsNothing)>);
static_assert(LoopStep<decltype(kIsStep)>);

}  // namespace
}  // namespace torsio
