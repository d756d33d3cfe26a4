#pragma once

#include <cstddef>
#include <string_view>

#include "model/common/schedule.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A linear spring with a smoothed Coulomb friction term, four numbers that catch most of a loop:
///
///     y = b + sum_j k_j x_j + c tanh(r / v)
///
/// r one of the inputs, the rate of the deflection; c half the loop's width in the target's unit;
/// v in r's unit, the rate at which the friction reaches 76 % of c. All but v may be scheduled over
/// one input. Source: specification 6 (cheap baselines). Cost: one tanh more than
/// `Linear`.
class LinearCoulomb {
 public:
  static constexpr std::string_view kFamily = "linear_coulomb";
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = LinearCoulomb;
    CoefficientSchedule coefficients = {};  ///< columns: b, k_1 .. k_n, c; k = 0: no term
    std::size_t rate_feature = 0;           ///< which input is r
    double rate_scale = 1.0;                ///< v > 0, in r's unit

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("coefficients", self.coefficients);
      visit("rate_feature", self.rate_feature);
      visit("rate_scale", self.rate_scale);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no input, the coefficients are not a valid schedule, `rate_feature`
  /// is not an input, or v is not positive and finite.
  explicit LinearCoulomb(const Parameters& parameters);

  [[nodiscard]] Parameters parameters() const {
    return {coefficients_.schedule(), rate_feature_, rate_scale_};
  }
  [[nodiscard]] std::size_t input_count() const noexcept { return coefficients_.size() - 2; }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return coefficients_.fitted_count() + 1;
  }

  void reset() noexcept {}
  Estimate step(Features features) const noexcept TORSIO_REALTIME;

  /// As `Linear::invert`; the friction is that of the given rate. No inverse either where the rate
  /// is itself the first input.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

 private:
  [[nodiscard]] double without_slopes(const ScheduledCoefficients::Position& at,
                                      Features features) const noexcept;

  std::size_t rate_feature_;
  double rate_scale_;
  ScheduledCoefficients coefficients_;
};

}  // namespace torsio
