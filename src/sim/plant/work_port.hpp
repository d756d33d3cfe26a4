#pragma once

namespace torsio {

/// A torque and the speed at which it works, for the energy audit.
struct WorkPort {
  enum class Kind {
    input,       ///< into the plant
    loss,        ///< out of it, as heat
    hysteretic,  ///< into elements that keep a part of it and turn the rest to heat
  };
  Kind kind = Kind::loss;
  double torque_Nm = 0.0;        ///< over the last step
  double speed_rad_s = 0.0;      ///< after it
  double viscous_Nms_rad = 0.0;  ///< adds this times the speed before the step to the torque
  double stored_J = 0.0;         ///< what a hysteretic element keeps of its work
};

/// What is stored in a plant and its load.
struct StoredEnergy {
  double all_J = 0.0;
  double hysteretic_J =
      0.0;  ///< the share in bristles, slip and viscoelastic elements and the obstacle
};

/// ½ x², of which energies are made.
[[nodiscard]] inline double half_square(double value) noexcept { return 0.5 * value * value; }

}  // namespace torsio
