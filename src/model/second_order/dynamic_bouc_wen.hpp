#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/second_order/sampled_time.hpp"
#include "signal/causal_polynomial.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A mass on a spring and a damper in parallel with a Bouc-Wen element, driven by a force:
///
///     m y'' + c y' + k y + z = u,   u = sum_j g_j x_j
///     z' = a y' - b (g |y'| |z|^(n-1) z + d y' |z|^n)
///
/// x are the inputs, the first is the driving force, torque or current (g_0 = 1 in a fit), y is the
/// target (displacement, angle), z the force of the hysteretic element. Only the products b g
/// (`loss`) and b d (`skew`) can be identified. The element is passive for a >= 0 and b g >= 0: it
/// loads along dz/dy = a - (b g + b d) |z|^n, unloads along a + (b g - b d) |z|^n, and gives back
/// what unloading returns, `hysteretic_energy`. Classical Runge-Kutta of order 4, where a velocity
/// that changes sign makes a kink of order 2; state y, y', z, each at the time of the last sample.
/// It is at rest at 0 after a reset; the first output is computed from the unchanged state. Where y
/// leaves lowest..highest it stops there, with `Fault::diverged`. Source: Noel and Schoukens 2016,
/// the official benchmark's equations, with b g and b d in place of b, g, d. Cost: 4 evaluations
/// per sub-step; a power in each unless n = 1.
class DynamicBoucWen {
 public:
  static constexpr std::string_view kFamily = "dynamic_bouc_wen";
  static constexpr FamilyTraits kTraits{.is_spring = false, .extrapolates = true};

  struct Parameters {
    using Family = DynamicBoucWen;
    double mass = 0.0;                  ///< m > 0, u / (y/s²)
    double damping = 0.0;               ///< c >= 0, u / (y/s)
    double stiffness = 0.0;             ///< k >= 0, u / y
    double hysteretic_stiffness = 0.0;  ///< a >= 0, u / y
    double loss = 0.0;                  ///< b g >= 0, u^(1-n) / y
    double skew = 0.0;                  ///< b d, u^(1-n) / y
    double exponent = 1.0;              ///< n >= 1
    std::vector<double> gains = {1.0};  ///< g, one per input
    SampledTime time = {};
    double lowest = 0.0;  ///< limit of y; 0 lies between them
    double highest = 0.0;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("mass", self.mass);
      visit("damping", self.damping);
      visit("stiffness", self.stiffness);
      visit("hysteretic_stiffness", self.hysteretic_stiffness);
      visit("loss", self.loss);
      visit("skew", self.skew);
      visit("exponent", self.exponent);
      visit("gains", self.gains);
      visit("time", self.time);
      visit("lowest", self.lowest);
      visit("highest", self.highest);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if a number is outside the range above, or the sub-steps are too long for the
  /// fastest oscillation to stay stable.
  explicit DynamicBoucWen(const Parameters& parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.gains.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return 6 + input_count(); }
  [[nodiscard]] double sample_period() const noexcept { return parameters_.time.sample_period_s; }

  /// Not declared: the state has no form that gives a bound.
  [[nodiscard]] static ModelMemory memory(const InputRanges& /*ranges*/) {
    return {.is_declared = false};
  }

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// y, y', z.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  /// The state of the first sample to come: call it after `reset`.
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(input_, state_); }

 private:
  using State = std::array<double, 3>;
  template <bool kIsPower>
  [[nodiscard]] State slope(const State& at, double force) const noexcept;
  template <bool kIsPower>
  void advance(std::span<const double> force) noexcept;

  Parameters parameters_;
  double substep_s_;
  CausalPolynomial input_;
  State state_{};
};

/// What the hysteretic element can give back from force z: the integral of z dz over its unloading
/// slope, in u times y, by Simpson's rule.
[[nodiscard]] double hysteretic_energy(const DynamicBoucWen::Parameters& parameters, double force);

}  // namespace torsio
