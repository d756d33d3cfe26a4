#include "model/linear/linear_coulomb.hpp"

#include <cmath>
#include <string>

#include "core/hyperbolic_tangent.hpp"
#include "model/common/affine_inverse.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::size_t inputs_of(const LinearCoulomb::Parameters& parameters) {
  const std::size_t columns = parameters.coefficients.values.columns;
  if (columns < 3)
    throw Error({.place = "linear_coulomb: coefficients",
                 .expected = "a bias, at least one slope and the friction",
                 .found = std::to_string(columns) + " columns"});
  return columns - 2;
}

}  // namespace

LinearCoulomb::LinearCoulomb(const Parameters& parameters)
    : rate_feature_(parameters.rate_feature),
      rate_scale_(parameters.rate_scale),
      coefficients_(parameters.coefficients, inputs_of(parameters), kFamily) {
  if (rate_feature_ >= input_count())
    throw Error({.place = "linear_coulomb: rate_feature",
                 .expected = "one of the " + std::to_string(input_count()) + " inputs",
                 .found = "number " + std::to_string(rate_feature_)});
  if (!(rate_scale_ > 0.0) || !std::isfinite(rate_scale_))
    throw Error({.place = "linear_coulomb: rate_scale",
                 .expected = "a positive number",
                 .found = std::to_string(rate_scale_)});
}

double LinearCoulomb::without_slopes(const ScheduledCoefficients::Position& at,
                                     Features features) const noexcept {
  return coefficients_.coefficient(at, 0) +
         coefficients_.coefficient(at, coefficients_.size() - 1) *
             detail::hyperbolic_tangent(features[rate_feature_] / rate_scale_);
}

Estimate LinearCoulomb::step(Features features) const noexcept {
  const auto at = coefficients_.locate(features);
  return {.value = without_slopes(at, features) + coefficients_.weighted_sum(at, 1, features)};
}

Estimate LinearCoulomb::invert(double target, Features features) const noexcept {
  if (rate_feature_ == 0) return detail::no_inverse(features);
  const auto at = coefficients_.locate(features);
  return affine_inverse(coefficients_, at, 1, target - without_slopes(at, features), features);
}

}  // namespace torsio
