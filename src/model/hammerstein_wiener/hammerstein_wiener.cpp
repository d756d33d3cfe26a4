#include "model/hammerstein_wiener/hammerstein_wiener.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/all_finite.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kFamily = HammersteinWiener::kFamily;

void check_sections(const Sections& sections) {
  require(sections.columns == kSectionColumns && sections.rows >= 1 &&
              sections.rows <= kMaxSections &&
              sections.values.size() == sections.rows * sections.columns,
          {kFamily, "sections"}, "1 to 50 rows of b0 b1 b2 a1 a2",
          std::to_string(sections.rows) + " x " + std::to_string(sections.columns));
  require(all_finite(sections.values), {kFamily, "sections"}, "finite numbers",
          "one that is not finite");
  require(is_stable(sections), {kFamily, "sections"}, "poles inside the unit circle",
          "one that is not");
}

HammersteinWiener::Parameters checked(HammersteinWiener::Parameters p) {
  require(p.inputs >= 1, {kFamily, "inputs"}, "1 or more", "0");
  require(std::isfinite(p.sample_period_s) && p.sample_period_s > 0.0, {kFamily, "sample_period_s"},
          "a positive number", p.sample_period_s);
  require(std::isfinite(p.rest_input), {kFamily, "rest_input"}, "a finite number", p.rest_input);
  p.input.check("hammerstein_wiener: input");
  p.output.check("hammerstein_wiener: output");
  check_sections(p.sections);
  require(std::isfinite(p.lowest) && std::isfinite(p.highest) && p.lowest < p.highest,
          {kFamily, "lowest"}, "finite, below highest",
          as_text(p.lowest) + " and " + as_text(p.highest));
  const Interval part = monotone_part(p.output, {p.lowest, p.highest});
  constexpr double kRounding = 1e-6;  // an end may be the very turn
  const double room = kRounding * (p.highest - p.lowest);
  require(part.lowest - p.lowest <= room && p.highest - part.highest <= room, {kFamily, "output"},
          "a curve that is monotone from lowest to highest",
          "a turn at " + as_text(part.lowest - p.lowest > room ? part.lowest : part.highest));
  return p;
}

}  // namespace

HammersteinWiener::HammersteinWiener(Parameters parameters)
    : parameters_(checked(std::move(parameters))), state_(2 * parameters_.sections.rows) {
  reset();
}

std::size_t HammersteinWiener::parameter_count() const noexcept {
  const std::vector<double>& sections = parameters_.sections.values;
  const auto of_g = sections.size() - static_cast<std::size_t>(std::ranges::count(sections, 0.0));
  constexpr std::size_t kFree = 3;
  const std::size_t all = parameters_.input.values.size() + of_g + parameters_.output.values.size();
  return std::max(all, kFree + parameters_.sections.rows) - kFree - (parameters_.sections.rows - 1);
}

ModelMemory HammersteinWiener::memory(const InputRanges& ranges) const {
  constexpr int kSamples = 200;
  double lowest = parameters_.input(ranges.lowest[0]);
  double highest = lowest;
  double steepest = 0.0;
  for (int i = 0; i <= kSamples; ++i) {
    const double share = double{1} * i / kSamples;
    const double w = parameters_.input(std::lerp(ranges.lowest[0], ranges.highest[0], share));
    lowest = std::min(lowest, w);
    highest = std::max(highest, w);
    const double x = std::lerp(parameters_.lowest, parameters_.highest, share);
    steepest = std::max(steepest, std::abs(parameters_.output.slope(x)));
  }
  ModelMemory memory;
  for (const Mode& mode : modes(parameters_.sections)) {
    const double radius = std::abs(mode.pole);
    const double gain = steepest * (highest - lowest) * mode.residue / (1.0 - radius);
    if (!std::isfinite(gain)) return {.is_declared = false};  // poles on top of each other
    memory.relaxations.push_back({gain, -parameters_.sample_period_s / std::log(radius)});
  }
  return memory;
}

void HammersteinWiener::reset() noexcept {
  const Sections& g = parameters_.sections;
  double x = parameters_.input(parameters_.rest_input);
  for (std::size_t i = 0; i < g.rows; ++i) {
    const double y = x * (g(i, 0) + g(i, 1) + g(i, 2)) / (1.0 + g(i, 3) + g(i, 4));
    state_[2 * i + 1] = g(i, 2) * x - g(i, 4) * y;
    state_[2 * i] = g(i, 1) * x - g(i, 3) * y + state_[2 * i + 1];
    x = y;
  }
  value_ = parameters_.output(std::clamp(x, parameters_.lowest, parameters_.highest));
}

Estimate HammersteinWiener::step(Features features) noexcept {
  double x = parameters_.input(features[0]);
  // An input so far out that its curve overflows would stay in the memory for ever.
  constexpr double kLargest = 1e100;
  if (!(std::abs(x) < kLargest)) return {.value = value_, .fault = Fault::model_not_finite};
  const double* g = parameters_.sections.values.data();
  double* state = state_.data();
  for (std::size_t i = 0; i < parameters_.sections.rows; ++i, g += kSectionColumns, state += 2) {
    const double y = g[0] * x + state[0];
    state[0] = g[1] * x - g[3] * y + state[1];
    state[1] = g[2] * x - g[4] * y;
    x = y;
  }
  const double held = std::min(std::max(x, parameters_.lowest), parameters_.highest);
  value_ = parameters_.output(held);
  const double border = kBorder * (parameters_.highest - parameters_.lowest);
  return {.value = value_,
          .fault = std::abs(x - held) <= border ? Fault::none : Fault::outside_training_range};
}

void HammersteinWiener::set_state(std::span<const double> state) noexcept {
  for (std::size_t i = 0; i < state_.size(); ++i)
    if (std::isfinite(state[i])) state_[i] = state[i];
}

namespace {

constexpr double kPeriod_s = 0.005;

}  // namespace

ContinuousTransfer continuous_of(Paper003 form) {
  switch (form) {
    case Paper003::discrete:
      return tustin(DiscreteTransfer{{1.0, -0.9989, 0.0}, {1.0, -0.5793, -0.417}}, kPeriod_s);
    case Paper003::tustin: return {{1.72, 688.3, 152.2}, {1.0, 975.3, 520.1}};
    case Paper003::refined: break;
  }
  constexpr double kLead = 14.008;  // printed in front of s^2
  return {{10.618 / kLead, 11.348 / kLead, 0.519 / kLead}, {1.0, 21.642 / kLead, 2.542 / kLead}};
}

HammersteinWiener::Parameters hammerstein_wiener_of(Paper003 form, std::size_t inputs) {
  const DiscreteTransfer transfer = form == Paper003::discrete
                                        ? DiscreteTransfer{{1.0, -0.9989}, {1.0, -0.5793, -0.417}}
                                        : first_order_hold(continuous_of(form), kPeriod_s);
  HammersteinWiener::Parameters parameters{
      .inputs = inputs,
      .sample_period_s = kPeriod_s,
      .input = {.values = {-226.65, 1137.56, 3.4e-2}, .half_range = std::numbers::pi / 180.0},
      .sections = sections_of(transfer),
      .output = {.values = {0.0309, 0.187e-2, -0.649e-7, -0.141e-10}}};
  const Interval monotone = monotone_part(parameters.output, {-1e5, 1e5});
  parameters.lowest = monotone.lowest;
  parameters.highest = monotone.highest;
  return parameters;
}

}  // namespace torsio
