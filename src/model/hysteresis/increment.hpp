#pragma once

#include <algorithm>
#include <limits>

#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// How far an input moved since the last tick, for operators that feel only that: 0 in the first
/// tick after `reset()`, since where the input came from is not known. Finite for finite inputs.
class Increment {
 public:
  void reset() noexcept {
    last_ = 0.0;
    has_last_ = false;
  }

  /// What `step(x)` would give.
  [[nodiscard]] double to(double x) const noexcept {
    constexpr double kLargest = std::numeric_limits<double>::max();
    return has_last_ ? std::clamp(x - last_, -kLargest, kLargest) : 0.0;
  }
  double step(double x) noexcept {
    const double moved = to(x);
    last_ = x;
    has_last_ = true;
    return moved;
  }

  [[nodiscard]] bool has_last() const noexcept { return has_last_; }
  [[nodiscard]] double last() const noexcept { return last_; }  ///< 0 before the first tick

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(last_, has_last_); }

 private:
  double last_ = 0.0;
  bool has_last_ = false;
};

}  // namespace torsio
