#pragma once

#include <array>
#include <span>

#include "sim/plant/drive_train.hpp"
#include "torsio/arm/arm_model.hpp"

namespace torsio {

/// What limits the steps of an arm that such drive trains move.
struct ArmStepLimits {
  double stiffness_s = 0.0;  ///< a quarter radian of the stiffest mode
  double damping_s = 0.0;    ///< half a time constant of the strongest viscous damping
  /// The smallest inertia [kg m2] that each drive train has at its output, 1 / (M⁻¹)ᵢᵢ: all other
  /// joints free.
  std::array<double, kMaxArmJoints> joint_inertia_kg_m2 = {};
};

/// The stiffest mode is the largest eigenvalue of K x = ω² M(q) x for joints, middle bodies and
/// rotors (with a rigid first stage for joints and middle bodies), the largest one of poses that are
/// drawn within the limits of the joints; the same for the viscous terms. A joint or motor that is
/// held only lowers it. K has the slopes of `steepest_slopes`: all friction sticking under the rated
/// torque.
/// @param drives one per joint
[[nodiscard]] ArmStepLimits arm_step_limits(const ArmModel& arm,
                                            std::span<const PlantParameters> drives,
                                            FirstStageForm form);

}  // namespace torsio
