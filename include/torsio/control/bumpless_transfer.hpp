#pragma once

#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio::detail {

/// The step of the command that a change of gains or of mode would cause, which decays
/// exponentially:
///
///     h[n] = h₀ exp(−n T / T_h)
///
/// Added to a command, it makes the command continue from its value before the change.
class BumplessTransfer {
 public:
  /// Both are positive.
  BumplessTransfer(double time_s, double sample_rate_Hz) noexcept
      : keep_(std::exp(-1.0 / (time_s * sample_rate_Hz))) {}

  void reset() noexcept { bump_ = 0.0; }
  /// Adds `bump` to the part that has not decayed yet.
  void add(double bump) noexcept { bump_ += bump; }
  /// @returns the part that the next `step` adds
  [[nodiscard]] double pending() const noexcept { return bump_; }
  /// @returns the part that is added in this tick
  double step() noexcept TORSIO_REALTIME {
    const double now = bump_;
    // Far below the last bit of any command: no denormal numbers at the end of the decay.
    bump_ = std::abs(bump_) > 1e-100 ? bump_ * keep_ : 0.0;
    return now;
  }

 private:
  double keep_;
  double bump_ = 0.0;
};

}  // namespace torsio::detail
