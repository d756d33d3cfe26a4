#pragma once

#include <algorithm>
#include <cmath>

#include "parts/bristle.hpp"
#include "parts/stribeck.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// LuGre friction with a load-dependent level and a bristle of constant stiffness.
///
///     g(v) = F_c (1 + (r − 1) exp(−(v / v_s)²)),  F_c = F₀ + μ |load|,  σ₀ = r F₀ / z₀
///     Ḟ = σ₀ v (1 − F sgn(v) / g),  |F| ≤ r F_c,  τ = F + F_v v
///
/// F is the bristle's force and the state; z₀ its break-away angle [rad] without load. σ₀ follows
/// neither speed nor load, since then F v − d/dt (F² / 2σ₀) = |v| F² / g >= 0: whatever speed and
/// load do, what the bristle gives back it was given. The clip, where the level shrinks, only loses.
/// At constant speed and load F approaches g exponentially, and the step uses that exact solution:
/// explicit Euler is unstable at motor speed. Source: Canudas de Wit et al. 1995; specification
/// 4.1.
class LuGreFriction {
 public:
  struct Parameters {
    double coulomb_Nm = 0.0;       ///< F₀
    double load_factor = 0.0;      ///< μ
    double static_ratio = 1.0;     ///< r
    double stribeck_rad_s = 1.0;   ///< v_s
    double bristle_rad = 1.0;      ///< z₀
    double viscous_Nms_rad = 0.0;  ///< F_v
  };

  /// @throws Error if a value is negative, the ratio below 1, v_s or z₀ not positive, or if there is
  /// a load factor without F₀, for then the bristle has no stiffness.
  explicit LuGreFriction(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset() noexcept { force_Nm_ = 0.0; }

  /// @returns the torque against the motion [Nm]
  double step(double speed_rad_s, double load_Nm, double dt_s) noexcept TORSIO_REALTIME {
    const double viscous_Nm = parameters_.viscous_Nms_rad * speed_rad_s;
    if (is_only_viscous_) return viscous_Nm;
    const double level_Nm = parameters_.coulomb_Nm + parameters_.load_factor * std::abs(load_Nm);
    force_Nm_ = relaxed_bristle(force_Nm_, speed_rad_s, level_Nm * stribeck_(speed_rad_s),
                                stiffness_Nm_rad_, dt_s);
    const double max_Nm = parameters_.static_ratio * level_Nm;
    force_Nm_ = std::min(std::max(force_Nm_, -max_Nm), max_Nm);
    return force_Nm_ + viscous_Nm;
  }

  /// @returns F [Nm], the bristle's share of the last step's torque
  [[nodiscard]] double bristle_torque() const noexcept { return force_Nm_; }
  /// @returns the energy [J] held in the bristle, F² / 2σ₀
  [[nodiscard]] double energy() const noexcept {
    return is_only_viscous_ ? 0.0 : 0.5 * force_Nm_ * force_Nm_ / stiffness_Nm_rad_;
  }
  /// @returns σ₀ [Nm/rad], 0 without dry friction
  [[nodiscard]] double stiffness() const noexcept { return stiffness_Nm_rad_; }
  /// @returns the largest slope [Nm/rad], (1 + r) σ₀: where sliding at rest turns back fast
  [[nodiscard]] double steepest() const noexcept {
    return (1.0 + parameters_.static_ratio) * stiffness_Nm_rad_;
  }

 private:
  Parameters parameters_;
  StribeckCurve stribeck_;
  double stiffness_Nm_rad_;  ///< σ₀
  bool is_only_viscous_;
  double force_Nm_ = 0.0;  ///< F
};

}  // namespace torsio
