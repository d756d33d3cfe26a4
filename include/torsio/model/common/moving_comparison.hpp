#pragma once

#include <cstddef>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio::detail {

/// Compares two mean square errors over the last stretch of time, in blocks of a hundredth of it:
/// sums of blocks do not drift, unlike running sums. Nothing is allocated after construction.
class MovingComparison {
 public:
  /// @param ticks length of the stretch, rounded up to a multiple of 100.
  explicit MovingComparison(std::size_t ticks);

  void reset() noexcept;

  /// One tick; both squares 0 where nothing was measured.
  /// @returns true at the end of a block if the stretch is full and the first sum is the larger.
  bool step(double first_square, double second_square) noexcept TORSIO_REALTIME;

 private:
  struct Sums {
    double first = 0.0;
    double second = 0.0;
  };
  std::vector<Sums> blocks_;
  std::size_t block_ticks_;
  Sums current_;
  std::size_t ticks_ = 0;   ///< in the current block
  std::size_t filled_ = 0;  ///< blocks since the reset, up to all
  std::size_t next_ = 0;    ///< block to be replaced
};

}  // namespace torsio::detail
