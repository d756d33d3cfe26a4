#include "model/viscoelastic/viscoelastic.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/all_finite.hpp"
#include "core/checks.hpp"
#include "model/common/affine_inverse.hpp"
#include "model/viscoelastic/relaxation_step.hpp"

namespace torsio {

Viscoelastic::Viscoelastic(Parameters parameters)
    : parameters_(std::move(parameters)),
      spectrum_(relaxation_spectrum(parameters_.network)),
      parameter_count_(parameters_.network.values().size() + 1) {
  const double period_s = parameters_.sample_period_s;
  require(std::isfinite(period_s) && period_s > 0.0, {kFamily, "sample_period_s"},
          "a positive number", period_s);
  require(std::isfinite(parameters_.offset), {kFamily, "offset"}, "a finite number",
          parameters_.offset);
  require(parameters_.inputs >= 1, {kFamily, "inputs"}, "at least 1",
          static_cast<double>(parameters_.inputs));
  slope_ = spectrum_.damping / period_s;
  moving_slope_ = spectrum_.stiffness + slope_;
  for (const RelaxationBranch& branch : spectrum_.branches) {
    const RelaxationStep step = relaxation_step(branch, period_s);
    decay_.push_back(step.decay);
    gain_.push_back(step.gain);
    moving_slope_ += step.gain;
  }
  torque_.resize(decay_.size());
  reset();
}

ModelMemory Viscoelastic::memory(const InputRanges& ranges) const {
  const double width = ranges.width(0);
  ModelMemory memory;
  for (const RelaxationBranch& branch : spectrum_.branches)
    memory.relaxations.push_back({width * branch.stiffness, 1.0 / branch.rate_1_s});
  return memory;
}

void Viscoelastic::reset() noexcept {
  std::ranges::fill(torque_, 0.0);
  is_started_ = false;
  value_without_ = parameters_.offset;
  value_per_input_ = spectrum_.stiffness;
  last_ = 0.0;
}

void Viscoelastic::set_state(std::span<const double> state) noexcept {
  for (std::size_t i = 0; i < torque_.size() && i < state.size(); ++i)
    if (std::isfinite(state[i])) torque_[i] = state[i];
}

Estimate Viscoelastic::step(Features features) noexcept {
  const double u = features[0];
  if (!std::isfinite(u))
    return {.value = value_without_ + value_per_input_ * last_, .fault = Fault::input_not_finite};
  double value = parameters_.offset + spectrum_.stiffness * u;
  if (is_started_) {
    const double moved = u - last_;
    value = relaxed<std::dynamic_extent>(value + slope_ * moved, moved, decay_, gain_, torque_);
    value_per_input_ = moving_slope_;
  } else {
    for (const double torque : torque_) value += torque;
    is_started_ = true;
  }
  if (!std::isfinite(value)) {
    reset();
    return {.value = parameters_.offset, .fault = Fault::model_not_finite};
  }
  value_without_ = value - value_per_input_ * u;
  last_ = u;
  return {.value = value};
}

Estimate Viscoelastic::invert(double target, Features features) const noexcept {
  const double value = (target - value_without_) / value_per_input_;
  if (!std::isfinite(value) || !all_finite(features.subspan(1)))
    return detail::no_inverse(features);
  return {.value = value};
}

}  // namespace torsio
