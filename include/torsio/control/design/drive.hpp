#pragma once

namespace torsio {

/// The parameters of the motor and gear that drive a joint, as a controller uses them.
struct Drive {
  double ratio = 1.0;                    ///< N, turns of the rotor per turn of the joint
  double torque_constant_Nm_A = 0.0;     ///< k_t, at the rotor
  double rotor_inertia_kg_m2 = 0.0;      ///< J
  double viscous_Nms_rad = 0.0;          ///< motor and gear, referred to the joint
  double coulomb_Nm = 0.0;               ///< motor and gear, referred to the joint
  double rated_current_A = 0.0;          ///< for any length of time
  double peak_current_A = 0.0;           ///< for a moment
  double current_time_constant_s = 0.0;  ///< current loop
  double supply_V = 0.0;
  double resistance_Ohm = 0.0;

  /// @returns N k_t [Nm/A]: the torque at the joint that a current makes
  [[nodiscard]] double torque_per_current() const noexcept { return ratio * torque_constant_Nm_A; }
  /// @returns J N² [kg m²]: the rotor's inertia referred to the joint
  [[nodiscard]] double inertia() const noexcept { return rotor_inertia_kg_m2 * ratio * ratio; }

  /// @throws Error if a value is not finite, friction negative, another not positive, or the peak
  /// current below the rated one.
  void check() const;
};

}  // namespace torsio
