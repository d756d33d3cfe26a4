#pragma once

#include "sim/plant/plant_parameters.hpp"

// The slopes of a drive train's torques that limit its step.

namespace torsio {

/// The slopes of the torques between and on the bodies, each over its own twist or angle [Nm/rad], or
/// over its rate [Nms/rad].
struct ChainSlopes {
  double first_ratio = 1.0;
  double second_ratio = 1.0;
  double first = 0.0;      ///< first stage, at its output
  double second = 0.0;     ///< second stage, at its output
  double on_rotor = 0.0;   ///< friction of the rotor
  double on_middle = 0.0;  ///< friction of the middle body
  double on_joint = 0.0;   ///< bearing

  /// The slope of all torques on one body over its own motion.
  [[nodiscard]] double rotor() const noexcept {
    return first / (first_ratio * first_ratio) + on_rotor;
  }
  [[nodiscard]] double middle() const noexcept {
    return first + second / (second_ratio * second_ratio) + on_middle;
  }
  [[nodiscard]] double joint() const noexcept { return second + on_joint; }
  /// Rotor and middle body as one, which turn together over a rigid first stage.
  [[nodiscard]] double rigid_middle() const noexcept {
    return second / (second_ratio * second_ratio) + on_middle +
           on_rotor * first_ratio * first_ratio;
  }
};

/// @returns the largest stiffness [Nm/rad], with all friction sticking, up to the rated torque
[[nodiscard]] ChainSlopes steepest_slopes(const PlantParameters& parameters);
/// @returns the viscous terms [Nms/rad], which a step takes explicitly
[[nodiscard]] ChainSlopes viscous_slopes(const PlantParameters& parameters);

}  // namespace torsio
