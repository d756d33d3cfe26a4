#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/common/schedule.hpp"
#include "model/hysteresis/increment.hpp"
#include "model/hysteresis/slip_bank.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A spring and stop operators: parallel springs that slip (Maxwell-slip).
struct StopOperator {
  static constexpr std::string_view kFamily = "maxwell_slip";
  static constexpr double of(double /*x*/, double stop) noexcept { return stop; }
};

/// A spring and play operators (Prandtl-Ishlinskii).
struct PlayOperator {
  static constexpr std::string_view kFamily = "prandtl_ishlinskii";
  static constexpr double of(double x, double stop) noexcept { return x - stop; }
};

/// A linear model plus a weighted sum of hysteresis operators of the first input:
///
///     y = b + sum_j k_j x_j + sum_i c_i O_i,   s_i <- clip(s_i + dx_0, +-r_i)
///
/// with O_i = s_i the stop operator (`maxwell_slip`: F_i = c_i s_i is a spring of stiffness c_i
/// that slips at f_i = c_i r_i) or O_i = x_0 - s_i the play operator (`prandtl_ishlinskii`). Since
/// stop and play add up to the input, both are the same model with c_i of opposite sign, the sum of
/// them moved into k_0. Where c_i >= 0 for stops or c_i <= 0 for plays, no closed path gives work:
/// the integral of y dx_0 is >= 0. Independent of rate. After `reset()` all s_i are 0 and the first
/// tick moves nothing. All but r_i may be scheduled over one input. State: s_i. Source:
/// specification 3.7, with play weights of the other sign, since weights >= 0 would generate work
/// (docs/decisions/0018-hysteresis-definitions.md). Cost: 8 operations per element.
template <class Operator>
class OperatorSum {
 public:
  static constexpr std::string_view kFamily = Operator::kFamily;
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = OperatorSum;
    CoefficientSchedule coefficients = {};  ///< columns: b, k_0 .. k_m-1, c_1 .. c_n
    std::vector<double> thresholds = {};    ///< r_i > 0, ascending, in x_0's unit

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("coefficients", self.coefficients);
      visit("thresholds", self.thresholds);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if the coefficients are not a valid schedule or too few, or the thresholds are
  /// not positive, finite and ascending.
  explicit OperatorSum(const Parameters& parameters);

  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept {
    return coefficients_.size() - 1 - stops_.size();
  }
  /// The thresholds are not counted: a fit sets them by the range of x_0.
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return coefficients_.fitted_count();
  }

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const double> state() const noexcept { return stops_.forces(); }
  void set_state(std::span<const double> state) noexcept { stops_.set_forces(state); }

  /// The x_0 for which the next step would output `target`: y is piecewise linear in x_0, solved
  /// exactly. Where y falls with x_0 in one part and rises in another, or ends before the target,
  /// the nearest end of the rising part is returned with `Fault::outside_training_range`; where y
  /// does not depend on x_0 or the schedule uses it, the given x_0 with `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(stops_, increment_); }

 private:
  [[nodiscard]] double curve(double x, double slope) const noexcept;

  ScheduledCoefficients coefficients_;
  SlipBank stops_;
  Increment increment_;
  std::vector<double> weights_;  ///< c_i of the present tick
};

using MaxwellSlipModel = OperatorSum<StopOperator>;
using PrandtlIshlinskii = OperatorSum<PlayOperator>;

extern template class OperatorSum<StopOperator>;
extern template class OperatorSum<PlayOperator>;

}  // namespace torsio
