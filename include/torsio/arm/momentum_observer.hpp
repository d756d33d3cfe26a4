#pragma once

#include <cstddef>
#include <span>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The external torque at each joint, from the generalised momentum p = M(q) q̇ and the torque τ of the springs on
/// the links, without differences of a speed:
///
///     r = K (p − ∫ (τ + ∂T/∂q − g + r) dt),   then   τ_ext = low-pass(r) with the same pole K
///
/// so that τ_ext follows what is not in the model through two equal poles, K² / (s + K)². The second one is there
/// for the noise of encoder differences, which a single pole lets through (at 50 rad/s 15 times as much in the
/// 300 Nm joints of the arm of docs/robot/arm.md). De Luca & Mattone (2003); the second pole is ours.
class MomentumObserver {
 public:
  struct Settings {
    double bandwidth_rad_s = 100.0;  ///< K
  };

  /// @throws Error if the number of joints is 0 or above `kMaxArmJoints`, or K is not positive or above a fifth of the
  /// sample rate.
  MomentumObserver(std::size_t joints, const Settings& settings, double sample_rate_Hz);

  void reset() noexcept { is_started_ = false; }

  /// @param torque_Nm on the links: of the springs, less the friction of the joints' bearings
  /// What is not finite is a fault: the last values hold, and the observer begins again with the next finite ones.
  Fault step(const ArmDynamics& dynamics, std::span<const double> angle_rad,
             std::span<const double> speed_rad_s,
             std::span<const double> torque_Nm) noexcept TORSIO_REALTIME;

  /// @returns τ_ext [Nm], one per joint; 0 until the first step
  [[nodiscard]] std::span<const double> external_torque_Nm() const noexcept {
    return std::span(external_Nm_).first(count_);
  }

 private:
  std::size_t count_;
  double bandwidth_rad_s_;
  double period_s_;
  double share_;  ///< first-order low-pass per tick
  bool is_started_ = false;
  ArmDynamics::PerJoint expected_Nms_ = {};  ///< p − r / K
  ArmDynamics::PerJoint residual_Nm_ = {};   ///< r
  ArmDynamics::PerJoint external_Nm_ = {};
};

}  // namespace torsio
