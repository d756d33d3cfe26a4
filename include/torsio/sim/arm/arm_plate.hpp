#pragma once

#include "torsio/arm/arm_model.hpp"

namespace torsio {

/// A flat plate that the flange of a simulated arm may hit. It carries no force along its face, and the arm's other
/// parts pass through it.
struct ArmPlate {
  bool is_from_flange = true;  ///< `at_m` is measured from where the flange is when the step begins
  Vector3 at_m = {};           ///< a point of its face, along the axes of the base
  Vector3 normal = {0.0, 0.0, 1.0};  ///< out of its face, in the frame of the base, of length 1
  double stiffness_N_m = 75e3;
  double damping_Ns_m = 0.0;
  double mass_kg =
      0.0;  ///< it moves along its normal, without weight and friction; 0: it is clamped
};

}  // namespace torsio
