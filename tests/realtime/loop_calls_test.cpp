// What the loop's side of torsio::realtime asks of the machine: no heap, no lock, and of the kernel
// nothing but the time.
#include <gtest/gtest.h>
#include <pthread.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>

#include "realtime/simulated_clock.hpp"
#include "support/allocation_counter.hpp"
#include "support/lock_counter.hpp"
#include "support/system_calls.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/realtime/mailbox.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/realtime/recorder.hpp"
#include "torsio/safety/command_watchdog.hpp"

namespace {

thread_local int looks_at_monotonic_clock = 0;
thread_local int looks_at_other_clocks = 0;

}  // namespace

// Replaces glibc's function to record which clock is read.
extern "C" int clock_gettime(clockid_t id, timespec* time) noexcept {
  if (id == CLOCK_MONOTONIC)
    ++looks_at_monotonic_clock;
  else if (id != CLOCK_THREAD_CPUTIME_ID)
    ++looks_at_other_clocks;
  return static_cast<int>(syscall(SYS_clock_gettime, id, time));
}

namespace torsio {
namespace {

using test::heap_calls;
using test::lock_calls;
using test::lock_calls_during;
using test::SimulatedClock;

struct SetPoint {
  double torque_Nm = 0.0;
  double stiffness_Nm_rad = 0.0;
};

/// A step that does all that a step may: reads one mailbox, writes another, controls a torque under a
/// watchdog, records, overruns.
class BusyStep {
 public:
  BusyStep(Recorder& recorder, SimulatedClock* clock, std::int64_t ticks)
      : recorder_(recorder), clock_(clock), ticks_(ticks) {}

  bool operator()(const Tick& tick) noexcept {
    if (steps_ == 0) begin();
    const auto& wanted = wanted_.read();
    const double torque_Nm = 0.9 * wanted.value.torque_Nm;
    wanted_.write({.torque_Nm = torque_Nm + 1.0}, tick.due_ns);
    if (steps_ % 5000 == 0) watchdog_.arm(tick.due_ns - 1);
    const auto state = watchdog_.step(
        tick.due_ns, {.written_ns = wanted.written_ns, .is_valid = wanted.sequence > 0});
    if (state == CommandWatchdog::State::running) {
      joint_.gear_angle_rad = steps_ % 700 == 0 ? kNotMeasured : 1e-3 * torque_Nm;
      current_A_ = controller_.step(torque_Nm, joint_).current_A;
      ++driven_;
    } else {
      controller_.reset();
    }
    recorder_.push(tick.index, std::array{torque_Nm, current_A_});
    recorder_.push(tick.index, std::array{torque_Nm});  // refused
    histogram_.add(tick.lateness_ns);
    if (clock_ != nullptr && steps_ % 1000 == 999) clock_->pass(3'500'000);
    if (++steps_ < ticks_) return true;
    end();
    return false;
  }

  [[nodiscard]] std::size_t heap_calls_made() const noexcept { return heap_calls_; }
  [[nodiscard]] std::size_t lock_calls_made() const noexcept { return lock_calls_; }
  [[nodiscard]] std::int64_t steps_driven() const noexcept { return driven_; }

 private:
  void begin() noexcept {
    heap_calls_ = heap_calls();
    lock_calls_ = lock_calls();
  }
  void end() noexcept {
    heap_calls_ = heap_calls() - heap_calls_;
    lock_calls_ = lock_calls() - lock_calls_;
  }

  Recorder& recorder_;
  SimulatedClock* clock_;
  std::int64_t ticks_;
  std::int64_t steps_ = 0;
  std::size_t heap_calls_ = 0;
  std::size_t lock_calls_ = 0;
  Mailbox<SetPoint> wanted_;
  CommandWatchdog watchdog_{CommandWatchdog::Settings{}};
  TorqueController<LinearInverse> controller_{
      LinearInverse(573.0),
      TorqueLoopCore::Settings{
          .deflection = {.joint = series_elastic_joint(data_sheet("dfki-50"))}},
      1000.0};
  JointSample joint_{.joint_angle_rad = 0.0};
  double current_A_ = 0.0;
  std::int64_t driven_ = 0;
  DurationHistogram histogram_;
};

LoopOptions modest() { return {.period_s = 1e-3, .priority = 0, .lock_memory = false}; }

RecorderOptions two_channels(std::size_t ring_frames) {
  return {.channels = {"torque_Nm", "current_A"}, .ring_frames = ring_frames};
}

TEST(LockCounter, DetectsLocksAndWakeUps) {
  pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
  EXPECT_EQ(lock_calls_during([&] {
              pthread_mutex_lock(&lock);
              pthread_mutex_unlock(&lock);
            }),
            1U);
  std::mutex mutex;
  std::condition_variable condition;
  EXPECT_EQ(lock_calls_during([&] {
              const std::lock_guard guard(mutex);
              condition.notify_one();
            }),
            2U);
}

TEST(RealtimeLoop, TenMillionStepsTouchNeitherHeapNorLock) {
  constexpr std::int64_t kSteps = 10'000'000;
  const TemporaryFolder folder;
  Recorder recorder(folder.path("run.tsr"), two_channels(64));  // so small that it overflows
  SimulatedClock clock;
  auto step = std::make_unique<BusyStep>(recorder, &clock, kSteps);
  const LoopReport report = RealtimeLoop(modest(), &clock).run(*step);
  EXPECT_EQ(report.steps, static_cast<std::uint64_t>(kSteps));
  EXPECT_EQ(report.overruns, static_cast<std::uint64_t>(kSteps) / 1000);
  EXPECT_GT(recorder.dropped(), static_cast<std::uint64_t>(kSteps));
  EXPECT_EQ(step->heap_calls_made(), 0U);
  EXPECT_EQ(step->lock_calls_made(), 0U);
  EXPECT_GT(step->steps_driven(), kSteps / 2);
}

// docs/simulation/faults.md 27: whoever sets the time of day, the loop does not look at it.
TEST(RealtimeLoop, LooksAtNoClockThatMayBeSet) {
  const int others = looks_at_other_clocks;
  (void)std::chrono::system_clock::now();
  ASSERT_EQ(looks_at_other_clocks, others + 1) << "seen where somebody does";
  const int before = looks_at_monotonic_clock;
  const LoopReport report =
      RealtimeLoop(modest()).run([](const Tick& tick) noexcept { return tick.index < 20; });
  EXPECT_GT(looks_at_monotonic_clock, before + static_cast<int>(report.steps));
  EXPECT_EQ(looks_at_other_clocks, others + 1);
}

/// Ends the process with 0 if `work` did nothing but compute and look at the time.
template <class Work>
[[noreturn]] void with_clock_calls_only(Work&& work) {
  constexpr int kNoFilter = 77;
  if (!test::allow_only_clock_calls()) _exit(kNoFilter);
  work();
  _exit(0);
}

bool filters_work() {
  const pid_t child = fork();
  if (child == 0) with_clock_calls_only([] {});
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(SystemCalls, AreSeenByTheKernelsFilter) {
  if (!filters_work()) GTEST_SKIP() << "this kernel takes no seccomp filter";
  EXPECT_EXIT(with_clock_calls_only([] { syscall(SYS_getppid); }), testing::KilledBySignal(SIGSYS),
              "");
  EXPECT_EXIT(with_clock_calls_only([] { MonotonicClock().sleep_until(1); }),
              testing::ExitedWithCode(0), "");
}

TEST(RealtimeLoop, CallsTheKernelOnlyForTheTime) {
  if (!filters_work()) GTEST_SKIP() << "this kernel takes no seccomp filter";
  const TemporaryFolder folder;
  // All of the child's threads are its own: the recorder's may write, the loop's may not.
  const auto record_and_loop = [&] {
    constexpr std::int64_t kSteps = 200;
    Recorder recorder(folder.path("run.tsr"), two_channels(4096));
    BusyStep busy(recorder, nullptr, kSteps);
    bool is_first = true;
    const auto step = [&](const Tick& tick) noexcept {
      if (is_first && !test::allow_only_clock_calls()) _exit(1);
      is_first = false;
      if (!busy(tick)) _exit(0);
      return true;
    };
    RealtimeLoop(modest()).run(step);
  };
  EXPECT_EXIT(record_and_loop(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace torsio
