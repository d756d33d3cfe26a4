#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "actuator/parts/stribeck.hpp"
#include "model/second_order/sampled_time.hpp"
#include "signal/causal_polynomial.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// An inertia with friction, driven by a force:
///
///     J q'' = sum_j g_j x_j - offset - k q - Fv q' - Fa |q'| - Fq |q'| q' - dry
///     dry   = F(q, q') sgn(q'),   at rest whatever holds the rest, up to F(q, 0)
///     F     = Fc max(0, 1 + s q) (1 + (r - 1) exp(-(q' / v_s)²))
///
/// x are the inputs, the first is the driving force, torque or current, q is the target (position,
/// angle). With a bristle, z0 > 0, dry is instead LuGre's z of stiffness r Fc / z0
/// (`relaxed_bristle`). In each sub-step: half of the motion, then the velocity from the forces
/// there (viscous friction by the trapezoid rule, Coulomb's so that it stops the motion and never
/// reverses it), then the other half: order 2, without a stop or a Stribeck curve, and exact
/// sticking. State q, q', z; z stays 0 without a bristle. It is at rest at 0 after a reset; the
/// first output is computed from the unchanged state. Where q leaves lowest..highest it stops
/// there, with `Fault::diverged`. Source: Gautier, Janot and Vandanjon 2013 (J, Fv, Fc, offset);
/// Canudas de Wit et al. 1995 (Stribeck, LuGre); the other terms are ours.
class RigidDrive {
 public:
  static constexpr std::string_view kFamily = "rigid_drive";
  static constexpr FamilyTraits kTraits{
      .is_spring = false, .extrapolates = true, .integrates = true};

  struct Parameters {
    using Family = RigidDrive;
    double inertia = 0.0;               ///< J > 0, force / (q/s²)
    double viscous = 0.0;               ///< Fv >= 0, force / (q/s)
    double coulomb = 0.0;               ///< Fc >= 0, force
    double offset = 0.0;                ///< force
    double static_ratio = 1.0;          ///< r >= 1
    double stribeck_speed = 1.0;        ///< v_s > 0, q/s
    double bristle = 0.0;               ///< z0 >= 0, in q; 0: Coulomb's law
    double viscous_asymmetry = 0.0;     ///< Fa, force / (q/s); its size at most Fv
    double viscous_quadratic = 0.0;     ///< Fq >= 0, force / (q/s)²
    double spring = 0.0;                ///< k, force / q; negative: an unstable balance
    double coulomb_slope = 0.0;         ///< s, 1 / q
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

  /// q, q', z.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  /// The state of the first sample to come: call it after `reset`.
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(input_, state_); }

 private:
  [[nodiscard]] double dry_level() const noexcept;  ///< F
  void advance(double force) noexcept;
  void coast(double dt_s) noexcept;  ///< the way, and what the bristle makes of it

  Parameters parameters_;
  double substep_s_;
  CausalPolynomial input_;
  StribeckCurve stribeck_;
  double bristle_stiffness_;
  std::array<double, 3> state_{};
};

}  // namespace torsio
