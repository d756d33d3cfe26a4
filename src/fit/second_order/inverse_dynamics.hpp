#pragma once

#include <vector>

#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// J, Fv, Fc and offset of g u = J q'' + Fv q' + Fc sgn q' + offset.
struct DriveGuess {
  double inertia = 0.0;
  double viscous = 0.0;
  double coulomb = 0.0;
  double offset = 0.0;
};

struct InverseDynamics {
  std::vector<DriveGuess> guesses;  ///< at least one
  double largest_speed = 0.0;       ///< > 0
};

/// Least squares of the force on what the target does, both smoothed by parabolas over the same
/// windows: three widths, since none fits every noise. Samples slower than a twentieth of the
/// largest speed, whose direction is doubtful, are left out. A guess to start a search from, not an
/// estimate: feedback and noise bias it. Source: Gautier, Janot and Vandanjon 2013.
/// @throws Error if no width finds an inertia, for example because the target moves in one direction
/// only or against the force.
[[nodiscard]] InverseDynamics inverse_dynamics(const TrainingData& data, double gain);

}  // namespace torsio
