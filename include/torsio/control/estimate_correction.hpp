#pragma once

#include <cstddef>
#include <limits>

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Corrects the torque of a controller by the estimate of any model, slowly enough not to act
/// against the controller:
///
///     c[n+1] = c[n] + ω T (τ*[n] − τ̂[n]),   |c| <= τ_max
///
/// τ* is the wanted torque and τ̂ the estimate, in Nm at the joint, and T the period [s]; the
/// controller is given τ* + c. Below ω the torque follows the model, above it the controller's own
/// spring. For a model that has no inverse; one that has is better as the inverse of a
/// `TorqueController`. Ours.
class EstimateCorrection {
 public:
  struct Settings {
    double bandwidth_rad_s = 6.0;                                ///< ω
    double torque_Nm = std::numeric_limits<double>::infinity();  ///< τ_max
    double fault_decay_s = 0.1;  ///< decay of c while the estimate has a fault
  };

  /// @throws Error if a setting or the sample rate is not positive, or the bandwidth [rad/s] above a
  /// tenth of the sample rate [Hz].
  EstimateCorrection(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept { correction_Nm_ = 0.0; }

  /// c holds while the command is limited, and decays while the estimate has a fault or the wanted
  /// torque is not finite.
  /// @returns c, for the next command
  double step(double wanted_Nm, const Estimate& estimate, bool is_limited) noexcept TORSIO_REALTIME;
  [[nodiscard]] double correction_Nm() const noexcept { return correction_Nm_; }

 private:
  double gain_;
  double max_Nm_;
  double fault_keep_;
  double correction_Nm_ = 0.0;
};

/// The feedback of a loop with the correction, the estimate being K δ:
///
///     C_δ + G ω T / (z − 1) K H,   C_q + G ω T / (z − 1) Z
///
/// H is 1, or for an estimator that is stepped at every `ticks_per_estimate`-th tick and held in between an
/// approximation of this by a low-pass, valid up to a third of the rate of the estimates.
///
/// Allocates. @throws Error if the systems have different sample rates.
/// @param impedance Z, from the joint's angle [rad] to −τ* [Nm]
/// @param torque_path G, from the torque reference [Nm] to the current [A]
[[nodiscard]] JointFeedback corrected_feedback(const JointFeedback& loop,
                                               const LinearSystem& impedance,
                                               const LinearSystem& torque_path,
                                               double stiffness_Nm_rad, double bandwidth_rad_s,
                                               std::size_t ticks_per_estimate = 1);

}  // namespace torsio
