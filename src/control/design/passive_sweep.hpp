#pragma once

#include "control/design/loop_design.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"

namespace torsio {

/// The largest stiffness, from a thousandth of `unit_Nm_rad` to ten times it, up to which the loop
/// that `feedback_of` makes for it is stable, locked and free, and passive up to the frequency; 0 if
/// none is. Re Z >= 0 is passivity only where Z has no unstable poles: they are those of the locked loop.
template <class FeedbackOf>
double highest_passive(const SeriesElasticJoint& joint, double passive_to_rad_s, double unit_Nm_rad,
                       const FeedbackOf& feedback_of) {
  constexpr double kStep = 1.05;
  constexpr int kSteps = 189;  // to ten times the unit
  double found = 0.0;
  double stiffness = 1e-3 * unit_Nm_rad;
  for (int n = 0; n < kSteps; ++n, stiffness *= kStep) {
    const JointFeedback loop = feedback_of(stiffness);
    if (!is_stable_closed(open_loop(joint, loop, JointOutput::locked)) ||
        !is_stable_closed(open_loop(joint, loop, JointOutput::free)) ||
        !(passivity(joint, loop).passive_to_rad_s >= passive_to_rad_s))
      break;
    found = stiffness;
  }
  return found;
}

}  // namespace torsio
