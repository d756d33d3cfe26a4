// A clock for tools/step_ratios, loaded before a program (LD_PRELOAD): steady_clock from the counter of the processor,
// which may advance in steps of 10 ns, plus a random part of up to such a step. The median of many times of a step is
// then not a multiple of 10 ns. At the start it prints how much longer a time is on average than after subtraction of the
// least of 1000 empty ones, which is what `torsio` subtracts.
#include <dlfcn.h>
#include <time.h>
#include <x86intrin.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>

namespace {

using Gettime = int (*)(clockid_t, timespec*);
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kStep_ns = 10;
constexpr std::uint64_t kSecond_ns = 1'000'000'000;

Gettime system_gettime = nullptr;
double ns_per_count = 0.0;
std::uint64_t first_count = 0;
std::uint64_t first_ns = 0;
std::uint64_t random_state = 88172645463325252;

std::uint64_t system_ns() {
  timespec time{};
  system_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * kSecond_ns +
         static_cast<std::uint64_t>(time.tv_nsec);
}

/// Marsaglia's xorshift: a few operations, since it is a part of each time.
std::uint64_t random_ns() {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 7;
  random_state ^= random_state << 17;
  return random_state % kStep_ns;
}

double empty_time_ns() {
  const auto start = Clock::now();
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

__attribute__((constructor)) void calibrate() {
  constexpr std::uint64_t kCalibration_ns = 20'000'000;
  system_gettime = reinterpret_cast<Gettime>(dlsym(RTLD_NEXT, "clock_gettime"));
  first_ns = system_ns();
  first_count = __rdtsc();
  while (system_ns() - first_ns < kCalibration_ns) {
  }
  const std::uint64_t last_ns = system_ns();
  ns_per_count =
      static_cast<double>(last_ns - first_ns) / static_cast<double>(__rdtsc() - first_count);
  constexpr int kTimes = 100'000;
  double least = empty_time_ns();
  for (int i = 0; i < 1000; ++i) least = std::min(least, empty_time_ns());
  double sum = 0.0;
  for (int i = 0; i < kTimes; ++i) sum += empty_time_ns();
  std::fprintf(stderr, "step_clock: %.2f\n", sum / kTimes - least);
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (clock != CLOCK_MONOTONIC || ns_per_count == 0.0) {
    if (system_gettime == nullptr)
      system_gettime = reinterpret_cast<Gettime>(dlsym(RTLD_NEXT, "clock_gettime"));
    return system_gettime(clock, time);
  }
  const double since_ns = static_cast<double>(__rdtsc() - first_count) * ns_per_count;
  const std::uint64_t now_ns = first_ns + static_cast<std::uint64_t>(since_ns) + random_ns();
  time->tv_sec = static_cast<time_t>(now_ns / kSecond_ns);
  time->tv_nsec = static_cast<long>(now_ns % kSecond_ns);
  return 0;
}
