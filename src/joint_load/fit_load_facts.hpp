#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "joint_load/load_motion.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// A recording as the fit of facts needs it.
struct LoadedMotion {
  std::string recording;
  JointLoad load = {};  ///< without what is fitted
  LoadMotion motion = {};
  std::vector<double> deflection = {};  ///< input of the spring
  std::size_t half_width = 0;           ///< samples of the polynomial of the motion
};

struct FittedFact {
  double value = 0.0;
  double standard_error = 0.0;
};

struct FittedFacts {
  FittedFact joint_inertia_kg_m2 = {};
  FittedFact zero_rad = {};
};

/// The inertia of the joint's output and its zero, with which one spring explains the torque of all loads:
///
///     gravity sin(q + zero) + (inertia + joint_inertia) q''
///         = a + c x' + sum_i b_i max(x - k_i, 0) + sum_j (d_j + e_j |x|) stop(x, r_j)
///
/// x the deflection, stop(x, r) the stop operator, r_j some shares of the range of x: a spring with hysteresis. By least
/// squares; the zero by Gauss-Newton. Each term goes through the same smoothing without phase, with which the equation
/// still holds, and which removes the noise of q'': in the inertia's term and in the torque at once it would draw
/// joint_inertia towards -inertia. Loads of the same size do not determine them, and the scale of the torque is that of the
/// stated mass: no fit shows its error. The standard error is the larger of two jackknives, over tenths of the recordings
/// and, from three loads on, over the recordings: residuals of a spring are far from white.
/// @throws Error if all loads are the same, or the recordings do not determine what is fitted.
[[nodiscard]] FittedFacts fit_load_facts(const std::vector<LoadedMotion>& motions,
                                         const LoadSheet& sheet);

}  // namespace torsio
