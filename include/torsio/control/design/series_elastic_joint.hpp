#pragma once

#include <complex>

#include "torsio/control/design/drive.hpp"
#include "torsio/control/design/linear_system.hpp"

namespace torsio {

/// A joint with a series spring, the model for controller design; all quantities referred to the
/// joint:
///
///     J N² θ̈ + b θ̇ = N k_t i − K δ,   δ = θ − q,   M q̈ + d q̇ = K δ + τ_ext,   T_i i̇ = i* − i
///
/// θ is the rotor over the ratio. Dry friction, play and the nonlinearity of the spring are not
/// modelled.
struct SeriesElasticJoint {
  Drive drive = {};
  double stiffness_Nm_rad = 0.0;       ///< K
  double joint_inertia_kg_m2 = 0.0;    ///< M, with the load
  double joint_viscous_Nms_rad = 0.0;  ///< d

  /// @throws Error as `Drive::check`, if stiffness or inertia is not positive, or d negative.
  void check() const;
};

/// The boundary condition at the output side of the spring.
enum class JointOutput { locked, free };

/// The feedback of a controller in its linear range, as systems from one measurement to the
/// current: i* = −(C_δ δ + C_θ̇ θ̇ + C_q q), with all references zero.
struct JointFeedback {
  LinearSystem deflection;  ///< C_δ
  LinearSystem speed;       ///< C_θ̇
  LinearSystem joint;       ///< C_q
};

/// Whether the joint, seen from its environment through the spring, is passive.
struct Passivity {
  /// Re Z >= 0 from 0 up to this frequency [rad/s]: contact with a passive environment cannot
  /// excite a motion slower than this. The Nyquist frequency if there is no upper limit.
  double passive_to_rad_s = 0.0;
  double least_Nms_rad = 0.0;  ///< the most negative Re Z up to the Nyquist frequency, or 0
  double least_rad_s = 0.0;    ///< where that is
};

/// The driving-point impedance Z(jω) = −τ / q̇ [Nms/rad] of spring, drive and controller, below the
/// Nyquist frequency. With H(s) = exp(−s T) (1 − exp(−s T)) / (s T (1 + T_i s)) N k_t of delay, hold
/// and current loop (what a sampler folds back is left out):
///
///     Z = K / s · (J N² s² + b s + H (s C_θ̇ + C_q)) / (J N² s² + b s + K + H (C_δ + s C_θ̇))
///
/// The joint's own inertia and friction, M s + d, are not included.
[[nodiscard]] std::complex<double> impedance(const SeriesElasticJoint& joint,
                                             const JointFeedback& feedback, double rad_s);

/// Re Z of `impedance`, swept up to the Nyquist frequency. The joint's own inertia and friction are
/// passive. Two passive systems in contact are stable; one that is not passive is unstable against
/// some, not against all (Colgate & Hogan 1988).
[[nodiscard]] Passivity passivity(const SeriesElasticJoint& joint, const JointFeedback& feedback);

}  // namespace torsio
