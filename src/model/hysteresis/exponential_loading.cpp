#include "model/hysteresis/exponential_loading.hpp"

#include <cmath>
#include <utility>

#include "model/hysteresis/bracketed_inverse.hpp"
#include "model/hysteresis/hysteresis_checks.hpp"
#include "model/hysteresis/other_inputs.hpp"

namespace torsio {

ExponentialLoading::ExponentialLoading(Parameters parameters) : parameters_(std::move(parameters)) {
  parameters_.curves.check(kFamily);
  check_other_inputs(parameters_.slopes, kFamily);
  for (const double decay : {parameters_.rising_decay, parameters_.falling_decay})
    require(std::isfinite(decay) && decay > 0.0, {kFamily, "decay"}, "a positive number", decay);
}

std::size_t ExponentialLoading::parameter_count() const noexcept {
  return 2 + parameters_.curves.middle.size() + parameters_.curves.half_width.size() +
         non_zero(parameters_.slopes);
}

ModelMemory ExponentialLoading::memory(const InputRanges& ranges) const {
  // An offset has decayed to 1 % after ln(100) / b.
  constexpr double kTail = 4.605;
  const double travel = kTail / std::min(parameters_.rising_decay, parameters_.falling_decay);
  const double widest = parameters_.curves.widest(ranges.lowest[0], ranges.highest[0]);
  return {.slips = {{2.0 * widest / travel, travel}}};
}

void ExponentialLoading::reset() noexcept {
  increment_.reset();
  half_width_ = 0.0;
  offset_ = 0.0;
}

double ExponentialLoading::offset(double x, double half_width) const noexcept {
  const double moved = increment_.to(x);
  if (moved == 0.0) return offset_;
  const double sign = moved > 0.0 ? 1.0 : -1.0;
  const double decay = moved > 0.0 ? parameters_.rising_decay : parameters_.falling_decay;
  // t - E: E is m +- h at the last tick and at this one.
  return sign * half_width + (offset_ - sign * half_width_) * std::exp(-decay * std::abs(moved));
}

Estimate ExponentialLoading::step(Features features) noexcept {
  const Envelope::At curves = parameters_.curves.at(features[0]);
  offset_ = offset(features[0], curves.half_width);
  half_width_ = curves.half_width;
  increment_.step(features[0]);
  return {.value = curves.middle + offset_ + other_inputs(parameters_.slopes, features)};
}

void ExponentialLoading::set_state(std::span<const double> state) noexcept {
  if (std::isfinite(state[0])) offset_ = state[0];
}

Estimate ExponentialLoading::invert(double target, Features features) const noexcept {
  const Envelope& curves = parameters_.curves;
  return bracketed_inverse(target - other_inputs(parameters_.slopes, features), curves.centre,
                           curves.half_range, [&](double x) {
                             const Envelope::At at = curves.at(x);
                             return at.middle + offset(x, at.half_width);
                           });
}

}  // namespace torsio
