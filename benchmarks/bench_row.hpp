#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace torsio::bench {

/// A folder of this process; it is deleted at the end.
[[nodiscard]] const std::filesystem::path& scratch_folder();
/// Writes them there as raw doubles for a peer.
void write_doubles(const char* file, const std::vector<double>& values);

/// One measurement. A value in "<something>/s" is better the larger, any other the smaller.
struct Row {
  double value = 0.0;
  std::string unit;
  std::optional<double> floor = {};  ///< the lower bound on this machine, same unit
};

/// The shortest of repeated runs: the time of the work without disturbance.
template <class Work>
double best_seconds(const Work& work, double at_least_s = 0.5, std::size_t at_least_runs = 5) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  const auto seconds = [](auto span) { return std::chrono::duration<double>(span).count(); };
  double best = seconds(Clock::duration::max());
  for (std::size_t run = 0; run < at_least_runs || seconds(Clock::now() - begin) < at_least_s;
       ++run) {
    const auto start = Clock::now();
    work();
    best = std::min(best, seconds(Clock::now() - start));
  }
  return best;
}

/// Time to read `bytes` once, repeated so that they are in the nearest cache that is large enough.
[[nodiscard]] double stream_seconds(std::size_t bytes);

/// Multiply-adds of doubles per second in one thread.
[[nodiscard]] double multiply_adds_per_second();
/// Doubles in one vector.
[[nodiscard]] std::size_t vector_lanes();

}  // namespace torsio::bench
