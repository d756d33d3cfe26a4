#pragma once

#include <cstddef>
#include <string_view>

#include "model/common/schedule.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A linear spring with a bias, the baseline that every other family must beat:
///
///     y = b + sum_j k_j x_j
///
/// y target, x_j inputs (the first is usually the spring deflection), k_j stiffness in the target's
/// unit per input's unit, b in the target's unit. All coefficients may be scheduled over one input.
/// Source: specification 3.7 (Hooke). Cost: one multiply-add an input, about four times that if
/// scheduled.
class Linear {
 public:
  static constexpr std::string_view kFamily = "linear";
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = Linear;
    CoefficientSchedule coefficients =
        {};  ///< columns: b, k_1 .. k_n; k = 0 for an input without term

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("coefficients", self.coefficients);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no input or the coefficients are not a valid schedule.
  explicit Linear(const Parameters& parameters);

  [[nodiscard]] Parameters parameters() const { return {coefficients_.schedule()}; }
  [[nodiscard]] std::size_t input_count() const noexcept { return coefficients_.size() - 1; }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return coefficients_.fitted_count();
  }

  void reset() noexcept {}
  Estimate step(Features features) const noexcept TORSIO_REALTIME;

  /// The first input at which the output is `target`, the other inputs as given: x_1 = (target - b
  /// - sum_j>1 k_j x_j) / k_1. Where there is none (no slope, or the schedule uses that input) the
  /// given x_1, or 0 if that is not a number, is returned with `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

 private:
  ScheduledCoefficients coefficients_;
};

}  // namespace torsio
