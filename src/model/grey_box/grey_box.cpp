#include "model/grey_box/grey_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/all_finite.hpp"
#include "core/checks.hpp"
#include "core/hyperbolic_tangent.hpp"
#include "model/common/affine_inverse.hpp"

namespace torsio {
namespace {

GreyBoxTerms::Structure checked(GreyBoxTerms::Structure structure) {
  using Terms = GreyBoxTerms;
  const auto count = [](const auto& list) { return std::to_string(list.size()) + " of them"; };
  require(structure.curve_knots.size() >= 2 && structure.curve_knots.size() <= Terms::kMaxKnots &&
              all_ascending(structure.curve_knots),
          {GreyBox::kFamily, "curve_knots"}, "2 to 1000 finite, ascending numbers",
          count(structure.curve_knots));
  require(!structure.friction_knots.empty() &&
              structure.friction_knots.size() <= Terms::kMaxKnots &&
              all_ascending(structure.friction_knots),
          {GreyBox::kFamily, "friction_knots"}, "1 to 1000 finite, ascending numbers",
          count(structure.friction_knots));
  require(
      structure.thresholds.size() <= Terms::kMaxThresholds && all_positive(structure.thresholds),
      {GreyBox::kFamily, "thresholds"}, "at most 32 positive numbers", count(structure.thresholds));
  require(structure.time_constants_s.size() <= Terms::kMaxTimeConstants &&
              all_positive(structure.time_constants_s),
          {GreyBox::kFamily, "time_constants_s"}, "at most 32 positive numbers",
          count(structure.time_constants_s));
  const auto is_scale = [](double scale) { return std::isfinite(scale) && scale >= 0.0; };
  require(!structure.rate_scales.empty() && std::ranges::all_of(structure.rate_scales, is_scale),
          {GreyBox::kFamily, "rate_scales"}, "one number >= 0 for each input",
          count(structure.rate_scales));
  require(std::isfinite(structure.sample_period_s) && structure.sample_period_s > 0.0,
          {GreyBox::kFamily, "sample_period_s"}, "a positive number", structure.sample_period_s);
  require(structure.banks.size() <= Terms::kMaxBanks, {GreyBox::kFamily, "banks"}, "at most 64",
          count(structure.banks));
  for (std::size_t k = 0; k < structure.banks.size(); ++k)
    structure.banks[k].check(structure.inputs(), "grey_box: banks/" + std::to_string(k));
  return structure;
}

/// The sum of terms times their coefficients. Each addition waits for the one before it, so two hats are one.
template <class Coefficient>
struct TermSum {
  const Coefficient& coefficient;
  double value = 0.0;

  void operator()(std::size_t column, double term) { value += coefficient(column) * term; }
  void hats(std::size_t column, double share, double factor) {
    value += (coefficient(column) * (1.0 - share) + coefficient(column + 1) * share) * factor;
  }
};
template <class Coefficient>
TermSum(const Coefficient&) -> TermSum<Coefficient>;

}  // namespace

GreyBoxTerms::GreyBoxTerms(Structure structure)
    : structure_(checked(std::move(structure))),
      slips_(detail::relative_stops(structure_.thresholds, GreyBox::kFamily)) {
  detail::add_relaxations(structure_.time_constants_s, structure_.sample_period_s, decay_, gain_);
  std::size_t states = slips_.size() + decay_.size();
  for (const InputBank& bank : structure_.banks) {
    banks_.emplace_back(bank, structure_.sample_period_s, GreyBox::kFamily);
    states += bank.states();
  }
  state_.assign(states, 0.0);
  constexpr double kLargest = std::numeric_limits<double>::max();  // 0 times it is 0
  for (const double scale : structure_.rate_scales)
    rate_factors_.push_back(scale > 0.0 ? std::min(1.0 / scale, kLargest) : 0.0);
}

void GreyBoxTerms::reset() noexcept {
  slips_.reset();
  for (InputBankTerms& bank : banks_) bank.reset();
  std::ranges::fill(state_, 0.0);
  last_ = 0.0;
  is_started_ = false;
}

void GreyBoxTerms::move(Features features) noexcept {
  const double x = features[0];
  const double dx = is_started_ ? x - last_ : 0.0;
  last_ = x;
  is_started_ = true;
  curve_cell_ = detail::cell_of(structure_.curve_knots, x, curve_cell_);
  if (structure_.friction_knots.size() > 1)
    friction_cell_ = detail::cell_of(structure_.friction_knots, x, friction_cell_);
  slips_.move(dx);
  std::ranges::copy(slips_.forces(), state_.begin());
  const std::size_t slips = slips_.size();
  for (std::size_t j = 0; j < decay_.size(); ++j)
    state_[slips + j] = decay_[j] * state_[slips + j] + gain_[j] * dx;
  auto to = state_.begin() + static_cast<std::ptrdiff_t>(slips + decay_.size());
  for (std::size_t k = 0; k < banks_.size(); ++k) {
    banks_[k].move(features[structure_.banks[k].input]);
    to = std::ranges::copy(banks_[k].state(), to).out;
  }
}

void GreyBoxTerms::set_state(std::span<const double> state) noexcept {
  const std::size_t slips = slips_.size();
  const std::size_t states = slips + decay_.size();
  slips_.set_forces(state.first(slips));
  std::ranges::copy(slips_.forces(), state_.begin());
  for (std::size_t j = slips; j < states; ++j)
    if (std::isfinite(state[j])) state_[j] = state[j];
  std::size_t first = states;
  for (InputBankTerms& bank : banks_) {
    const std::size_t count = bank.state().size();
    bank.set_state(state.subspan(first, count));
    std::ranges::copy(bank.state(), state_.begin() + static_cast<std::ptrdiff_t>(first));
    first += count;
  }
}

void GreyBoxTerms::get_last(std::span<double> inputs) const noexcept {
  inputs[0] = last_;
  for (std::size_t k = 0; k < banks_.size(); ++k) inputs[k + 1] = banks_[k].last();
}

void GreyBoxTerms::set_last(std::span<const double> inputs) noexcept {
  last_ = inputs[0];
  is_started_ = true;
  for (std::size_t k = 0; k < banks_.size(); ++k) banks_[k].set_last(inputs[k + 1]);
}

void GreyBoxTerms::jump_banks(Features features, std::span<double> state) const noexcept {
  for (std::size_t k = 0; k < banks_.size(); ++k) {
    banks_[k].jump(features[structure_.banks[k].input], state);
    state = state.subspan(structure_.banks[k].states());
  }
}

GreyBox::GreyBox(Parameters parameters)
    : parameters_(std::move(parameters)),
      terms_(parameters_.terms),
      coefficients_(parameters_.coefficients, parameters_.terms.inputs(), kFamily) {
  require(coefficients_.size() == parameters_.terms.columns(), {GreyBox::kFamily, "coefficients"},
          "one column for each term", std::to_string(coefficients_.size()) + " columns");
  jumped_.resize(terms_.bank_states());
  banks_follow_x_ = std::ranges::any_of(parameters_.terms.banks, &InputBank::follows_x);
  if (!parameters_.residual) return;
  correction_.emplace(*parameters_.residual);
  const std::size_t expected = input_count() + parameters_.terms.thresholds.size();
  require(correction_->input_count() == expected, {GreyBox::kFamily, "residual"},
          "the inputs of the box and its slips",
          std::to_string(correction_->input_count()) + " inputs");
  correction_inputs_.resize(expected);
}

std::size_t GreyBox::parameter_count() const noexcept {
  return coefficients_.fitted_count() + (correction_ ? correction_->parameter_count() : 0);
}

ModelMemory GreyBox::memory(const InputRanges& ranges) const {
  const GreyBoxTerms::Structure& structure = parameters_.terms;
  const std::size_t knots = structure.friction_knots.size();
  ModelMemory memory;
  double widest = 0.0;
  for (std::size_t i = 0; i < structure.thresholds.size(); ++i) {
    double weight = 0.0;
    for (std::size_t k = 0; k < knots; ++k)
      weight = std::max(weight, coefficients_.largest(structure.first_slip() + i * knots + k));
    memory.slips.push_back({weight / structure.thresholds[i], 2.0 * structure.thresholds[i]});
    widest = std::max(widest, structure.thresholds[i]);
  }
  if (parameters_.residual && widest > 0.0)
    memory.slips.push_back({parameters_.residual->bound / widest, 2.0 * widest});
  const double width = ranges.width(0);
  for (std::size_t j = 0; j < structure.time_constants_s.size(); ++j)
    memory.relaxations.push_back({width * coefficients_.largest(structure.first_relaxation() + j),
                                  structure.time_constants_s[j]});
  std::size_t column = structure.first_bank();
  for (const InputBank& bank : structure.banks) {
    const std::size_t forces = bank.force_knots.size();
    for (std::size_t i = 0; i < bank.thresholds.size(); ++i) {
      double weight = 0.0;
      for (std::size_t k = 0; k < forces; ++k)
        weight = std::max(weight, coefficients_.largest(column + i * forces + k));
      memory.slips.push_back({weight / bank.thresholds[i], 2.0 * bank.thresholds[i], bank.input,
                              bank.is_integrated ? structure.sample_period_s : 0.0});
    }
    for (std::size_t j = 0; j < bank.time_constants_s.size(); ++j)
      memory.relaxations.push_back(
          {ranges.width(bank.input) * coefficients_.largest(column + bank.first_relaxation() + j),
           bank.time_constants_s[j], bank.input});
    column += bank.columns();
  }
  return memory;
}

/// @param use is called with the coefficients at these features, as a function of the column
template <class Use>
auto GreyBox::with_coefficients(Features features, const Use& use) const noexcept {
  const CoefficientSchedule& schedule = coefficients_.schedule();
  if (!schedule.scheduled) {
    // Most are not, and interpolation takes a third of the step.
    const auto row = schedule.values.row(0);
    return use([row](std::size_t column) { return row[column]; });
  }
  const auto at = coefficients_.locate(features);
  return use([&](std::size_t column) { return coefficients_.coefficient(at, column); });
}

Estimate GreyBox::step(Features features) noexcept {
  terms_.move(features);
  const double value = with_coefficients(features, [&](const auto& coefficient) {
    TermSum terms{coefficient};
    terms_.visit(features, terms);
    return terms.value;
  });
  return {.value = value + residual(features)};
}

bool GreyBox::advance(Features features) noexcept {
  terms_.move(features);
  return all_finite(terms_.state());
}

double GreyBox::residual(Features features) noexcept {
  if (!correction_) return 0.0;
  std::ranges::copy(features, correction_inputs_.begin());
  correction_inputs_[0] = terms_.position();
  std::ranges::copy(state().first(parameters_.terms.thresholds.size()),
                    correction_inputs_.begin() + static_cast<std::ptrdiff_t>(features.size()));
  return correction_->value(correction_inputs_);
}

template <class Coefficient>
double GreyBox::others(const Coefficient& coefficient, Features features) const noexcept {
  const GreyBoxTerms::Structure& structure = parameters_.terms;
  double value = 0.0;
  for (std::size_t j = 1; j < features.size(); ++j) {
    value += coefficient(structure.first_slope() + j) * features[j];
    if (const double factor = terms_.rate_factors()[j]; factor > 0.0)
      value += coefficient(structure.first_coulomb() + j) *
               detail::hyperbolic_tangent(features[j] * factor);
  }
  return value;
}

/// Newton's steps from where the box is: most targets of a loop are a few knots away, and between knots and
/// limits of slips the box is linear. A step out of the bracket becomes a secant of the bracket; NaN where that
/// does not end soon. @param rise of the curve
template <class Error>
double GreyBox::near_root(const Error& error_at, double rise, double wanted) const noexcept {
  constexpr int kSteps = 8;
  constexpr double kShare = 1e-13;
  struct End {
    double x;
    double error = std::numeric_limits<double>::quiet_NaN();
  };
  const std::vector<double>& knots = parameters_.terms.curve_knots;
  const double enough = kShare * (std::abs(rise) + std::abs(wanted));
  if (!std::isfinite(enough)) return std::numeric_limits<double>::quiet_NaN();
  End low{.x = knots.front()};
  End high{.x = knots.back()};
  double x = std::min(std::max(terms_.position(), low.x), high.x);
  for (int i = 0; i < kSteps; ++i) {
    const detail::Sloped error = error_at(x);
    if (std::abs(error.value) <= enough) return x;
    (error.value < 0.0 ? low : high) = {.x = x, .error = error.value};
    x -= error.value / error.slope;
    if (!(x > low.x && x < high.x))
      x = (low.x * high.error - high.x * low.error) / (high.error - low.error);
    if (!(x > low.x && x < high.x)) break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Estimate GreyBox::invert(double target, Features features) noexcept {
  const CoefficientSchedule& schedule = coefficients_.schedule();
  if (schedule.scheduled && schedule.feature == 0) return detail::no_inverse(features);
  return with_coefficients(
      features, [&](const auto& coefficient) { return solved(coefficient, target, features); });
}

template <class Coefficient>
Estimate GreyBox::solved(const Coefficient& coefficient, double target,
                         Features features) noexcept {
  double wanted = target - others(coefficient, features) - residual(features);
  terms_.jump_banks(features, jumped_);
  if (!banks_follow_x_)
    terms_.visit_banks(0.0, features, jumped_, [&](std::size_t column, double term) {
      wanted -= coefficient(column) * term;
    });
  const auto error_at = [&](double x) {
    detail::Sloped error{.value = -wanted};
    const auto add = [&](std::size_t column, const auto& term) {
      error += coefficient(column) * term;
    };
    terms_.visit_jump(x, add);
    if (banks_follow_x_)
      terms_.visit_banks(detail::Sloped{.value = x, .slope = 1.0}, features, jumped_, add);
    return error;
  };
  double low = parameters_.terms.curve_knots.front();
  double high = parameters_.terms.curve_knots.back();
  const double rise = coefficient(parameters_.terms.first_slip() - 1) - coefficient(0);
  if (const double near = near_root(error_at, rise, wanted); near >= low && near <= high)
    return {.value = near};
  double error_low = error_at(low).value;
  double error_high = error_at(high).value;
  if (!(error_low * error_high <= 0.0)) {
    // Beyond its ends the curve continues; the nearer one is left.
    const bool is_low = std::abs(error_low) < std::abs(error_high);
    const double end = is_low ? low : high;
    const double beyond = kInversionReach * (high - low);
    if (is_low) {
      high = std::exchange(low, low - beyond);
      error_high = std::exchange(error_low, error_at(low).value);
    } else {
      low = std::exchange(high, high + beyond);
      error_low = std::exchange(error_high, error_at(high).value);
    }
    if (!(error_low * error_high <= 0.0))
      return {.value = end, .fault = Fault::outside_training_range};
  }
  // Secants between the ends of the bracket; an end that stays twice is weighed down (Illinois), and
  // now and then the bracket is halved, should that still crawl.
  const double narrow = std::numeric_limits<double>::epsilon() * std::max(-low, high);
  double x = low;
  int stayed = 0;  // how often in a row: below 0 the lower end, above 0 the upper one
  for (int i = 0; i < kInversionSteps && high - low > narrow; ++i) {
    const double secant = (low * error_high - high * error_low) / (error_high - error_low);
    const bool is_inside = secant > low && secant < high;
    x = is_inside && i % 8 != 7 ? secant : 0.5 * (low + high);
    const double error = error_at(x).value;
    if (error == 0.0) break;
    if ((error < 0.0) == (error_low < 0.0)) {
      low = x;
      error_low = error;
      stayed = std::max(stayed, 0) + 1;
      if (stayed > 1) error_high *= 0.5;
    } else {
      high = x;
      error_high = error;
      stayed = std::min(stayed, 0) - 1;
      if (stayed < -1) error_low *= 0.5;
    }
  }
  return {.value = x};
}

}  // namespace torsio
