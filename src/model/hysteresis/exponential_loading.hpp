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

/// A torque that, from the last reversal on, nears one of two curves exponentially:
///
///     t = E(x_0) + (t_r - E(x_r)) exp(-b |x_0 - x_r|),   y = t + sum_j>0 k_j x_j
///
/// (x_r, t_r) the last reversal; E = m + h and b = b+ while x_0 rises, E = m - h and b = b- while it
/// falls. This is t_r +- [c d + a (exp(b d) - 1)] of specification 3.7 (ELM) with d = |x_0 - x_r|,
/// b < 0 and an a that depends on where the reversal was: with an a of its own for each direction,
/// as defined there, up and down by the same way do not end where they began and the torque drifts
/// off. Independent of rate. After `reset()` t is in the middle. State: t - m(x_0). Cost: one exp,
/// two multiply-adds a power of x_0.
class ExponentialLoading {
 public:
  static constexpr std::string_view kFamily = "exponential_loading";

  struct Parameters {
    using Family = ExponentialLoading;
    Envelope curves = {};             ///< upper: rising, lower: falling
    double rising_decay = 1.0;        ///< b+ > 0, one over x_0's unit
    double falling_decay = 1.0;       ///< b- > 0
    std::vector<double> slopes = {};  ///< 0, k_1 .. k_m-1: one per input

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("curves", self.curves);
      visit("rising_decay", self.rising_decay);
      visit("falling_decay", self.falling_decay);
      visit("slopes", self.slopes);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if the curves are none, a decay is not positive, or the slopes do not begin
  /// with 0.
  explicit ExponentialLoading(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.slopes.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const double> state() const noexcept { return {&offset_, 1}; }
  /// An offset beyond the present curves stays and fades like any other.
  void set_state(std::span<const double> state) noexcept;

  /// As `Backlash::invert`.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(increment_, half_width_, offset_);
  }

 private:
  [[nodiscard]] double offset(double x, double half_width) const noexcept;

  Parameters parameters_;
  Increment increment_;
  double half_width_ = 0.0;  ///< h of the last tick
  double offset_ = 0.0;      ///< t - m
};

}  // namespace torsio
