#include "model/grey_box_adapter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/all_finite.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

/// Smallest and largest of some columns over the schedule.
std::pair<double, double> range_of(const Matrix& values, std::size_t first, std::size_t end) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t k = 0; k < values.rows; ++k)
    for (std::size_t column = first; column < end; ++column) {
      low = std::min(low, values(k, column));
      high = std::max(high, values(k, column));
    }
  return {low, high};
}

double largest_of(const Matrix& values, std::size_t first, std::size_t end) {
  if (first == end) return 0.0;
  const auto [low, high] = range_of(values, first, end);
  return std::max(std::abs(low), std::abs(high));
}

/// The standard deviation of a torque that is uniform over the elastic curve.
double spread_of(const GreyBox::Parameters& base) {
  const Matrix& values = base.coefficients.values;
  const auto [low, high] = range_of(values, 0, base.terms.first_slip());
  if (high > low) return (high - low) / (2.0 * std::numbers::sqrt3);
  const double largest = largest_of(values, 0, values.columns);
  if (!(largest > 0.0))
    throw Error({.place = "adaptation: grey_box",
                 .expected = "a coefficient that is not 0",
                 .found = "none",
                 .advice = "Fit the model first: adaptation moves a share of its coefficients."});
  return largest;
}

/// The least rise of the curve from knot to knot over the schedule, summed up; empty if it descends
/// somewhere.
std::vector<double> rises(const GreyBox::Parameters& base) {
  const Matrix& values = base.coefficients.values;
  std::vector<double> sums(base.terms.first_slip(), 0.0);
  for (std::size_t j = 1; j < sums.size(); ++j) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < values.rows; ++k)
      least = std::min(least, values(k, j) - values(k, j - 1));
    if (least < 0.0) return {};
    sums[j] = sums[j - 1] + least;
  }
  return sums;
}

}  // namespace

GreyBoxAdapter::GreyBoxAdapter(const AdaptationSettings& settings, const GreyBox::Parameters& base,
                               double sample_period_s)
    : ModelAdapter(settings, {AdaptationRule::rls, 0.05}, spread_of(base), sample_period_s),
      place_(base.terms.columns(), kNone),
      rise_(rises(base)),
      weights_(this->settings(), add_terms(base, settings.largest_change)) {
  detail::require_rule(this->settings().rule, this->settings().rule != AdaptationRule::em,
                       "grey box", "auto, rls or nlms");
  pools_.resize(rise_.size());
  if (!rise_.empty())
    for (double& sum : rise_)
      if (place_[0] != kNone) sum /= active_[place_[0]].scale;
}

std::size_t GreyBoxAdapter::add_terms(const GreyBox::Parameters& base, double largest_change) {
  const GreyBoxTerms::Structure& terms = base.terms;
  const Matrix& values = base.coefficients.values;
  const auto add_group = [&](std::size_t first, std::size_t end, bool may_be_bounded) {
    const double scale = largest_of(values, first, end);
    for (std::size_t column = first; column < end && scale > 0.0; ++column) {
      const double least = range_of(values, column, column + 1).first;
      const bool is_non_negative = may_be_bounded && least >= 0.0;
      place_[column] = active_.size();
      active_.push_back(
          {.column = column,
           .scale = scale,
           .lowest = is_non_negative ? std::max(-largest_change, -least / scale) : -largest_change,
           .is_non_negative = is_non_negative});
    }
  };
  add_group(0, terms.first_slip(), false);
  add_group(terms.first_slip(), terms.first_relaxation(), true);
  add_group(terms.first_relaxation(), terms.first_slope(), true);
  for (std::size_t column = terms.first_slope(); column < terms.first_bank(); ++column)
    add_group(column, column + 1, true);
  std::size_t first = terms.first_bank();
  for (const InputBank& bank : terms.banks) {
    const std::size_t end = first + bank.columns();
    add_group(first, first + bank.first_curve(), false);
    add_group(first + bank.first_curve(), first + bank.first_product(), false);
    add_group(first + bank.first_product(), first + bank.first_relaxation(), false);
    for (std::size_t column = first + bank.first_relaxation(); column < end; ++column)
      add_group(column, column + 1, false);
    first = end;
  }
  return active_.size();
}

Estimate GreyBoxAdapter::step(const AnyModel& model, Features features,
                              const Estimate& frozen) noexcept {
  begin_step();
  const auto* const box = model.get_if<GreyBox>();
  if (box == nullptr || box->terms().structure().columns() != place_.size()) return frozen;
  const std::span<double> regressor = weights_.regressor();
  std::ranges::fill(regressor, 0.0);
  box->terms().visit(features, [&](std::size_t column, double value) {
    if (const std::size_t at = place_[column]; at != kNone)
      regressor[at] = active_[at].scale / target_scale() * value;
  });
  const auto [correction, square] = weights_.set();
  Estimate estimate = frozen;
  estimate.value += target_scale() * correction;
  if (!std::isfinite(estimate.value) || !std::isfinite(square)) return frozen;
  end_step(frozen.value, estimate.value);
  return estimate;
}

UpdateOutcome GreyBoxAdapter::update(double error) noexcept {
  if (!weights_.update(error)) {
    count_covariance_reset();
    return UpdateOutcome::updated;
  }
  const std::span<double> deviation = weights_.deviation();
  if (!all_finite(deviation)) {
    weights_.reset();
    return UpdateOutcome::limited;
  }
  bool is_limited = make_ascending(deviation);
  const double highest = settings().largest_change;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const double inside = std::min(std::max(deviation[i], active_[i].lowest), highest);
    is_limited = is_limited || inside != deviation[i];
    deviation[i] = inside;
  }
  return is_limited ? UpdateOutcome::limited : UpdateOutcome::updated;
}

/// The nearest deviations with which the curve ascends: neighbours that do not are given their mean.
/// The bounds that follow are the same for each knot, and keep the order.
bool GreyBoxAdapter::make_ascending(std::span<double> deviation) noexcept {
  if (rise_.empty() || place_[0] == kNone) return false;
  std::size_t count = 0;
  for (std::size_t j = 0; j < rise_.size(); ++j) {
    pools_[count++] = {deviation[j] + rise_[j], 1};
    while (count > 1 && pools_[count - 1].mean() < pools_[count - 2].mean()) {
      pools_[count - 2].sum += pools_[count - 1].sum;
      pools_[count - 2].count += pools_[count - 1].count;
      --count;
    }
  }
  if (count == rise_.size()) return false;
  std::size_t j = 0;
  for (std::size_t pool = 0; pool < count; ++pool)
    for (std::size_t i = 0; i < pools_[pool].count; ++i, ++j)
      deviation[j] = pools_[pool].mean() - rise_[j];
  return true;
}

double GreyBoxAdapter::relative_change() const noexcept {
  double largest = 0.0;
  for (const double d : weights_.deviation()) largest = std::max(largest, std::abs(d));
  return largest;
}

AnyParameters GreyBoxAdapter::adapted(AnyParameters base) const {
  auto& own = base.get<GreyBox::Parameters>();
  Matrix& values = own.coefficients.values;
  const std::span<const double> deviation = weights_.deviation();
  for (std::size_t k = 0; k < values.rows; ++k) {
    for (std::size_t i = 0; i < active_.size(); ++i) {
      double& coefficient = values(k, active_[i].column);
      coefficient += active_[i].scale * deviation[i];
      // Rounding must not leave the bounds.
      if (active_[i].is_non_negative) coefficient = std::max(coefficient, 0.0);
    }
    for (std::size_t j = 1; j < rise_.size(); ++j)
      values(k, j) = std::max(values(k, j), values(k, j - 1));
  }
  return base;
}

}  // namespace torsio
