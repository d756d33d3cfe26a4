#pragma once

#include <cmath>
#include <cstddef>

#include "sim/plant/plant.hpp"

// Checks of a plant's inputs; a plant with a refused input is not changed and has
// Fault::input_not_finite.

namespace torsio {

inline bool is_usable(const PlantCommand& command, const Load& load) noexcept {
  return load.inertia_kg_m2 >= 0.0 && !std::isnan(load.wall_angle_rad) &&
         load.wall_stiffness_Nm_rad >= 0.0 && load.wall_damping_Nms_rad >= 0.0 &&
         std::isfinite(command.current_A + load.inertia_kg_m2 + load.gravity_Nm +
                       load.external_torque_Nm + load.wall_stiffness_Nm_rad +
                       load.wall_damping_Nms_rad);
}

/// Whether steps follow the obstacle: half a radian of its mode with the joint, half a time
/// constant.
inline bool is_soft_enough(const Load& load, double joint_inertia_kg_m2, double dt_s) noexcept {
  const double inertia_kg_m2 = joint_inertia_kg_m2 + load.inertia_kg_m2;
  return load.wall_stiffness_Nm_rad * dt_s * dt_s <= 0.25 * inertia_kg_m2 &&
         load.wall_damping_Nms_rad * dt_s <= 0.5 * inertia_kg_m2;
}

/// A step is divided into 10^6 small ones at most: it must return.
inline bool is_usable(double dt_s, double longest_step_s) noexcept {
  return dt_s > 0.0 && dt_s <= 1e6 * longest_step_s;
}

/// @returns into how many equal ones a step is divided
inline std::size_t small_steps(double dt_s, double longest_step_s) noexcept {
  return static_cast<std::size_t>(std::ceil(dt_s / longest_step_s * (1.0 - 1e-12)));
}

}  // namespace torsio
