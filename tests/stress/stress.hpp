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
