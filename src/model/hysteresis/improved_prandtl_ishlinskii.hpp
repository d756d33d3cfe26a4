#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/hysteresis/increment.hpp"
#include "model/hysteresis/slip_bank.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Prandtl-Ishlinskii with loops that need not be symmetric and may grow with the rate:
///
///     y = b + sum_j>0 k_j x_j + S(v),   v = w_0 x_0 + sum_i w_i P_i
///     S(v) = v + sum_j g_j D_j(v),      D_j = max(v - c_j, 0) for c_j > 0, min(v - c_j, 0) else
///
/// P_i = x_0 - s_i the play of threshold r_i (1 + beta |x_r|), x_r an input that is a rate. S rises
/// everywhere. Where beta = 0 and w_i <= 0 no closed path gives work. Starts and state as
/// `prandtl_ishlinskii`. Source: specification 3.7 (improved PI). Cost: 8 operations per element, 4
/// per g_j.
class ImprovedPrandtlIshlinskii {
 public:
  static constexpr std::string_view kFamily = "prandtl_ishlinskii_improved";

  struct Parameters {
    using Family = ImprovedPrandtlIshlinskii;
    double bias = 0.0;                    ///< b, in the target's unit
    std::vector<double> slopes = {};      ///< w_0, k_1 .. k_m-1: one per input
    std::vector<double> weights = {};     ///< w_i
    std::vector<double> thresholds = {};  ///< r_i > 0, ascending, in x_0's unit
    std::vector<double> knots = {};       ///< c_j, ascending, none 0, in the target's unit
    std::vector<double> bends = {};       ///< g_j, one per knot
    double rate_gain = 0.0;               ///< beta >= 0, one over x_r's unit
    std::size_t rate_feature = 0;         ///< which input is x_r

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("bias", self.bias);
      visit("slopes", self.slopes);
      visit("weights", self.weights);
      visit("thresholds", self.thresholds);
      visit("knots", self.knots);
      visit("bends", self.bends);
      visit("rate_gain", self.rate_gain);
      visit("rate_feature", self.rate_feature);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if sizes disagree, something is not finite or out of range, or S does not rise
  /// everywhere.
  explicit ImprovedPrandtlIshlinskii(const Parameters& parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.slopes.size(); }
  /// b, beta, and all slopes, weights and bends that are not 0.
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const double> state() const noexcept { return stops_.forces(); }
  void set_state(std::span<const double> state) noexcept { stops_.set_forces(state); }

  /// As `OperatorSum::invert`; the rate is the given one.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;

  /// S(v), and S^-1(y).
  [[nodiscard]] double bent(double v) const noexcept;
  [[nodiscard]] double straightened(double y) const noexcept;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(stops_, increment_); }

 private:
  [[nodiscard]] double limit_scale(Features features) const noexcept;

  Parameters parameters_;
  SlipBank stops_;
  Increment increment_;
  std::vector<double> limits_;  ///< thresholds of the present tick
  double play_sum_;             ///< sum of w_i
  double steepest_ = 1.0;       ///< largest slope of S
};

}  // namespace torsio
