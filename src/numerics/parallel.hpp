#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "numerics/thread_share.hpp"

namespace torsio {

/// Calls `work(chunk)` for every chunk in 0 .. chunks - 1, on several threads. Chunks must not
/// depend on each other; give each its own result and reduce these in order afterwards, then the
/// number of threads changes no bit. Of several exceptions that of the lowest chunk is thrown again
/// here: every lower chunk has begun by then and ends.
/// @param threads 0: `usual_threads()`.
template <class Work>
void for_each_chunk(std::size_t chunks, std::size_t threads, const Work& work) {
  if (threads == 0) threads = usual_threads();
  threads = std::min(threads, chunks);
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::size_t failed = chunks;
  std::mutex failure_guard;
  const auto run = [&] {
    for (std::size_t chunk = next++; chunk < chunks; chunk = next++) {
      try {
        work(chunk);
      } catch (...) {
        const std::scoped_lock lock(failure_guard);
        if (chunk < failed) {
          failure = std::current_exception();
          failed = chunk;
        }
        next = chunks;
      }
    }
  };
  {
    std::vector<std::jthread> helpers;
    try {
      const auto run_with = [&run, share = ThreadShare::current()] {
        const ThreadShare own(share);
        run();
      };
      for (std::size_t k = 1; k < threads; ++k) helpers.emplace_back(run_with);
    } catch (const std::system_error&) {  // a limit of the system: with fewer threads, then
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace torsio
