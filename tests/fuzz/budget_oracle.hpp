#pragma once

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace torsio::fuzz {

/// Runs `work` and aborts if it took longer, or the process has used more memory, than the smallest file may
/// (`ReadBudget`), with what the sanitizers add.
template <class Work>
void within_budget(const Work& work) {
  constexpr std::chrono::seconds kLongest{20};
  constexpr long kMaxMemory_KiB = 1536L << 10;
  const auto before = std::chrono::steady_clock::now();
  work();
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  if (std::chrono::steady_clock::now() - before > kLongest) {
    std::fputs("an input took longer than its budget\n", stderr);
    std::abort();
  }
  if (used.ru_maxrss > kMaxMemory_KiB) {
    std::fputs("an input needed more memory than its budget\n", stderr);
    std::abort();
  }
}

}  // namespace torsio::fuzz
