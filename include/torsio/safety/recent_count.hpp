#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio::detail {

/// In how many of the last samples a condition was true. Nothing is allocated after construction.
class RecentCount {
 public:
  RecentCount() = default;
  /// @param samples at least 1
  explicit RecentCount(std::size_t samples) : was_true_(samples, 0) {}

  void reset() noexcept {
    for (std::uint8_t& each : was_true_) each = 0;
    next_ = count_ = 0;
  }
  /// @returns the count, this sample included
  std::size_t add(bool is_true) noexcept TORSIO_REALTIME {
    std::uint8_t& oldest = was_true_[next_];
    count_ = count_ + (is_true ? 1 : 0) - oldest;
    oldest = is_true ? 1 : 0;
    next_ = next_ + 1 == was_true_.size() ? 0 : next_ + 1;
    return count_;
  }

 private:
  std::vector<std::uint8_t> was_true_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace torsio::detail
