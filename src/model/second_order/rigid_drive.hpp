#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "model/second_order/sampled_time.hpp"
#include "parts/stribeck.hpp"
#include "signal/causal_polynomial.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Friction that depends on load, time at rest and heat (`RigidDrive`). The terms are ours.
struct VariableFriction {
  double load_share = 0.0;      ///< mu, 0 <= mu < 1: dry friction per transmitted force
  double dwell_gain = 0.0;      ///< d >= 0
  double dwell_time_s = 1.0;    ///< tau_d > 0
  double heating = 0.0;         ///< h >= 0, 1 / energy
  double heating_time_s = 1.0;  ///< tau_h > 0

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("load_share", self.load_share);
    visit("dwell_gain", self.dwell_gain);
    visit("dwell_time_s", self.dwell_time_s);
    visit("heating", self.heating);
    visit("heating_time_s", self.heating_time_s);
  }
  bool operator==(const VariableFriction&) const = default;
};

/// An inertia with friction, driven by a force:
///
///     J q'' = sum_j g_j x_j - offset - k q - Fv q' - Fa |q'| - Fq |q'| q' - dry
///     dry   = F(q, q') sgn(q'),   at rest whatever holds the rest, up to F(q, 0)
///     F     = Fc max(0, 1 + s q) (1 + (r - 1) exp(-(q' / v_s)²))
///
/// x are the inputs, the first is the driving force, torque or current, q is the target (position,
/// angle). With `VariableFriction`, F is larger by the share mu of the force that is transmitted
/// and by the share d (1 - exp(-t / tau_d)) after a time t at rest, and a drive that is warm from
/// the energy E that it dissipated (E' = power - E / tau_h) has exp(-h E) times its friction. With
/// a bristle, z0 > 0, dry is instead LuGre's z of stiffness r Fc / z0 (`relaxed_bristle`). In each
/// sub-step: half of the motion, then the velocity from the forces there (viscous friction by the
/// trapezoid rule, Coulomb's so that it stops the motion and never reverses it), then the other
/// half: order 2, without a stop or a Stribeck curve, and exact sticking. State q, q', z, t, E; z
/// stays 0 without a bristle. It is at rest at 0 after a reset; the first output is computed from
/// the unchanged state. Where q leaves lowest..highest it stops there, with `Fault::diverged`.
/// Source: Gautier, Janot and Vandanjon 2013 (J, Fv, Fc, offset); Canudas de Wit et al. 1995
/// (Stribeck, LuGre); the other terms are ours.
class RigidDrive {
 public:
  static constexpr std::string_view kFamily = "rigid_drive";
  static constexpr FamilyTraits kTraits{
      .is_spring = false, .extrapolates = true, .integrates = true};

  struct Parameters {
    using Family = RigidDrive;
    double inertia = 0.0;            ///< J > 0, force / (q/s²)
    double viscous = 0.0;            ///< Fv >= 0, force / (q/s)
    double coulomb = 0.0;            ///< Fc >= 0, force
    double offset = 0.0;             ///< force
    double static_ratio = 1.0;       ///< r >= 1
    double stribeck_speed = 1.0;     ///< v_s > 0, q/s
    double bristle = 0.0;            ///< z0 >= 0, in q; 0: Coulomb's law
    double viscous_asymmetry = 0.0;  ///< Fa, force / (q/s); its size at most Fv
    double viscous_quadratic = 0.0;  ///< Fq >= 0, force / (q/s)²
    double spring = 0.0;             ///< k, force / q; negative: an unstable balance
    double coulomb_slope = 0.0;      ///< s, 1 / q
    std::optional<VariableFriction> variable_friction = {};
    std::vector<double> gains = {1.0};  ///< g, force / input, one per input
    SampledTime time = {};
    double lowest = 0.0;  ///< limit of q; 0 lies between them
    double highest = 0.0;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("inertia", self.inertia);
      visit("viscous", self.viscous);
      visit("coulomb", self.coulomb);
      visit("offset", self.offset);
      visit("static_ratio", self.static_ratio);
      visit("stribeck_speed", self.stribeck_speed);
      visit("bristle", self.bristle);
      visit("viscous_asymmetry", self.viscous_asymmetry);
      visit("viscous_quadratic", self.viscous_quadratic);
      visit("spring", self.spring);
      visit("coulomb_slope", self.coulomb_slope);
      visit("variable_friction", self.variable_friction);
      visit("gains", self.gains);
      visit("time", self.time);
      visit("lowest", self.lowest);
      visit("highest", self.highest);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if a number is outside the range above, or the sub-steps are too long for the
  /// spring or the bristle to stay stable.
  explicit RigidDrive(const Parameters& parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.gains.size(); }
  /// Those that a fit may choose: not the first gain.
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  [[nodiscard]] double sample_period() const noexcept { return parameters_.time.sample_period_s; }

  /// Not declared: the state has no form that gives a bound.
  [[nodiscard]] static ModelMemory memory(const InputRanges& /*ranges*/) {
    return {.is_declared = false};
  }

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// q, q', z, time at rest in s, energy of the heating.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  /// The state of the first sample to come: call it after `reset`.
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(input_, friction_factor_, state_);
  }

 private:
  [[nodiscard]] double dry_level(double force) const noexcept;  ///< F
  void advance(double force) noexcept;
  /// The way of half a sub-step, and what the bristle makes of it.
  void coast(double dt_s, double force) noexcept;
  void age(double friction) noexcept;  ///< time at rest and heat after a sub-step

  Parameters parameters_;
  double substep_s_;
  CausalPolynomial input_;
  StribeckCurve stribeck_;
  double bristle_stiffness_;
  VariableFriction variable_;
  double kept_heat_;              ///< share of E that a sub-step leaves
  double friction_factor_ = 1.0;  ///< exp(-h E)
  std::array<double, 5> state_{};
};

}  // namespace torsio
