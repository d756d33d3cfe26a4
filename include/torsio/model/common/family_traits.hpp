#pragma once

#include <concepts>
#include <string_view>

#include "torsio/model/common/model.hpp"

namespace torsio {

/// Properties of a family that shared code uses instead of comparing names. A family that differs
/// from the defaults has a member `static constexpr FamilyTraits kTraits`.
struct FamilyTraits {
  /// The first input is the deflection of a spring; false: a force that drives a mass, whose motion
  /// is the target.
  bool is_spring = true;
  /// An equation of motion, which holds beyond the inputs that it was fitted to: the range guard
  /// adds as much room again on either side.
  bool extrapolates = false;
  /// A spring that extrapolates linearly in the first input, with its hysteresis, unlike a polynomial or a
  /// network: up to one width of the range beyond it the estimator uses its value and not the fallback's
  /// (docs/decisions/0027-beyond-the-range.md).
  bool continues = false;
  /// The output is an integral of the input. The error of its first samples is that of a drift that
  /// has hardly begun, so it does not show how uncertain the start is.
  bool integrates = false;
};

namespace detail {

template <class Family>
[[nodiscard]] constexpr FamilyTraits traits_of() noexcept {
  if constexpr (requires { Family::kTraits; }) {
    return Family::kTraits;
  } else {
    return {};
  }
}

template <class M>
[[nodiscard]] FamilyTraits traits_of_model(const M& model) noexcept {
  if constexpr (requires { model.traits(); }) {
    return model.traits();
  } else {
    return traits_of<M>();
  }
}

}  // namespace detail

/// A model that names its family, and whose parameters name the model: what `AnyModel` holds.
///
///     class Mine {
///      public:
///       static constexpr std::string_view kFamily = "mine";
///       struct Parameters { using Family = Mine; ... };
// `Model` comes last: it asks whether M can be copied, and so whether an `AnyModel` can be made of it.
template <class M>
concept NamedFamily = requires {
  { M::kFamily } -> std::convertible_to<std::string_view>;
  requires std::same_as<typename M::Parameters::Family, M>;
} && Model<M>;

/// A discrete model, which runs at one sample period [s].
template <class M>
concept HasSamplePeriod = requires(const M& model) {
  { model.sample_period() } noexcept -> std::same_as<double>;
};

/// A continuous-time model, which is discretised anew for another sample period [s].
template <class M>
concept Rediscretised =
    HasSamplePeriod<M> && requires(typename M::Parameters parameters, double sample_period_s) {
      { M::at_sample_period(parameters, sample_period_s) } -> std::same_as<typename M::Parameters>;
    };

}  // namespace torsio
