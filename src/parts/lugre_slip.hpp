#pragma once

#include <algorithm>
#include <cmath>

#include "parts/stribeck.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// LuGre friction inside a spring: driven by a displacement, with a limit that grows with the load.
///
///     f = f₀ + μ |τ_el|,   g(v) = f (1 + (r − 1) exp(−(v / v_s)²))
///     dF = (f / X) (1 − F sgn(dx) / g(v)) dx
///
/// x displacement [rad], v its rate, X bristle [rad]. F relaxes to g sgn(dx) over the displacement
/// X g / f; the step uses that exact exponential, so that at constant rate and load no increment is
/// too large. The bristle's stiffness f / X must not depend on the rate, as it would with the plain
/// displacement X: loaded slowly and released fast, a stiffness that falls with the rate gives
/// energy. The force is the state, clipped to ± r f after the update,
/// so that a shrinking limit dissipates instead of pushing. Source: Canudas de Wit et al. 1995;
/// specification 4.6.
class LuGreSlip {
 public:
  struct Parameters {
    double constant_Nm = 0.0;      ///< f₀
    double load_factor = 0.0;      ///< μ
    double static_ratio = 1.15;    ///< r
    double stribeck_rad_s = 0.05;  ///< v_s; assumed, no paper gives it
    double bristle_rad = 1.0;      ///< X
  };

  /// @throws Error if the force or factor is negative, the ratio below 1, or v_s or X not positive.
  explicit LuGreSlip(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset() noexcept {
    force_Nm_ = 0.0;
    limit_Nm_ = parameters_.constant_Nm;
  }

  /// @param increment_rad displacement since the last step
  /// @param rate_rad_s its rate, v
  /// @param load_Nm the torque whose magnitude presses the surfaces together
  /// @returns F [Nm], of the sign of a spring: positive after a positive displacement
  double step(double increment_rad, double rate_rad_s, double load_Nm) noexcept TORSIO_REALTIME {
    limit_Nm_ = limit(load_Nm);
    const double over_limit = stribeck_(rate_rad_s);  // g / f
    const double target_Nm = std::copysign(limit_Nm_ * over_limit, increment_rad);
    force_Nm_ +=
        (force_Nm_ - target_Nm) * std::expm1(-std::abs(increment_rad) * per_bristle_ / over_limit);
    const double max_Nm = parameters_.static_ratio * limit_Nm_;
    force_Nm_ = std::min(std::max(force_Nm_, -max_Nm), max_Nm);
    return force_Nm_;
  }

  /// @returns the energy [J] held in the bristle, F² / 2k with k = f / X of the last step
  [[nodiscard]] double energy() const noexcept {
    return limit_Nm_ > 0.0 ? 0.5 * force_Nm_ * force_Nm_ * parameters_.bristle_rad / limit_Nm_
                           : 0.0;
  }

  /// @returns the largest stiffness [Nm/rad] under this load, (1 + r) f / X: met where a motion at
  /// the limit turns back fast; without force it is f / X
  [[nodiscard]] double stiffness(double load_Nm) const noexcept {
    return (1.0 + parameters_.static_ratio) * limit(load_Nm) * per_bristle_;
  }

 private:
  [[nodiscard]] double limit(double load_Nm) const noexcept {
    return parameters_.constant_Nm + parameters_.load_factor * std::abs(load_Nm);
  }

  Parameters parameters_;
  StribeckCurve stribeck_;
  double per_bristle_;  ///< 1 / X
  double force_Nm_ = 0.0;
  double limit_Nm_ = 0.0;
};

}  // namespace torsio
