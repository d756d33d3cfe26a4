#pragma once

#include <cmath>
#include <numbers>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// One quantity of the three phases of a motor; in a motor without a neutral wire the currents add
/// up to zero.
struct ThreePhase {
  double a = 0.0;
  double b = 0.0;
  double c = 0.0;
};

/// The same quantity in axes that turn with the rotor: d along its flux, q a quarter of an
/// electrical turn ahead. Its magnitude is the amplitude of the phases.
struct DirectQuadrature {
  double d = 0.0;
  double q = 0.0;
};

/// The electrical angle of the rotor, as its sine and cosine.
struct ElectricalAngle {
  double sine = 0.0;
  double cosine = 1.0;

  [[nodiscard]] static ElectricalAngle of(double angle_rad) noexcept {
    return {std::sin(angle_rad), std::cos(angle_rad)};
  }

  /// The angle plus this one. A small one, as of a period, is added by a series (error below 1e-10).
  [[nodiscard]] ElectricalAngle turned_by(double angle_rad) const noexcept TORSIO_REALTIME {
    const ElectricalAngle by = std::abs(angle_rad) < 0.3 ? of_small(angle_rad) : of(angle_rad);
    return {sine * by.cosine + cosine * by.sine, cosine * by.cosine - sine * by.sine};
  }

 private:
  /// Taylor series to the seventh and eighth power.
  [[nodiscard]] static ElectricalAngle of_small(double x) noexcept {
    const double y = x * x;
    return {x * (1.0 + y * (-1.0 / 6.0 + y * (1.0 / 120.0 - y * (1.0 / 5040.0)))),
            1.0 + y * (-0.5 + y * (1.0 / 24.0 + y * (-1.0 / 720.0 + y * (1.0 / 40320.0))))};
  }
};

/// d + j q = 2/3 (a + b e^{j 2π/3} + c e^{−j 2π/3}) e^{−j θ} (Clarke and Park, amplitude-invariant).
[[nodiscard]] inline DirectQuadrature rotor_axes(const ThreePhase& phases,
                                                 ElectricalAngle angle) noexcept TORSIO_REALTIME {
  const double alpha = (2.0 * phases.a - phases.b - phases.c) / 3.0;
  const double beta = (phases.b - phases.c) * std::numbers::inv_sqrt3;
  return {alpha * angle.cosine + beta * angle.sine, beta * angle.cosine - alpha * angle.sine};
}

/// The inverse of `rotor_axes` for phases that add up to zero.
[[nodiscard]] inline ThreePhase phases_of(const DirectQuadrature& axes,
                                          ElectricalAngle angle) noexcept TORSIO_REALTIME {
  const double alpha = axes.d * angle.cosine - axes.q * angle.sine;
  const double beta = axes.d * angle.sine + axes.q * angle.cosine;
  const double half = -0.5 * alpha;
  const double side = 0.5 * std::numbers::sqrt3 * beta;
  return {alpha, half + side, half - side};
}

}  // namespace torsio
