#include "model/dgmm_adapter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

/// The median over the components of the root mean variance of the inputs.
double median_radius(const GaussianMixture& mixture) {
  const std::size_t d = mixture.dimension();
  std::vector<double> radii;
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    double sum = 0.0;
    for (std::size_t j = 1; j < d; ++j) sum += mixture.covariances(i, j * d + j);
    radii.push_back(std::sqrt(sum / static_cast<double>(d - 1)));
  }
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  return *middle;
}

/// Rows of `matrix`, and `more` without content.
Matrix with_room(const Matrix& matrix, std::size_t more) {
  Matrix result = matrix;
  result.rows += more;
  result.values.resize(result.rows * result.columns, 0.0);
  return result;
}

DgmmAdapter::Limits checked(DgmmAdapter::Limits limits) {
  if (limits.components == 0 || !(limits.least_share > 0.0 && limits.least_share < 1.0))
    throw Error({.place = "adaptation: dgmm",
                 .expected = "at least one component that learns, and a share between 0 and 1",
                 .found = fmt::format("{} and {}", limits.components, limits.least_share)});
  return limits;
}

/// Operations of `MixtureRegression::set`: factor, inverse, slope and variance; ten for a root or a
/// logarithm.
constexpr std::size_t set_operations(std::size_t n) {
  return 2 * (n * n * n / 3 + n * n * n / 3 + n * n + n * n + 2 * n) + 10 * (2 * n + 1);
}
/// Operations of `DgmmAdapter::move` without it.
constexpr std::size_t move_operations(std::size_t dimension) {
  return 8 + 9 * dimension + 6 * dimension * dimension;
}

}  // namespace

DgmmAdapter::DgmmAdapter(const AdaptationSettings& settings, const Dgmm::Parameters& base,
                         double sample_period_s, const Limits& limits)
    : ModelAdapter(settings, {AdaptationRule::em}, base.mixture.scale.at(0), sample_period_s),
      base_(base.mixture),
      thin_log_density_(base.clamp.thin_log_density),
      limits_(
          (detail::require_rule(this->settings().rule, this->settings().rule == AdaptationRule::em,
                                "dgmm", "auto or em"),
           checked(limits))),
      regression_(base.mixture, 0, settings.new_components),
      means_(with_room(base_.means, settings.new_components)),
      covariances_(with_room(base_.covariances, settings.new_components)),
      first_means_(means_),
      first_covariances_(covariances_),
      is_touched_(means_.rows, 0),
      touched_(means_.rows, 0),
      shares_(limits.components),
      sample_(base_.dimension()),
      offset_(base_.dimension()) {
  novelty_square_ = 4.0 * std::pow(median_radius(base_), 2);
  const double samples = settings.component_samples * static_cast<double>(base_.size());
  for (const double weight : base_.weights) first_counts_.push_back(weight * samples);
  first_total_ = std::accumulate(first_counts_.begin(), first_counts_.end(), 0.0);
  counts_ = first_counts_;
  counts_.resize(means_.rows, 0.0);
  total_ = first_total_;
  for (std::size_t i = 0; i < base_.size(); ++i)
    (void)regression_.set(i, counts_[i], means_.row(i), covariances_.row(i));
  regression_.set_total(total_);
  regression_.keep_bounds();
}

Estimate DgmmAdapter::step(const AnyModel& model, Features features,
                           const Estimate& frozen) noexcept {
  const auto* const own = model.get_if<Dgmm>();
  begin_step();
  return own == nullptr ? frozen : step(*own, features, frozen);
}

Estimate DgmmAdapter::step(const Dgmm& model, Features features, const Estimate& frozen) noexcept {
  begin_step();
  operations_ = 0;
  if (is_restoring_) restore_some(limits_.components);
  const Conditional given = regression_.query(features);
  log_density_ = given.log_density;
  const Estimate adapted =
      has_changed() && !is_restoring_ ? model.estimate_of(given, features) : frozen;
  if (!std::isfinite(adapted.value) || adapted.fault != Fault::none) return frozen;
  adapted_value_ = adapted.value;
  end_step(frozen.value, adapted.value);
  return adapted;
}

UpdateOutcome DgmmAdapter::update(double error) noexcept {
  if (is_restoring_) return UpdateOutcome::rolling_back;
  sample_[0] = (adapted_value_ + error * target_scale() - base_.centre[0]) / base_.scale[0];
  std::ranges::copy(regression_.standardised(), sample_.begin() + 1);
  const std::size_t count = regression_.heaviest(limits_.least_share, shares_);
  const std::size_t inputs = sample_.size() - 1;
  operations_ += regression_.scanned() + count * (inputs * (inputs + 5) + 12);
  if (count == 0) return UpdateOutcome::no_estimate;
  if (log_density_ < thin_log_density_ && settings().new_components > 0) {
    double square = 0.0;
    const std::size_t like = nearest(count, square);
    if (square > novelty_square_) {
      add(like);
      return UpdateOutcome::updated;
    }
  }
  bool is_limited = false;
  for (std::size_t k = 0; k < count; ++k)
    if (shares_[k].share >= limits_.least_share)
      is_limited = move(shares_[k].component, std::min(shares_[k].share, 1.0)) || is_limited;
  regression_.set_total(total_);
  return is_limited ? UpdateOutcome::limited : UpdateOutcome::updated;
}

std::size_t DgmmAdapter::nearest(std::size_t count, double& square_distance) const noexcept {
  std::size_t found = shares_[0].component;
  square_distance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < count; ++k) {
    double square = 0.0;
    for (std::size_t j = 1; j < sample_.size(); ++j) {
      const double offset = sample_[j] - means_(shares_[k].component, j);
      square += offset * offset;
    }
    if (square < square_distance) {
      square_distance = square;
      found = shares_[k].component;
    }
  }
  return found;
}

bool DgmmAdapter::move(std::size_t component, double share) noexcept {
  const std::size_t d = sample_.size();
  const std::span<double> mean = means_.row(component);
  const std::span<double> covariance = covariances_.row(component);
  const std::span<const double> first_mean = first_means_.row(component);
  const std::span<const double> first_covariance = first_covariances_.row(component);
  touch(component);
  const double before = counts_[component];
  const double n = (1.0 - share * (1.0 - settings().forgetting)) * before + share;
  const double rate = share / n;
  counts_[component] = n;
  total_ += n - before;
  bool is_limited = false;
  for (std::size_t j = 0; j < d; ++j) {
    offset_[j] = sample_[j] - mean[j];
    const double bound = settings().largest_change * (1.0 + std::abs(first_mean[j]));
    const double moved = mean[j] + rate * offset_[j];
    mean[j] = std::clamp(moved, first_mean[j] - bound, first_mean[j] + bound);
    is_limited = is_limited || mean[j] != moved;
  }
  const double keep = 1.0 - rate;
  const double outer = keep * rate;
  const double floor = rate * kLeastCovariance;
  for (std::size_t r = 0; r < d; ++r)
    for (std::size_t c = 0; c <= r; ++c) {
      const std::size_t k = r * d + c;
      covariance[k] =
          keep * covariance[k] + outer * (offset_[r] * offset_[c]) + floor * first_covariance[k];
      covariance[c * d + r] = covariance[k];
    }
  operations_ += move_operations(d) + set_operations(d - 1);
  (void)regression_.set(component, n, mean, covariance);
  return is_limited;
}

void DgmmAdapter::add(std::size_t like) noexcept {
  std::size_t component = base_.size() + added_;
  if (component < capacity()) {
    ++added_;
  } else {
    component = base_.size();
    for (std::size_t i = component + 1; i < capacity(); ++i)
      if (counts_[i] < counts_[component]) component = i;
    operations_ += capacity() - base_.size();
    ++replaced_;
    total_ -= counts_[component];
  }
  touch(component);
  counts_[component] = 1.0;
  total_ += 1.0;
  std::ranges::copy(sample_, means_.row(component).begin());
  std::ranges::copy(sample_, first_means_.row(component).begin());
  std::ranges::copy(first_covariances_.row(like), covariances_.row(component).begin());
  std::ranges::copy(first_covariances_.row(like), first_covariances_.row(component).begin());
  operations_ += move_operations(sample_.size()) + set_operations(sample_.size() - 1);
  (void)regression_.set(component, 1.0, means_.row(component), covariances_.row(component));
  regression_.set_total(total_);
}

void DgmmAdapter::touch(std::size_t component) noexcept {
  if (is_touched_[component] != 0) return;
  is_touched_[component] = 1;
  touched_[touched_count_++] = component;
}

void DgmmAdapter::restore() noexcept { is_restoring_ = has_changed(); }

void DgmmAdapter::restore_some(std::size_t most) noexcept {
  for (std::size_t k = 0; k < most && touched_count_ > 0; ++k) {
    const std::size_t component = touched_[--touched_count_];
    is_touched_[component] = 0;
    if (component >= base_.size()) {
      counts_[component] = 0.0;
      regression_.remove(component);
      continue;
    }
    counts_[component] = first_counts_[component];
    std::ranges::copy(base_.means.row(component), means_.row(component).begin());
    std::ranges::copy(base_.covariances.row(component), covariances_.row(component).begin());
    (void)regression_.set(component, counts_[component], means_.row(component),
                          covariances_.row(component));
    operations_ += set_operations(sample_.size() - 1);
  }
  if (touched_count_ > 0) return;
  is_restoring_ = false;
  added_ = replaced_ = 0;
  total_ = first_total_;
  regression_.set_total(total_);
  regression_.reset_bounds();
}

double DgmmAdapter::relative_change() const noexcept {
  if (!has_changed() || is_restoring_) return 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < base_.size(); ++i)
    for (std::size_t j = 0; j < sample_.size(); ++j)
      sum += base_.weights[i] * std::pow(means_(i, j) - base_.means(i, j), 2);
  return std::sqrt(sum / static_cast<double>(sample_.size()));
}

GaussianMixture DgmmAdapter::mixture() const {
  if (!has_changed() || is_restoring_) return base_;
  GaussianMixture mixture = base_;
  const std::size_t m = size();
  mixture.weights.assign(counts_.begin(), counts_.begin() + static_cast<std::ptrdiff_t>(m));
  const double total = std::accumulate(mixture.weights.begin(), mixture.weights.end(), 0.0);
  for (double& weight : mixture.weights) weight /= total;
  const auto first_rows = [m](const Matrix& matrix) {
    Matrix rows = matrix;
    rows.rows = m;
    rows.values.resize(m * rows.columns);
    return rows;
  };
  mixture.means = first_rows(means_);
  mixture.covariances = first_rows(covariances_);
  return mixture;
}

AnyParameters DgmmAdapter::adapted(AnyParameters base) const {
  base.get<Dgmm::Parameters>().mixture = mixture();
  return base;
}

std::size_t DgmmAdapter::max_operations() const noexcept {
  const std::size_t inputs = sample_.size() - 1;
  const std::size_t each =
      inputs * (inputs + 5) + 12 + move_operations(sample_.size()) + 2 * set_operations(inputs);
  return capacity() + 16 + limits_.components * each + settings().new_components;
}

}  // namespace torsio
