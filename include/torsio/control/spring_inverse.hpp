#pragma once

#include <concepts>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Computes the deflection [rad] that gives a wanted torque from the joint's measurements in this
/// tick. The value is finite in every case; `fault` reports where it is not that of a model within its data. A
/// user-defined inverse satisfies this concept. One that also has `follow(rad) noexcept` receives
/// after each step the deflection that the loop really requested, which a limit may have cut.
template <class I>
concept SpringInverse =
    std::copyable<I> && requires(I inverse, double torque_Nm, const JointSample& sample) {
      { inverse.reset() } noexcept;
      { inverse.step(torque_Nm, sample) } noexcept -> std::same_as<Estimate>;
    };

/// δ = (τ − b) / K: the linear inverse, the baseline for every learned one.
class LinearInverse {
 public:
  /// @throws Error if the stiffness is not positive, or a value not finite.
  explicit LinearInverse(double stiffness_Nm_rad, double offset_Nm = 0.0);

  void reset() noexcept {}
  Estimate step(double torque_Nm, const JointSample& /*sample*/) const noexcept TORSIO_REALTIME {
    return {.value = (torque_Nm - offset_Nm_) / stiffness_Nm_rad_};
  }

 private:
  double stiffness_Nm_rad_;
  double offset_Nm_;
};

}  // namespace torsio
