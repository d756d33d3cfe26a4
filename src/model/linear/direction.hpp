#pragma once

#include <algorithm>
#include <cstdint>

#include "torsio/core/state_bytes.hpp"

namespace torsio {

enum class Direction : std::uint8_t { unknown, rising, falling };

/// Determines the direction in which a signal moves, with a dead band against noise: the direction
/// changes when the signal has moved back from its extreme by more than the dead band. After
/// `reset()` it is unknown until the signal has moved by more than that in either direction.
class DirectionTracker {
 public:
  explicit DirectionTracker(double dead_band) noexcept : dead_band_(dead_band) {}

  [[nodiscard]] Direction direction() const noexcept { return direction_; }

  void reset() noexcept {
    started_ = false;
    direction_ = Direction::unknown;
  }

  Direction step(double x) noexcept {
    if (!started_) lowest_ = highest_ = x;
    started_ = true;
    lowest_ = std::min(lowest_, x);
    highest_ = std::max(highest_, x);
    // Only the extreme of the present direction matters; the other starts anew at the turn.
    if (direction_ != Direction::rising && x - lowest_ > dead_band_) {
      direction_ = Direction::rising;
      highest_ = x;
    } else if (direction_ != Direction::falling && highest_ - x > dead_band_) {
      direction_ = Direction::falling;
      lowest_ = x;
    }
    return direction_;
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(lowest_, highest_, started_);
    bytes.visit_at_most(direction_, Direction::falling);
  }

 private:
  double dead_band_;
  double lowest_ = 0.0;
  double highest_ = 0.0;
  bool started_ = false;
  Direction direction_ = Direction::unknown;
};

}  // namespace torsio
