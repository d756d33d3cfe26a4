#pragma once

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
/// τ* is the wanted torque and τ̂ the estimate; the controller is given τ* + c. Below ω the torque
/// follows the model, above it the controller's own spring. For a model that has no inverse; one
/// that has is better as the inverse of a `TorqueController`. Ours.
class EstimateCorrection {
 public:
  struct Settings {
    double bandwidth_rad_s = 6.0;                                ///< ω
    double torque_Nm = std::numeric_limits<double>::infinity();  ///< τ_max
    double fault_decay_s = 0.1;  ///< decay of c while the estimate has a fault
  };

  /// @throws Error if a setting is not positive, or the bandwidth above a tenth of the sample rate.
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

/// The feedback of a loop with the correction, the estimate being K δ. Allocates.
/// @param impedance from the joint's angle to −τ*
/// @param torque_path from the torque reference to the current
[[nodiscard]] JointFeedback corrected_feedback(const JointFeedback& loop,
                                               const LinearSystem& impedance,
                                               const LinearSystem& torque_path,
                                               double stiffness_Nm_rad, double bandwidth_rad_s);

}  // namespace torsio
