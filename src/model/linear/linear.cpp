#include "model/linear/linear.hpp"

#include <string>

#include "model/common/affine_inverse.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::size_t inputs_of(const Linear::Parameters& parameters) {
  const std::size_t columns = parameters.coefficients.values.columns;
  if (columns < 2)
    throw Error({.place = "linear: coefficients",
                 .expected = "a bias and at least one slope",
                 .found = std::to_string(columns) + " columns"});
  return columns - 1;
}

}  // namespace

Linear::Linear(const Parameters& parameters)
    : coefficients_(parameters.coefficients, inputs_of(parameters), kFamily) {}

Estimate Linear::step(Features features) const noexcept {
  const auto at = coefficients_.locate(features);
  return {.value = coefficients_.coefficient(at, 0) + coefficients_.weighted_sum(at, 1, features)};
}

Estimate Linear::invert(double target, Features features) const noexcept {
  const auto at = coefficients_.locate(features);
  return affine_inverse(coefficients_, at, 1, target - coefficients_.coefficient(at, 0), features);
}

}  // namespace torsio
