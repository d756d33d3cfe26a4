#pragma once

#include <algorithm>
#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The current that a winding withstands: the square of the current, through a first-order lag,
/// stays below the square of the rated current (I²t).
///
///     ẇ = (i² − w) / τ,   i² <= min(i_peak², i_rated² + κ (i_rated² − w)),   κ = 4 (i_peak² / i_rated² − 1)
///
/// so that w < i_rated² for any command, since then (i_rated² − w)˙ >= −(1 + κ) (i_rated² − w) / τ.
/// The limit falls from peak to rated over the last quarter of w: it fades, and never switches.
class ThermalLimit {
 public:
  /// @throws Error if a value is not positive, the peak below the rated current, or the time
  /// constant not above 1 + κ samples.
  ThermalLimit(double rated_A, double peak_A, double time_constant_s, double sample_rate_Hz);

  void reset() noexcept { load_ = 0.0; }

  /// @returns the largest current [A] of this tick
  [[nodiscard]] double allowed_A() const noexcept TORSIO_REALTIME {
    return is_warm() ? std::min(peak_A_, rated_A_ * std::sqrt(1.0 + fade_ * (1.0 - load_)))
                     : peak_A_;
  }
  /// Whether the limit has begun to fall, at three quarters of the heat.
  [[nodiscard]] bool is_warm() const noexcept TORSIO_REALTIME { return load_ > kCold; }
  /// @param current_A the current that flows in this tick, finite
  void step(double current_A) noexcept TORSIO_REALTIME {
    const double ratio = current_A / rated_A_;
    load_ += share_ * (ratio * ratio - load_);
  }
  /// @returns w / i_rated², 0 cold, 1 as hot as it may be
  [[nodiscard]] double load() const noexcept { return load_; }

 private:
  static constexpr double kCold = 0.75;

  double rated_A_;
  double peak_A_;
  double fade_;   ///< κ
  double share_;  ///< first-order lag per tick
  double load_ = 0.0;
};

}  // namespace torsio
