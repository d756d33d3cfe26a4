#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/hysteresis/envelope.hpp"
#include "model/hysteresis/increment.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Where the boundaries of a backlash grow with the rate.
struct BacklashRate {
  double gain = 0.0;        ///< beta >= 0
  double exponent = 1.0;    ///< alpha > 0
  std::size_t feature = 0;  ///< which input is x_r, read only if gain is not 0

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("gain", self.gain);
    visit("exponent", self.exponent);
    visit("feature", self.feature);
  }
  bool operator==(const BacklashRate&) const = default;
};

/// A torque that moves between two curves of the first input:
///
///     t <- clip(t + k dx_0; q f_dc(x_0), q f_ac(x_0)),   y = t + sum_j>0 k_j x_j
///
/// f_ac = m + h holds while x_0 rises far enough, f_dc = m - h while it falls, k joins them after a
/// turning point. `nonlinear_backlash` has q = 1, `nonlinear_backlash_improved` q = 1 + beta
/// |x_r|^alpha with x_r an input that is a rate. After `reset()` and until x_0 moves, t is in the
/// middle. Simple loops lose energy, since f_ac >= f_dc; paths that leave the boundary where it is
/// steeper than k may gain some. State: t - q m. Source: Choi et al. 2016 as in specification 3.7
/// (NBM). Cost: two multiply-adds per power of x_0, and a power of x_r.
template <bool kByRate>
class Backlash {
 public:
  static constexpr std::string_view kFamily =
      kByRate ? "nonlinear_backlash_improved" : "nonlinear_backlash";

  struct Parameters {
    using Family = Backlash;
    double stiffness = 1.0;           ///< k > 0, target's unit over x_0's
    Envelope boundaries = {};         ///< f_ac = upper, f_dc = lower
    std::vector<double> slopes = {};  ///< 0, k_1 .. k_m-1: one per input
    BacklashRate rate = {};           ///< written to a model file by the improved family only

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("stiffness", self.stiffness);
      visit("boundaries", self.boundaries);
      visit("slopes", self.slopes);
      if constexpr (kByRate) visit("rate", self.rate);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if the boundaries are none, the stiffness is not positive, a rate is out of
  /// range or given to the plain family, or the slopes do not begin with 0.
  explicit Backlash(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.slopes.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const double> state() const noexcept { return {&offset_, 1}; }
  void set_state(std::span<const double> state) noexcept;

  /// An x_0 within the training range at which the next step would output `target`; where its two
  /// ends do not enclose the target, the nearer one with `Fault::outside_training_range`.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(increment_, middle_, offset_);
  }

 private:
  struct Torque {
    double middle = 0.0;
    double total = 0.0;
  };
  [[nodiscard]] double scale(Features features) const noexcept;
  [[nodiscard]] Torque torque(double x, double scale) const noexcept;

  Parameters parameters_;
  Increment increment_;
  double middle_ = 0.0;  ///< q m of the last tick
  double offset_ = 0.0;  ///< t - q m
};

using NonlinearBacklash = Backlash<false>;
using ImprovedNonlinearBacklash = Backlash<true>;

extern template class Backlash<false>;
extern template class Backlash<true>;

}  // namespace torsio
