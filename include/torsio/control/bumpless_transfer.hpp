#pragma once

#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The bump that a change of gains or of mode would make, taken up whole and let go slowly:
///
///     h[n] = h₀ exp(−n T / T_h)
///
/// added to a command, it makes the change start where the command was.
class BumplessTransfer {
 public:
  /// Both positive.
  BumplessTransfer(double time_s, double sample_rate_Hz) noexcept
      : keep_(std::exp(-1.0 / (time_s * sample_rate_Hz))) {}

  void reset() noexcept { bump_ = 0.0; }
  /// What is yet to be let go of grows by `bump`.
  void add(double bump) noexcept { bump_ += bump; }
  /// @returns the share of this tick
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

}  // namespace torsio
