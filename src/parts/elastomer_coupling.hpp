#pragma once

#include <array>
#include <cstddef>

#include "parts/creep_chain.hpp"
#include "parts/maxwell_branches.hpp"
#include "parts/maxwell_slip.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A shaft coupling of elastomer lobes: linear viscoelasticity, followed by a monotone output
/// curve, and dry inner friction.
///
///     τ = c (g(T) + F),   g(T) = c₁ w + c₂ w² + c₃ w³,   w = T / c₁
///
/// T is the torque of a CreepChain [Nm], F that of Maxwell-slip elements; g is held constant
/// outside the range around 0 where it rises. What is stored, G(T)/k + Σ G(kⱼ xⱼ)/kⱼ with G = ∫ g,
/// only ever loses against the work, Σ (g(T) − g(kⱼ xⱼ)) ẋⱼ, because g rises. Source: specification
/// 2.1 (a), 4.3 and 4.7; paper 003, Eq. 3.
///
/// *Unbonded*, each direction is carried by lobes of their own, 1/1.4 as stiff, that can only be
/// pressed: they lose contact where their torque would turn, creep back without load, and meet the
/// shaft again. The limits of F then grow with |g(T)|, so that loops meet at 0.
///
/// *Glue creep*: c falls by a share a load cycle, where the torque passes 0.
class ElastomerCoupling {
 public:
  struct Parameters {
    double stiffness_Nm_rad = 0.0;                      ///< stiffness of the relaxed coupling
    MaxwellBranches<3>::Parameters branches;            ///< the slowest first
    std::array<double, 3> output_Nm = {1.0, 0.0, 0.0};  ///< c₁, c₂, c₃; c₃ < 0 or linear
    MaxwellSlip<3>::Parameters slip;                    ///< its limits constant: load_factor 0
    bool bonded = true;
    double unbonded_softening = 1.4;    ///< bonded over unbonded stiffness
    double slip_load_Nm = 6.0;          ///< from where unbonded slip limits are full
    double creep_per_cycle = 0.0;       ///< share of c lost in a load cycle
    double cycle_dead_band_rad = 0.01;  ///< a cycle goes beyond it to both sides
  };

  /// @throws Error as its parts do, if a factor, load or band is out of range, or if the output
  /// curve has no range in which it rises around 0.
  explicit ElastomerCoupling(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] const CreepChain& chain() const noexcept { return chain_; }

  /// Before the first call nothing relaxes.
  void set_period(double dt_s) noexcept { chain_.set_period(dt_s); }

  /// Relaxed at this deflection, the glue as new.
  void reset(double deflection_rad = 0.0) noexcept;

  /// @returns the torque on the joint [Nm]
  double step(double deflection_rad, double deflection_rate_rad_s) noexcept TORSIO_REALTIME;

  /// @returns c, 1 before the first cycle
  [[nodiscard]] double glue() const noexcept { return glue_; }
  /// The direction of torque that lobes carry; bonded ones carry both, as `positive`.
  enum class Side { positive, negative };
  /// @returns the creep [rad] of the elements of one side's chain
  [[nodiscard]] const CreepChain::Vector& creep(Side side) const noexcept {
    return lobes_[side == Side::positive ? 0 : 1].creep_rad;
  }
  [[nodiscard]] const MaxwellSlip<3>& slip() const noexcept { return slip_; }
  /// @returns g(T) [Nm]
  [[nodiscard]] double output_torque(double linear_Nm) const noexcept TORSIO_REALTIME;
  /// g(T) = T (1 + T (quadratic + T cubic)) from the lowest T to the highest, constant beyond.
  struct OutputCurve {
    double quadratic = 0.0;   ///< [1/Nm]
    double cubic = 0.0;       ///< [1/Nm²]
    double lowest_Nm = 0.0;   ///< T
    double highest_Nm = 0.0;  ///< T
  };
  [[nodiscard]] OutputCurve output_curve() const noexcept {
    return {quadratic_, cubic_, lowest_Nm_, highest_Nm_};
  }

  /// @returns the last step's whole torque [Nm]: none of it depends on the deflection alone
  [[nodiscard]] double friction_torque() const noexcept { return torque_Nm_; }
  /// @returns 0 [J]: what is stored depends on the history, and is part of the friction's
  [[nodiscard]] static constexpr double elastic_energy(double /*deflection_rad*/) noexcept {
    return 0.0;
  }
  /// @returns the energy [J] stored in chain and slip elements
  [[nodiscard]] double friction_energy() const noexcept;
  /// @returns the deflection [rad] that holds this torque when all is relaxed; that where the curve
  /// stops rising if the torque lies beyond
  [[nodiscard]] double deflection(double torque_Nm) const noexcept;
  /// @returns the largest stiffness [Nm/rad], with nothing slipping or relaxing
  [[nodiscard]] double steepest(double load_Nm) const noexcept;
  /// @returns 0 [Nms/rad]: what is viscous relaxes, and is part of the friction
  [[nodiscard]] static constexpr double viscosity() noexcept { return 0.0; }

 private:
  /// The lobes that carry one direction of torque; both directions when bonded.
  struct Lobes {
    CreepChain::Vector creep_rad{};
    double torque_Nm = 0.0;  ///< T
  };
  void step_lobes(Lobes& lobes, double side, double deflection_rad) const noexcept TORSIO_REALTIME;
  void count_cycle(double deflection_rad) noexcept TORSIO_REALTIME;
  [[nodiscard]] double output_energy(double linear_Nm) const noexcept;

  Parameters parameters_;
  CreepChain chain_;
  MaxwellSlip<3> slip_;
  double quadratic_;              ///< c₂ / c₁² [1/Nm]
  double cubic_;                  ///< c₃ / c₁³ [1/Nm²]
  double lowest_Nm_;              ///< T below which g is constant
  double highest_Nm_;             ///< T above which it is
  std::array<Lobes, 2> lobes_{};  ///< positive (or both) and negative direction
  double last_deflection_rad_ = 0.0;
  double carried_Nm_ = 0.0;  ///< g(T)
  double torque_Nm_ = 0.0;
  double glue_ = 1.0;
  double glue_after_cycle_ = 1.0;
  double last_side_ = 0.0;  ///< last side of the dead band
  int turns_ = 0;           ///< changes of side in this cycle
};

}  // namespace torsio
