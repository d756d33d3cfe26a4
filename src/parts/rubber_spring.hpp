#pragma once

#include <cmath>

#include "parts/maxwell_branches.hpp"
#include "parts/maxwell_slip.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A rubber torsion spring: an elastic curve that is stiffer on one side, viscoelastic branches and
/// the amplitude-dependent inner friction of filled rubber (Payne effect).
///
///     τ = s τ_el(u) + Σ zᵢ + F[u],   τ_el = K₀ u + a |u| tanh(|u| / b)
///
/// u deflection [rad], s share of the curve that never relaxes, zᵢ Maxwell branches, F Maxwell-slip
/// elements. The secant tends to K₀ + a for u > 0 and to K₀ − a for u < 0. Source: specification
/// 4.4.
class RubberSpring {
 public:
  struct Parameters {
    double stiffness_Nm_rad = 0.0;  ///< K₀
    double asymmetry_Nm_rad = 0.0;  ///< a
    double blend_rad = 0.0;         ///< b
    double elastic_share = 1.0;     ///< s
    MaxwellBranches<3>::Parameters branches;
    MaxwellSlip<3>::Parameters slip;
  };

  /// @throws Error as its parts do, if stiffness, blend or share is not positive, or if the
  /// asymmetry is so large that the curve falls somewhere.
  explicit RubberSpring(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// Before the first call nothing relaxes.
  void set_period(double dt_s) noexcept { branches_.set_period(dt_s); }

  /// Relaxed at this deflection: the elastic curve alone holds.
  void reset(double deflection_rad = 0.0) noexcept;

  /// @returns the torque on the joint [Nm]
  double step(double deflection_rad, double deflection_rate_rad_s) noexcept TORSIO_REALTIME {
    const double increment_rad = deflection_rad - last_deflection_rad_;
    last_deflection_rad_ = deflection_rad;
    friction_Nm_ =
        branches_.step(increment_rad) + slip_.step(increment_rad, deflection_rate_rad_s, 0.0);
    return elastic_torque(deflection_rad) + friction_Nm_;
  }

  /// @returns s τ_el [Nm]
  [[nodiscard]] double elastic_torque(double deflection_rad) const noexcept TORSIO_REALTIME {
    const double magnitude = std::abs(deflection_rad);
    return parameters_.elastic_share * (parameters_.stiffness_Nm_rad * deflection_rad +
                                        parameters_.asymmetry_Nm_rad * magnitude *
                                            std::tanh(magnitude / parameters_.blend_rad));
  }
  [[nodiscard]] const MaxwellBranches<3>& branches() const noexcept { return branches_; }
  [[nodiscard]] const MaxwellSlip<3>& slip() const noexcept { return slip_; }
  /// @returns the share [Nm] of branches and slip elements in the last step's torque
  [[nodiscard]] double friction_torque() const noexcept { return friction_Nm_; }
  /// @returns the energy [J] of the elastic curve at a deflection, ∫₀ᵘ s τ_el du in closed form
  [[nodiscard]] double elastic_energy(double deflection_rad) const noexcept;
  /// @returns the energy [J] held in branches and slip elements
  [[nodiscard]] double friction_energy() const noexcept {
    return branches_.energy() + slip_.energy();
  }
  /// @returns the deflection [rad] that holds this torque when all is relaxed
  [[nodiscard]] double deflection(double torque_Nm) const noexcept;
  /// @returns the largest stiffness [Nm/rad], with nothing slipping or relaxing
  [[nodiscard]] double steepest(double load_Nm) const noexcept;
  /// @returns 0 [Nms/rad]: what is viscous relaxes, and is part of the friction
  [[nodiscard]] static constexpr double viscosity() noexcept { return 0.0; }

 private:
  Parameters parameters_;
  MaxwellBranches<3> branches_;
  MaxwellSlip<3> slip_;
  double last_deflection_rad_ = 0.0;
  double friction_Nm_ = 0.0;
};

}  // namespace torsio
