#pragma once

#include <array>
#include <cmath>

#include "parts/maxwell_slip.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A strain-wave gear: kinematic error twice and four times a wave-generator turn, elasticity,
/// damping and torsional hysteresis.
///
///     φ = θ_m / N + ε(θ_m) − q_g,   ε = A₂ sin(2θ_m + α₂) + A₄ sin(4θ_m + α₄)
///     τ_h = K_h φ + D_h φ̇ + F[φ]             on the gear's output
///     τ_h (1 / N + ε′(θ_m))                   back on the rotor
///
/// The error acts on the rotor by the same slope with which it moves the output (virtual work), so
/// that it can store but not create energy. Source: specification 4.1.
class Gear {
 public:
  struct Parameters {
    double ratio = 1.0;                       ///< N
    std::array<double, 2> error_rad{};        ///< A₂, A₄ at the output
    std::array<double, 2> error_phase_rad{};  ///< α₂, α₄
    double stiffness_Nm_rad = 0.0;            ///< K_h
    double damping_Nms_rad = 0.0;             ///< D_h
    double hysteresis_Nm = 0.0;               ///< half width of the torque loop
    double break_away_rad = 1.0;              ///< break-away angle of the hysteresis element
  };
  struct Output {
    double torque_Nm = 0.0;        ///< on the gear's output
    double rotor_torque_Nm = 0.0;  ///< on the rotor, against a positive torque_Nm
  };

  /// @throws Error if ratio, stiffness or break-away is not positive, or another value is negative.
  explicit Gear(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// Relaxed hysteresis at these angles.
  void reset(double rotor_angle_rad, double output_angle_rad) noexcept;

  Output step(double rotor_angle_rad, double rotor_speed_rad_s, double output_angle_rad,
              double output_speed_rad_s) noexcept TORSIO_REALTIME {
    const Kinematics motion = kinematics(rotor_angle_rad);
    const double twist_rad = motion.angle_rad - output_angle_rad;
    const double increment_rad = twist_rad - twist_rad_;
    twist_rad_ = twist_rad;
    twist_rate_rad_s_ = motion.slope * rotor_speed_rad_s - output_speed_rad_s;
    hysteresis_Nm_ = hysteresis_.step(increment_rad, twist_rate_rad_s_, 0.0);
    const double torque_Nm = parameters_.stiffness_Nm_rad * twist_rad + hysteresis_Nm_ +
                             parameters_.damping_Nms_rad * twist_rate_rad_s_;
    return {torque_Nm, torque_Nm * motion.slope};
  }

  /// The gear's output angle without load, and its slope over the rotor angle.
  struct Kinematics {
    double angle_rad = 0.0;  ///< θ_m / N + ε
    double slope = 0.0;      ///< 1 / N + ε′
  };
  [[nodiscard]] Kinematics kinematics(double rotor_angle_rad) const noexcept TORSIO_REALTIME {
    if (!has_error_) return {rotor_angle_rad * inverse_ratio_, inverse_ratio_};
    // One sine and cosine of 2θ give those of 4θ by the double angle.
    const double sine2 = std::sin(2.0 * rotor_angle_rad);
    const double cosine2 = std::cos(2.0 * rotor_angle_rad);
    const double sine4 = 2.0 * sine2 * cosine2;
    const double cosine4 = 1.0 - 2.0 * sine2 * sine2;
    return {rotor_angle_rad * inverse_ratio_ + in_phase_[0] * sine2 + quadrature_[0] * cosine2 +
                in_phase_[1] * sine4 + quadrature_[1] * cosine4,
            inverse_ratio_ + 2.0 * (in_phase_[0] * cosine2 - quadrature_[0] * sine2) +
                4.0 * (in_phase_[1] * cosine4 - quadrature_[1] * sine4)};
  }

  /// @returns φ [rad], φ̇ [rad/s] and the hysteresis torque [Nm] of the last step
  [[nodiscard]] double twist() const noexcept { return twist_rad_; }
  [[nodiscard]] double twist_rate() const noexcept { return twist_rate_rad_s_; }
  [[nodiscard]] double hysteresis_torque() const noexcept { return hysteresis_Nm_; }
  /// @returns the energy [J] in the hysteresis element
  [[nodiscard]] double hysteresis_energy() const noexcept { return hysteresis_.energy(); }
  /// @returns the stiffness [Nm/rad] while the hysteresis element sticks
  [[nodiscard]] double steepest() const noexcept {
    return parameters_.stiffness_Nm_rad + hysteresis_.stiffness(0.0);
  }

 private:
  Parameters parameters_;
  double inverse_ratio_;
  bool has_error_;
  std::array<double, 2> in_phase_{};    ///< A cos α
  std::array<double, 2> quadrature_{};  ///< A sin α
  MaxwellSlip<1> hysteresis_;
  double twist_rad_ = 0.0;
  double twist_rate_rad_s_ = 0.0;
  double hysteresis_Nm_ = 0.0;
};

}  // namespace torsio
