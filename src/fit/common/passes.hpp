#pragma once

#include <atomic>
#include <cstddef>

namespace torsio {

/// How often this process has run recordings through a pipeline, a model or the search for a leak:
/// the passes that a verb must not repeat, counted for the tests.
struct Passes {
  std::atomic<std::size_t> training_data = 0;
  std::atomic<std::size_t> predictions = 0;  ///< one for each recording and model
  std::atomic<std::size_t> leak_searches = 0;
};

inline Passes& passes() noexcept {
  static Passes counted;
  return counted;
}

}  // namespace torsio
