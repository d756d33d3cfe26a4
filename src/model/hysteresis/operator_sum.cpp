#include "model/hysteresis/operator_sum.hpp"

#include <fmt/format.h>

#include "model/common/affine_inverse.hpp"
#include "model/hysteresis/broken_line.hpp"
#include "model/hysteresis/hysteresis_checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::size_t inputs_of(const CoefficientSchedule& coefficients, std::size_t elements,
                      std::string_view family) {
  if (coefficients.values.columns < elements + 2)
    throw Error({.place = std::string(family) + ": coefficients",
                 .expected = fmt::format("a bias, {} weights and a slope for each input", elements),
                 .found = fmt::format("{} columns", coefficients.values.columns)});
  return coefficients.values.columns - 1 - elements;
}

}  // namespace

template <class Operator>
OperatorSum<Operator>::OperatorSum(const Parameters& parameters)
    : coefficients_(parameters.coefficients,
                    inputs_of(parameters.coefficients, parameters.thresholds.size(), kFamily),
                    kFamily),
      stops_(ascending_thresholds(parameters.thresholds, kFamily), kFamily),
      weights_(parameters.thresholds.size(), 0.0) {}

template <class Operator>
typename OperatorSum<Operator>::Parameters OperatorSum<Operator>::parameters() const {
  return {coefficients_.schedule(), {stops_.limit().begin(), stops_.limit().end()}};
}

template <class Operator>
ModelMemory OperatorSum<Operator>::memory(const InputRanges& /*ranges*/) const {
  ModelMemory memory;
  const std::size_t first = 1 + input_count();
  for (std::size_t i = 0; i < stops_.size(); ++i)
    memory.slips.push_back({coefficients_.largest(first + i), 2.0 * stops_.limit()[i]});
  return memory;
}

template <class Operator>
void OperatorSum<Operator>::reset() noexcept {
  stops_.reset();
  increment_.reset();
}

template <class Operator>
Estimate OperatorSum<Operator>::step(Features features) noexcept {
  stops_.move(increment_.step(features[0]));
  const auto at = coefficients_.locate(features);
  double value = coefficients_.coefficient(at, 0) + coefficients_.weighted_sum(at, 1, features);
  const std::size_t first = 1 + features.size();
  for (std::size_t i = 0; i < stops_.size(); ++i)
    value +=
        coefficients_.coefficient(at, first + i) * Operator::of(features[0], stops_.forces()[i]);
  return {.value = value};
}

/// The part of y that depends on x_0.
template <class Operator>
double OperatorSum<Operator>::curve(double x, double slope) const noexcept {
  const double stops = stops_.sum_after(increment_.to(x), weights_);
  double weights = 0.0;
  for (const double weight : weights_) weights += weight;
  // O is x or 0, and the stop with the sign that it has in O.
  return slope * x + Operator::of(0.0, 1.0) * stops +
         (Operator::of(1.0, 1.0) - Operator::of(0.0, 1.0)) * weights * x;
}

template <class Operator>
Estimate OperatorSum<Operator>::invert(double target, Features features) noexcept {
  const CoefficientSchedule& schedule = coefficients_.schedule();
  if (schedule.scheduled && schedule.feature == 0) return detail::no_inverse(features);
  const auto at = coefficients_.locate(features);
  const std::size_t first = 1 + input_count();
  for (std::size_t i = 0; i < weights_.size(); ++i)
    weights_[i] = coefficients_.coefficient(at, first + i);
  const double slope = coefficients_.coefficient(at, 1);
  const double wanted =
      target - coefficients_.coefficient(at, 0) - coefficients_.weighted_sum(at, 1, features, 1);
  return broken_line_inverse(
      wanted, stops_, increment_, stops_.limit(), [&](double x) { return curve(x, slope); },
      features);
}

template class OperatorSum<StopOperator>;
template class OperatorSum<PlayOperator>;

}  // namespace torsio
