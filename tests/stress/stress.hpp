#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace torsio::stress {

struct Settings {
  std::uint64_t seed = 1;
  std::size_t count = 100;  ///< cases of each part
  double seconds = 0.0;     ///< no case of a part begins later; 0: no limit
};

/// What a part found. A failure names the case, so that it can be repeated alone.
struct Outcome {
  std::size_t cases = 0;
  std::vector<std::string> rows = {};
  std::vector<std::string> failures = {};

  /// Cases that are wrong; failures if they are more than this share of all cases, and one.
  void add_wrong(const std::vector<std::string>& wrong, double allowed_share) {
    const auto allowed = static_cast<std::size_t>(allowed_share * static_cast<double>(cases)) + 1;
    std::vector<std::string>& list = wrong.size() > allowed ? failures : rows;
    list.insert(list.end(), wrong.begin(), wrong.end());
  }
};

/// The longest run of ticks that are wrong.
class LongestRun {
 public:
  void add(bool is_wrong, std::size_t tick) noexcept {
    run_ = is_wrong ? run_ + 1 : 0;
    if (run_ <= ticks_) return;
    ticks_ = run_;
    last_ = tick;
  }
  [[nodiscard]] std::size_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] std::size_t last() const noexcept { return last_; }

 private:
  std::size_t run_ = 0;
  std::size_t ticks_ = 0;
  std::size_t last_ = 0;  ///< its last tick
};

/// The time that a part has.
class Deadline {
 public:
  explicit Deadline(double seconds) : seconds_(seconds) {}
  [[nodiscard]] bool passed() const {
    const std::chrono::duration<double> used = std::chrono::steady_clock::now() - start_;
    return seconds_ > 0.0 && used.count() > seconds_;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double seconds_;
};

}  // namespace torsio::stress
