#pragma once

#include <cstddef>

#include "torsio/control/design/linear_system.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/pid.hpp"

// Controllers in their linear range, as systems for the design of a loop.

namespace torsio {

/// From the measurement to minus the command, as `Pid` does it between its limits; terms without a
/// gain are left out. Allocates.
[[nodiscard]] LinearSystem linear_pid(const Pid::Gains& gains, double derivative_cutoff_Hz,
                                      double sample_rate_Hz);

/// The feedback of deflection control when a `JointImpedance` gives its reference through the
/// linear spring δ* = τ* / K, q̇ being the low-passed difference of q. Allocates.
[[nodiscard]] JointFeedback impedance_feedback(const DeflectionController& controller,
                                               const JointImpedance::Gains& gains,
                                               double speed_cutoff_Hz);

/// The parts of `corrected_feedback`.
struct CorrectedParts {
  JointFeedback others;
  LinearSystem estimate;  ///< from the deflection that the estimator is given to the current
};
[[nodiscard]] CorrectedParts corrected_parts(const JointFeedback& loop,
                                             const LinearSystem& impedance,
                                             const LinearSystem& torque_path,
                                             double stiffness_Nm_rad, double bandwidth_rad_s);
/// With the estimate held as `slow_hold` approximates it.
[[nodiscard]] JointFeedback all_parts(const CorrectedParts& parts, std::size_t ticks_per_estimate);

}  // namespace torsio
