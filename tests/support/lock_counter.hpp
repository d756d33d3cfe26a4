#pragma once

#include <cstddef>
#include <utility>

namespace torsio::test {

/// Calls of this thread so far into what takes a lock or waits for another thread: pthread's
/// mutexes, conditions and read-write locks, semaphores. Counts only in programs that are linked
/// with lock_counter.cpp, which replaces them: not under a sanitizer, which replaces them, too.
[[nodiscard]] std::size_t lock_calls() noexcept;

/// Such calls while `work` runs.
template <class Work>
std::size_t lock_calls_during(Work&& work) {
  const std::size_t before = lock_calls();
  std::forward<Work>(work)();
  return lock_calls() - before;
}

}  // namespace torsio::test
