#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace torsio::bench {

/// A folder of this process; what lies in it is gone at its end.
[[nodiscard]] const std::filesystem::path& scratch_folder();
/// Writes them there, raw, for a peer.
void write_doubles(const char* file, const std::vector<double>& values);

/// One measurement. A value in "<something>/s" is better the larger, any other the smaller.
struct Row {
  double value = 0.0;
  std::string unit;
  std::optional<double> floor = {};  ///< what this machine could do at best, same unit
};

/// The shortest of repeated runs: what the work costs when nothing disturbs it.
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

/// Time to read `bytes` once, over and over, so that they lie in the nearest cache that holds them.
[[nodiscard]] double stream_seconds(std::size_t bytes);

/// Multiply-adds of doubles that one thread does in a second.
[[nodiscard]] double multiply_adds_per_second();
/// Doubles in one vector.
[[nodiscard]] std::size_t vector_lanes();

}  // namespace torsio::bench
