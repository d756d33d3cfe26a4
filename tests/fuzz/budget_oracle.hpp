#pragma once

#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>

namespace torsio::fuzz {

/// Processor time of this process and of its children that have ended: other processes of the machine do not change it.
inline double processor_time_s() {
  double time_s = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    for (const timeval& each : {used.ru_utime, used.ru_stime})
      time_s += static_cast<double>(each.tv_sec) + 1e-6 * static_cast<double>(each.tv_usec);
  }
  return time_s;
}

/// Runs `work` and aborts if it took longer, or the process has used more memory, than the smallest file may
/// (`ReadBudget`), with what the sanitizers add.
template <class Work>
void within_budget(const Work& work) {
  constexpr double kLongest_s = 20.0;
  constexpr long kMaxMemory_KiB = 1536L << 10;
  const double before_s = processor_time_s();
  work();
  if (processor_time_s() - before_s > kLongest_s) {
    std::fputs("an input took longer than its budget\n", stderr);
    std::abort();
  }
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  if (used.ru_maxrss > kMaxMemory_KiB) {
    std::fputs("an input needed more memory than its budget\n", stderr);
    std::abort();
  }
}

}  // namespace torsio::fuzz
