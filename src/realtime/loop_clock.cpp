#include <cerrno>
#include <ctime>

#include "torsio/realtime/realtime_loop.hpp"

namespace torsio {
namespace {

constexpr std::int64_t kSecondInNs = 1'000'000'000;

std::int64_t read_ns(clockid_t clock) noexcept {
  timespec time{};
  ::clock_gettime(clock, &time);
  return time.tv_sec * kSecondInNs + time.tv_nsec;
}

}  // namespace

std::int64_t MonotonicClock::now_ns() noexcept { return read_ns(CLOCK_MONOTONIC); }

void MonotonicClock::sleep_until(std::int64_t point_ns) noexcept {
  const timespec point{.tv_sec = point_ns / kSecondInNs, .tv_nsec = point_ns % kSecondInNs};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &point, nullptr) == EINTR) {
  }
}

std::int64_t MonotonicClock::cpu_ns() noexcept { return read_ns(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace torsio
