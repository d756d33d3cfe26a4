#pragma once

#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// LuGre friction with a load-dependent level.
///
///     g(v) = F_c + (F_s − F_c) exp(−(v / v_s)²),  F_c = F₀ + μ |load|,  F_s = r F_c
///     ζ̇ = |v| (sgn v − ζ) / z₀,   τ = g ζ + F_v v
///
/// ζ is the bristle deflection over its break-away value z₀ [rad] (stiffness g / z₀). At constant
/// speed ζ decays exponentially, and the step uses that exact solution: explicit Euler is unstable
/// at motor speed. Source: Canudas de Wit et al. 1995; SPEC section 4.1.
class LuGreFriction {
 public:
  struct Parameters {
    double coulomb_Nm = 0.0;       ///< F₀
    double load_factor = 0.0;      ///< μ
    double static_ratio = 1.0;     ///< r = F_s / F_c
    double stribeck_rad_s = 1.0;   ///< v_s
    double bristle_rad = 1.0;      ///< z₀
    double viscous_Nms_rad = 0.0;  ///< F_v
  };

  /// @throws Error if a value is negative, the ratio below 1, or v_s or z₀ not positive.
  explicit LuGreFriction(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset() noexcept { bristle_ = 0.0; }

  /// @returns the torque against the motion [Nm]
  double step(double speed_rad_s, double load_Nm, double dt_s) noexcept TORSIO_REALTIME {
    const double viscous_Nm = parameters_.viscous_Nms_rad * speed_rad_s;
    if (is_only_viscous_) return viscous_Nm;
    double level_Nm = parameters_.coulomb_Nm + parameters_.load_factor * std::abs(load_Nm);
    if (parameters_.static_ratio > 1.0) level_Nm *= stribeck(speed_rad_s);
    if (speed_rad_s != 0.0) relax(speed_rad_s, dt_s);
    return level_Nm * bristle_ + viscous_Nm;
  }

  /// @returns the stiffness [Nm/rad] at rest under this load
  [[nodiscard]] double stiffness(double load_Nm) const noexcept;

 private:
  [[nodiscard]] double stribeck(double speed_rad_s) const noexcept {
    const double exponent = speed_rad_s * speed_rad_s * inverse_stribeck_squared_;
    if (exponent > 40.0) return 1.0;  // exp(-40) is below the last bit of 1
    return 1.0 + (parameters_.static_ratio - 1.0) * std::exp(-exponent);
  }

  void relax(double speed_rad_s, double dt_s) noexcept {
    const double target = std::copysign(1.0, speed_rad_s);
    const double distance = bristle_ - target;
    if (std::abs(distance) < 1e-15) {
      bristle_ = target;
      return;
    }
    bristle_ = target + distance * std::exp(-std::abs(speed_rad_s) * dt_s * inverse_bristle_);
  }

  Parameters parameters_;
  double inverse_stribeck_squared_;
  double inverse_bristle_;
  bool is_only_viscous_;
  double bristle_ = 0.0;  ///< ζ
};

}  // namespace torsio
