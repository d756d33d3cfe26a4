#pragma once

#include <cstddef>
#include <utility>

namespace torsio::test {

/// Calls of this thread into the heap so far: malloc and its relatives, free, and with them new and
/// delete. Counts only in programs that are linked with allocation_counter.cpp, which replaces
/// malloc: not under AddressSanitizer, which does so itself.
[[nodiscard]] std::size_t heap_calls() noexcept;

/// Calls into the heap while `work` runs.
template <class Work>
std::size_t heap_calls_during(Work&& work) {
  const std::size_t before = heap_calls();
  std::forward<Work>(work)();
  return heap_calls() - before;
}

}  // namespace torsio::test
