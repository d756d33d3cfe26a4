#include "model/hysteresis/bouc_wen_model.hpp"

#include <algorithm>
#include <cmath>

#include "model/hysteresis/bracketed_inverse.hpp"
#include "model/hysteresis/hysteresis_checks.hpp"
#include "model/hysteresis/other_inputs.hpp"

namespace torsio {
namespace {

constexpr double kMaxExponent = 20.0;
constexpr double kLongestStep = 0.125;  ///< in z_max

/// dz/du = 1 + rho |z|^n from z < 0 towards 0. @returns z, and the travel that is left at z = 0.
struct Unloaded {
  double share = 0.0;
  double travel = 0.0;
};
Unloaded unload(double share, double travel, double rho, double exponent) noexcept {
  const auto slope = [&](double z) {
    return rho == 0.0 ? 1.0 : 1.0 + rho * std::pow(std::min(std::abs(z), 1.0), exponent);
  };
  share = std::max(share, -1.0);  // a state that was loaded may have any number
  while (share < 0.0 && travel > 0.0) {
    const double to_zero = -share / slope(0.5 * share);
    const double step = std::min(travel, rho == 0.0 ? 1.0 : kLongestStep / slope(share));
    if (to_zero <= step) return {0.0, travel - to_zero};
    share += step * slope(share + 0.5 * step * slope(share));
    travel -= step;
  }
  return {std::min(share, 0.0), travel};
}

/// dz/du = 1 - z^n from z >= 0. Near 1 by the first two powers of e = 1 - z, a Bernoulli equation:
/// de/du = -n e + n (n - 1) / 2 e^2.
double load(double share, double travel, double exponent) noexcept {
  constexpr double kNear = 0.01;  // the third power is 6e-5 there at the most
  const double longest = std::min(kLongestStep, 0.5 / exponent);  // cannot overshoot z = 1
  while (travel > 0.0 && share < 1.0 - kNear) {
    const double step = std::min(travel, longest);
    const double middle = share + 0.5 * step * (1.0 - std::pow(share, exponent));
    share += step * (1.0 - std::pow(middle, exponent));
    travel -= step;
  }
  if (travel <= 0.0 || share >= 1.0) return std::min(share, 1.0);
  const double curved = 0.5 * (exponent - 1.0);
  return 1.0 - 1.0 / ((1.0 / (1.0 - share) - curved) * std::exp(exponent * travel) + curved);
}

}  // namespace

BoucWenModel::BoucWenModel(const Parameters& parameters)
    : parameters_(parameters),
      largest_(std::pow(parameters.beta + parameters.gamma, -1.0 / parameters.exponent)),
      unloading_((parameters.beta - parameters.gamma) / (parameters.beta + parameters.gamma)) {
  const Parameters& given = parameters_;
  check_other_inputs(given.slopes, kFamily);
  for (const double each : {given.stiffness, given.elastic_share, given.bias, given.centre})
    require(std::isfinite(each), {kFamily, "stiffness, elastic_share, bias, centre"},
            "finite numbers", each);
  require((1.0 - given.elastic_share) * given.stiffness >= 0.0, {kFamily, "elastic_share"},
          "(1 - elastic_share) stiffness not below 0", given.elastic_share);
  require(std::isfinite(given.beta) && given.beta > 0.0, {kFamily, "beta"}, "a positive number",
          given.beta);
  require(given.gamma > -given.beta && given.gamma <= given.beta, {kFamily, "gamma"},
          "a number above -beta and at most beta", given.gamma);
  require(given.exponent >= 1.0 && given.exponent <= kMaxExponent, {kFamily, "exponent"}, "1 to 20",
          given.exponent);
  require(std::isfinite(largest_) && largest_ > 0.0, {kFamily, "beta + gamma"},
          "numbers whose z_max is positive and finite", largest_);
  require(std::isfinite(given.half_range) && given.half_range > 0.0, {kFamily, "half_range"},
          "a positive number", given.half_range);
}

std::size_t BoucWenModel::parameter_count() const noexcept {
  return 6 + non_zero(parameters_.slopes);
}

ModelMemory BoucWenModel::memory(const InputRanges& /*ranges*/) const {
  // From -z_max to 0 in z_max or less, from there to within 1 % of z_max in ln(100) / n.
  constexpr double kTail = 4.605;
  const double gain = (1.0 - parameters_.elastic_share) * parameters_.stiffness;
  return {.slips = {{gain, (2.0 + kTail / parameters_.exponent) * largest_}}};
}

void BoucWenModel::reset() noexcept {
  increment_.reset();
  share_ = 0.0;
}

double BoucWenModel::share_after(double increment) const noexcept {
  const double direction = std::copysign(1.0, increment);
  const double exponent = parameters_.exponent;
  const double travel = std::abs(increment) / largest_;
  const Unloaded free = unload(direction * share_, travel, unloading_, exponent);
  if (free.travel == 0.0 && free.share < 0.0) return direction * free.share;
  const double share = share_ * direction > 0.0 ? share_ * direction : 0.0;
  return direction * load(share, free.travel, exponent);
}

Estimate BoucWenModel::step(Features features) noexcept {
  const double increment = increment_.step(features[0]);
  if (increment != 0.0) share_ = share_after(increment);
  const double hysteresis = (1.0 - parameters_.elastic_share) * parameters_.stiffness * largest_;
  return {.value = parameters_.bias +
                   parameters_.elastic_share * parameters_.stiffness * features[0] +
                   hysteresis * share_ + other_inputs(parameters_.slopes, features)};
}

void BoucWenModel::set_state(std::span<const double> state) noexcept {
  if (std::isfinite(state[0])) share_ = std::clamp(state[0], -1.0, 1.0);
}

Estimate BoucWenModel::invert(double target, Features features) const noexcept {
  const double elastic = parameters_.elastic_share * parameters_.stiffness;
  const double hysteresis = (1.0 - parameters_.elastic_share) * parameters_.stiffness * largest_;
  const auto within = [&](double half_range) {
    return bracketed_inverse(target - parameters_.bias - other_inputs(parameters_.slopes, features),
                             parameters_.centre, half_range, [&](double x) {
                               return elastic * x + hysteresis * share_after(increment_.to(x));
                             });
  };
  constexpr double kWider = 4.0;  // the model continues, further than an estimator uses its value
  const Estimate inside = within(parameters_.half_range);
  if (inside.fault == Fault::none) return inside;
  const Estimate beyond = within(kWider * parameters_.half_range);
  return beyond.fault == Fault::none ? beyond : inside;
}

}  // namespace torsio
