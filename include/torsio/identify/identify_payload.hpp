#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "torsio/arm/arm_model.hpp"
#include "torsio/identify/identification.hpp"

namespace torsio {

/// What is assumed of the torques and of the links, each with one standard deviation. A value of 0: exact.
struct IdentificationOptions {
  double window_s = 0.25;              ///< length of a window
  double speed_window_s = 0.03;        ///< angles whose regression slope is the speed
  double friction_speed_rad_s = 0.02;  ///< v₀ of the dry friction F tanh(q̇ / v₀)
  /// Share by which each joint's torque may be wrong as a whole; 0: exact.
  double torque_scale_share = 0.01;
  /// The same as a share of the joint's largest torque (`ArmJoint::effort_Nm`), over the RMS of its torque in the motion: a small torque
  /// is wrong by more, since friction within the spring carries it.
  double torque_floor_share = 0.002;
  /// Share by which mass and inertia of each link may differ from the model's, and `link_com_m` by
  /// how much its centre of mass. Payload only: 0, the links are those of the model.
  double link_share = 0.0;
  double link_com_m = 0.0;
  /// Expected friction of each bearing, one per joint; empty: 0. It is estimated, with a standard
  /// deviation of 2 % of the joint's largest torque (at 1 rad/s for the viscous one).
  std::vector<double> dry_Nm = {};
  std::vector<double> viscous_Nms_rad = {};
};

struct IdentifiedPayload {
  IdentifiedQuantity mass_kg = {};
  std::array<IdentifiedQuantity, 3> com_m = {};  ///< in the frame of the flange
  /// xx, yy, zz, xy, xz, yz about the centre of mass.
  std::array<IdentifiedQuantity, 6> inertia_kg_m2 = {};
  std::vector<IdentifiedJoint> joints = {};
  IdentificationData data = {};

  /// The payload as far as it is determined: a coordinate that is not is 0, an inertia of which a part
  /// is not, or which no body has, is that of a point mass.
  [[nodiscard]] BodyInertia body() const;
};

/// Mass, centre of mass and inertia of what an arm carries, from the torques of its joints. The
/// momentum p = M(q) q̇ changes in a window from t₁ to t₂ by
///
///     p(t₂) − p(t₁) = ∫ (τ + ∂T/∂q − g) dt,   τ = τ_est − F tanh(q̇ / v₀) − d q̇
///
/// which is linear in mass m, moment m c and inertia about the flange's origin, and in the nuisance
/// parameters: dry and viscous friction of each joint, and the links' if they are not exact.
/// No acceleration is needed; q̇ is the regression slope of 2 x 15 ms of angles, without delay.
/// Least squares with the joints weighted by the variance of their residuals, and with the standard
/// deviations of `IdentificationOptions` as prior; m, m c and the inertia have a prior of 50 kg, 20
/// kg m and 10 kg m2 about 0, which only matters where the motion determines nothing.
///
/// The residuals of neighbouring windows are alike. The standard errors are the larger ones of two: a
/// jackknife over blocks of at least twice the correlation time, each with all joints (CR3 of Bell & McCaffrey
/// 2002), and the inverse of the information matrix with the weights reduced by the correlation time.
///
/// A quantity is not determined, and has the reason, if its standard error is above 10 % of the mass
/// (or of 1 kg), 30 mm for a coordinate, half of the largest moment of inertia for the inertia.
///
/// Momentum: De Luca & Mattone 2003; linearity in the parameters: Atkeson, An & Hollerbach 1986.
///
/// @param arm its own payload is not used
/// @throws Error as `require_motion`, or if the motions are shorter than 24 windows together; UsageError
/// if an option is out of range.
[[nodiscard]] IdentifiedPayload identify_payload(const ArmModel& arm,
                                                 std::span<const ArmMotion> motions,
                                                 const IdentificationOptions& options = {});

}  // namespace torsio
