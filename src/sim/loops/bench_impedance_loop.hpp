#pragma once

#include <cmath>

#include "sim/plant/plant.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The impedance controller of an actuator with a torsion tube before its harmonic drive.
///
///     θ_s* = K_pp (θ_a* − θ_a),   τ_m = K_tp (θ_s* − θ),   i = τ_m / k_t
///     θ = θ_m / N_g − θ_w         the twist of the tube (θ_s)
///     θ = θ_m / N_g − N_h θ_a     that of tube and gear together (θ_s1)
///
/// θ_m, θ_w, θ_a are the angles of rotor, wave generator and output. The motor limits the current;
/// the loop has no memory. Source: specification 3.11.
class BenchImpedanceLoop {
 public:
  struct Gains {
    double position = 0.0;       ///< K_pp [-]
    double torque_Nm_rad = 0.0;  ///< K_tp
  };
  static constexpr Gains kHigh = {15.0, 5.0};
  static constexpr Gains kZero = {0.0, 0.5};

  /// What is fed back. A rigid tube twists too little for its encoders.
  enum class Twist { tube, tube_and_gear };

  /// @throws Error if the plant has not two gears, or a gain is negative or not finite.
  BenchImpedanceLoop(const PlantParameters& plant, const Gains& gains, Twist twist);

  /// @param wanted_rad θ_a*
  /// @returns the motor current [A]; 0 if an angle is not finite
  [[nodiscard]] double step(double wanted_rad, double rotor_angle_rad, double middle_angle_rad,
                            double joint_angle_rad) const noexcept TORSIO_REALTIME {
    const double position_error_rad =
        twist_ == Twist::tube ? middle_angle_rad : gear_ratio_ * joint_angle_rad;
    const double twist_rad = rotor_angle_rad * inverse_tube_ratio_ - position_error_rad;
    const double wanted_twist_rad = gains_.position * (wanted_rad - joint_angle_rad);
    const double torque_Nm = gains_.torque_Nm_rad * (wanted_twist_rad - twist_rad);
    return std::isfinite(torque_Nm) ? torque_Nm * inverse_torque_constant_ : 0.0;
  }

 private:
  Gains gains_;
  Twist twist_;
  double inverse_tube_ratio_ = 1.0;
  double gear_ratio_ = 1.0;
  double inverse_torque_constant_;
};

}  // namespace torsio
