#pragma once

#include <algorithm>
#include <cmath>

#include "parts/bouc_wen_loading.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Bouc-Wen hysteresis whose limit grows with the load.
///
///     f = f₀ + μ |τ_el|,   dF = (f / X) (1 − ½ (1 + sgn(F dx)) |F / f|ⁿ) dx,   n = 1.5
///
/// x displacement [rad], X knee [rad]: β = γ = ½, scaled so that the largest force is f. The force
/// is the state, clipped to ± f after the update, so that a shrinking limit dissipates instead of
/// pushing. Unloading is elastic, hence exact; loading takes midpoint steps of at most half a knee,
/// which cannot overshoot f. At constant load the error falls with the square of the increment,
/// under a changing load with the increment itself, since the load is that of the step's end.
/// Source: Ismail, Ikhouane and Rodellar 2009; specification 4.6.
class BoucWen {
 public:
  struct Parameters {
    double constant_Nm = 0.0;  ///< f₀
    double load_factor = 0.0;  ///< μ
    double knee_rad = 1.0;     ///< X
  };

  /// @throws Error if the force or factor is negative, or the knee is not positive.
  explicit BoucWen(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset() noexcept {
    force_Nm_ = 0.0;
    limit_Nm_ = parameters_.constant_Nm;
  }

  /// @param increment_rad displacement since the last step
  /// @param load_Nm the torque whose magnitude presses the surfaces together
  /// @returns F [Nm], of the sign of a spring: positive after a positive displacement
  double step(double increment_rad, double /*rate_rad_s*/,
              double load_Nm) noexcept TORSIO_REALTIME {
    limit_Nm_ = limit(load_Nm);
    if (limit_Nm_ > 0.0) {
      const double direction = std::copysign(1.0, increment_rad);
      force_Nm_ = direction * limit_Nm_ *
                  advance(direction * force_Nm_ / limit_Nm_, std::abs(increment_rad * per_knee_));
    } else {
      force_Nm_ = 0.0;
    }
    return force_Nm_;
  }

  /// @returns the energy [J] held, F² / 2k with k = f / X of the last step
  [[nodiscard]] double energy() const noexcept {
    return limit_Nm_ > 0.0 ? 0.5 * force_Nm_ * force_Nm_ * parameters_.knee_rad / limit_Nm_ : 0.0;
  }

  /// @returns the largest stiffness [Nm/rad] under this load, f / X: without force and unloading
  [[nodiscard]] double stiffness(double load_Nm) const noexcept {
    return limit(load_Nm) * per_knee_;
  }

 private:
  [[nodiscard]] double limit(double load_Nm) const noexcept {
    return parameters_.constant_Nm + parameters_.load_factor * std::abs(load_Nm);
  }

  /// dz/du = 1 below 0 and 1 − z^1.5 above, over `travel` >= 0.
  /// @param share z = F / f, positive against the motion
  /// @returns z inside -1..1
  [[nodiscard]] static double advance(double share, double travel) noexcept {
    if (share < 0.0) {
      if (travel <= -share) return std::max(-1.0, share + travel);
      travel += share;
      share = 0.0;
    }
    constexpr double kSettled = 24.0;  // what is missing to 1, exp(-1.5 u), is below its last bit
    // 1 - z^1.5 <= 1.5 (1 - z): a step up to 2/3 ends below 1.
    constexpr double kLongestStep = 0.5;
    return bouc_wen_loading(share, travel, kLongestStep, kSettled,
                            [](double z) { return z * std::sqrt(z); });
  }

  Parameters parameters_;
  double per_knee_;  ///< 1 / X
  double force_Nm_ = 0.0;
  double limit_Nm_ = 0.0;
};

}  // namespace torsio
