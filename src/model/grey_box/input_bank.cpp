#include "model/grey_box/input_bank.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/all_finite.hpp"
#include "core/checks.hpp"

namespace torsio {

void InputBank::check(std::size_t inputs, const std::string& place) const {
  const auto count = [](const auto& list) { return std::to_string(list.size()) + " of them"; };
  const auto are_knots = [](const std::vector<double>& knots, std::size_t least) {
    return knots.size() >= least && knots.size() <= kMaxKnots && all_ascending(knots);
  };
  const auto require_field = [&](bool holds, std::string_view field, std::string_view expected,
                                 const std::string& found) {
    if (!holds) refuse(fmt::format("{}/{}", place, field), expected, found);
  };
  require_field(input > 0 && input < inputs, "input", "another input of the model than the first",
                std::to_string(input));
  require_field(thresholds.size() <= kMaxThresholds && all_positive(thresholds), "thresholds",
                "at most 32 positive numbers", count(thresholds));
  require_field(are_knots(force_knots, 1), "force_knots", "1 to 1000 finite, ascending numbers",
                count(force_knots));
  require_field(curve_knots.empty() || are_knots(curve_knots, 3), "curve_knots",
                "none, or 3 to 1000 finite, ascending numbers", count(curve_knots));
  require_field(product_knots.empty() || are_knots(product_knots, 2), "product_knots",
                "none, or 2 to 1000 finite, ascending numbers", count(product_knots));
  require_field(product_input < inputs && product_input != input, "product_input",
                "another input of the model", std::to_string(product_input));
  require_field(time_constants_s.size() <= kMaxTimeConstants && all_positive(time_constants_s),
                "time_constants_s", "at most 32 positive numbers", count(time_constants_s));
}

namespace detail {

SlipBank relative_stops(std::span<const double> thresholds, std::string_view place) {
  std::vector<double> per_threshold(thresholds.size());
  std::ranges::transform(thresholds, per_threshold.begin(), [](double r) { return 1.0 / r; });
  return {per_threshold, std::vector<double>(thresholds.size(), 1.0), place};
}

void add_relaxations(std::span<const double> time_constants_s, double sample_period_s,
                     std::vector<double>& decay, std::vector<double>& gain) {
  for (const double time_constant : time_constants_s) {
    const double periods = sample_period_s / time_constant;
    decay.push_back(std::exp(-periods));
    gain.push_back(-std::expm1(-periods) / periods);
  }
}

}  // namespace detail

InputBankTerms::InputBankTerms(const InputBank& bank, double sample_period_s,
                               std::string_view place)
    : slips_(detail::relative_stops(bank.thresholds, place)),
      state_(bank.states(), 0.0),
      period_s_(bank.is_integrated ? sample_period_s : 0.0) {
  detail::add_relaxations(bank.time_constants_s, sample_period_s, decay_, gain_);
}

void InputBankTerms::reset() noexcept {
  slips_.reset();
  std::ranges::fill(state_, 0.0);
  last_ = 0.0;
  is_started_ = false;
}

/// The increment of q; nothing moves at the first sample.
double InputBankTerms::travel(double u) const noexcept {
  if (!is_started_) return 0.0;
  return period_s_ > 0.0 ? period_s_ * u : u - last_;
}

void InputBankTerms::move(double u) noexcept {
  if (!std::isfinite(u)) return;
  slips_.move(travel(u));
  const std::size_t slips = slips_.size();
  std::ranges::copy(slips_.forces(), state_.begin());
  const double du = is_started_ ? u - last_ : 0.0;
  for (std::size_t j = 0; j < decay_.size(); ++j)
    state_[slips + j] = decay_[j] * state_[slips + j] + gain_[j] * du;
  last_ = u;
  is_started_ = true;
}

void InputBankTerms::set_state(std::span<const double> state) noexcept {
  const std::size_t slips = slips_.size();
  slips_.set_forces(state.first(slips));
  std::ranges::copy(slips_.forces(), state_.begin());
  for (std::size_t j = slips; j < state_.size(); ++j)
    if (std::isfinite(state[j])) state_[j] = state[j];
}

void InputBankTerms::jump(double u, std::span<double> state) const noexcept {
  const double dq = travel(u);
  const double du = is_started_ ? u - last_ : 0.0;
  const std::size_t slips = slips_.size();
  for (std::size_t i = 0; i < slips; ++i)
    state[i] = std::min(std::max(state_[i] + dq * slips_.stiffness()[i], -1.0), 1.0);
  for (std::size_t j = slips; j < state_.size(); ++j) state[j] = state_[j] + du;
}

}  // namespace torsio
