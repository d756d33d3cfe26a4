#pragma once

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/differentiator.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The current that is used up by friction and by other effects that are not in the joint's
/// equation:
///
///     d = Q (i − (J N² θ̈ + K δ) / (N k_t))
///
/// with Q a second-order low-pass, θ̈ the second difference of the rotor's angle over the ratio, and i
/// the current of the tick before. Added to the command it makes the drive behave as without friction
/// below the cut-off. Source: Ohnishi et al. 1996; the form is ours.
class DisturbanceObserver {
 public:
  /// @throws Error if the joint is impossible, or as `Lowpass` does.
  DisturbanceObserver(const SeriesElasticJoint& joint, double cutoff_Hz, double sample_rate_Hz);

  void reset() noexcept;

  /// @param applied_A of the tick before
  /// @returns d [A]; without two differences yet, 0
  double step(double applied_A, double motor_angle_rad,
              double deflection_rad) noexcept TORSIO_REALTIME;

  /// How a loop changes when d is added to its command. Allocates.
  [[nodiscard]] JointFeedback with(const JointFeedback& loop) const;

 private:
  SeriesElasticJoint joint_;
  double cutoff_Hz_;
  double inverse_ratio_;
  double inertia_As2_rad_;
  double stiffness_A_rad_;
  Differentiator speed_;
  Differentiator acceleration_;
  Lowpass lowpass_;
};

}  // namespace torsio
