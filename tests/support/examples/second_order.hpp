#pragma once

#include "model/second_order/dynamic_bouc_wen.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "support/examples/example.hpp"

namespace torsio::test {

/// Light enough to follow its inputs.
template <>
inline DynamicBoucWen example<DynamicBoucWen>() {
  return DynamicBoucWen({.mass = 1e-6,
                         .damping = 1e-3,
                         .stiffness = 1.0,
                         .hysteretic_stiffness = 0.5,
                         .loss = 2.0,
                         .skew = -1.0,
                         .exponent = 1.5,
                         .gains = {1.0, 0.2},
                         .time = {.sample_period_s = 1e-3},
                         .lowest = -5000.0,
                         .highest = 5000.0});
}

/// With every term.
template <>
inline RigidDrive example<RigidDrive>() {
  return RigidDrive({.inertia = 0.01,
                     .viscous = 0.02,
                     .coulomb = 0.05,
                     .offset = 0.01,
                     .static_ratio = 1.5,
                     .stribeck_speed = 0.1,
                     .bristle = 1e-3,
                     .viscous_asymmetry = 0.01,
                     .viscous_quadratic = 0.01,
                     .spring = 0.02,
                     .coulomb_slope = 0.1,
                     .gains = {1.0, 0.2},
                     .time = {.sample_period_s = 1e-3},
                     .lowest = -5000.0,
                     .highest = 5000.0});
}

}  // namespace torsio::test
