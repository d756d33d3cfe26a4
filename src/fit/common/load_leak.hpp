#pragma once

#include <string>

#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// The first input that is the computation of a known load's torque, gravity sin(q) + inertia q'', or a part of it; empty:
/// none. It contains an angle or an acceleration of one side of the spring by itself: `joint_angle_rad`,
/// `sin(joint_angle_rad)`, `rate(joint_speed_rad_s)`, and `gear_angle_rad`, which is the same but for the deflection. A
/// model would learn the load from it, not the spring. Not meant are deflections, differences of both sides, the twist
/// between two sensors of the drive, `motor_angle_rad / 2 - wave_generator_angle_rad`, and speeds of one side, on which the
/// torque of a load does not depend.
[[nodiscard]] std::string load_leak(const FeatureSpec& spec);

}  // namespace torsio
