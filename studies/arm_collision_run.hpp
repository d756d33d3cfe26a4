#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {

/// A collision of the flange of `arm6_setup` with a plate of 75 N/mm, at 0.5 m/s along an axis of the base.
struct ArmCollision {
  std::size_t axis = 0;  ///< 0 to 2: x, y, z
  double payload_kg = 8.0;
  double plate_kg = 0.0;  ///< 0: clamped
  ContactReaction reaction = ContactReaction::none;
  std::optional<ContactDetector::Settings> contacts = {};
  std::uint64_t seed = 1;
};

/// From rest in a bent pose the flange moves along a line, has its speed for 80 mm, touches the plate, and would stop 100 mm
/// after that.
/// @throws Error if it does not reach the plate.
[[nodiscard]] ArmRun collide(const ArmCollision& collision);

/// `arm6_setup` with another payload.
[[nodiscard]] ArmSetup collision_setup(double payload_kg);

/// The largest force in the first 40 ms [N] of the same motion under a proportional and derivative loop on the rotors alone,
/// which needs no torque of the springs, with springs so many times as stiff as those of the arm.
/// @throws Error if it does not reach the plate.
[[nodiscard]] double first_peak(const ArmCollision& collision, double stiffness_factor);

}  // namespace torsio
