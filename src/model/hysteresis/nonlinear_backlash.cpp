#include "model/hysteresis/nonlinear_backlash.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/hysteresis/bracketed_inverse.hpp"
#include "model/hysteresis/hysteresis_checks.hpp"
#include "model/hysteresis/other_inputs.hpp"

namespace torsio {

template <bool kByRate>
Backlash<kByRate>::Backlash(Parameters parameters) : parameters_(std::move(parameters)) {
  parameters_.boundaries.check(kFamily);
  check_other_inputs(parameters_.slopes, kFamily);
  require(std::isfinite(parameters_.stiffness) && parameters_.stiffness > 0.0,
          {kFamily, "stiffness"}, "a positive number", parameters_.stiffness);
  const BacklashRate& rate = parameters_.rate;
  require(std::isfinite(rate.gain) && rate.gain >= 0.0 && (kByRate || rate.gain == 0.0),
          {kFamily, "rate.gain"}, kByRate ? "a number not below 0" : "0", rate.gain);
  require(std::isfinite(rate.exponent) && rate.exponent > 0.0, {kFamily, "rate.exponent"},
          "a positive number", rate.exponent);
  require(rate.feature < parameters_.slopes.size(), {kFamily, "rate.feature"}, "one of the inputs",
          static_cast<double>(rate.feature));
}

template <bool kByRate>
std::size_t Backlash<kByRate>::parameter_count() const noexcept {
  return 1 + parameters_.boundaries.middle.size() + parameters_.boundaries.half_width.size() +
         (kByRate ? 2 : 0) + non_zero(parameters_.slopes);
}

template <bool kByRate>
ModelMemory Backlash<kByRate>::memory(const InputRanges& ranges) const {
  const double low = ranges.lowest[0];
  const double high = ranges.highest[0];
  double scale = 1.0;
  if (kByRate && parameters_.rate.gain > 0.0) {
    const std::size_t rate = parameters_.rate.feature;
    const double fastest = ranges.largest_magnitude(rate);
    scale += parameters_.rate.gain * std::pow(fastest, parameters_.rate.exponent);
  }
  // t rises with k from one boundary to the other, which rises meanwhile with the middle's slope.
  const double rise =
      parameters_.boundaries.at(high).middle - parameters_.boundaries.at(low).middle;
  const double width = 2.0 * scale * parameters_.boundaries.widest(low, high);
  const double closing = parameters_.stiffness - scale * rise / (high - low);
  const double travel = closing > 0.0 ? width / closing : high - low;
  return {.slips = {{travel > 0.0 ? width / travel : 0.0, travel}}};
}

template <bool kByRate>
void Backlash<kByRate>::reset() noexcept {
  increment_.reset();
  middle_ = 0.0;
  offset_ = 0.0;
}

template <bool kByRate>
double Backlash<kByRate>::scale(Features features) const noexcept {
  const BacklashRate& rate = parameters_.rate;
  if (!kByRate || rate.gain == 0.0) return 1.0;
  return std::min(1.0 + rate.gain * std::pow(std::abs(features[rate.feature]), rate.exponent),
                  std::numeric_limits<double>::max());
}

template <bool kByRate>
typename Backlash<kByRate>::Torque Backlash<kByRate>::torque(double x,
                                                             double scale) const noexcept {
  // So large a torque that nothing beyond it matters, and so small that sums of it are finite.
  constexpr double kLargest = 0.25 * std::numeric_limits<double>::max();
  const auto bounded = [=](double value) { return std::clamp(value, -kLargest, kLargest); };
  const Envelope::At boundary = parameters_.boundaries.at(x);
  const double middle = bounded(scale * boundary.middle);
  const double before = increment_.has_last() ? middle_ : middle;
  const double elastic = before + offset_ + parameters_.stiffness * increment_.to(x);
  return {middle, std::clamp(elastic, bounded(scale * boundary.lower()),
                             bounded(scale * boundary.upper()))};
}

template <bool kByRate>
Estimate Backlash<kByRate>::step(Features features) noexcept {
  const Torque now = torque(features[0], scale(features));
  increment_.step(features[0]);
  middle_ = now.middle;
  offset_ = now.total - now.middle;
  return {.value = now.total + other_inputs(parameters_.slopes, features)};
}

template <bool kByRate>
void Backlash<kByRate>::set_state(std::span<const double> state) noexcept {
  if (std::isfinite(state[0])) offset_ = state[0];
}

template <bool kByRate>
Estimate Backlash<kByRate>::invert(double target, Features features) const noexcept {
  const double now = scale(features);
  return bracketed_inverse(target - other_inputs(parameters_.slopes, features),
                           parameters_.boundaries.centre, parameters_.boundaries.half_range,
                           [&](double x) { return torque(x, now).total; });
}

template class Backlash<false>;
template class Backlash<true>;

}  // namespace torsio
