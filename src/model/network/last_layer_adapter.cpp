#include "torsio/model/network/last_layer_adapter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "model/network/adaptation_kernels.hpp"
#include "model/network/network_checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kMaxTicks = 1e9;

constexpr std::array<std::string_view, kUpdateOutcomes> kNames{
    "updated",         "limited",
    "paused",          "warming_up",
    "no_estimate",     "reference_not_finite",
    "reference_stale", "reference_saturated",
    "error_too_large", "dead_zone"};

/// What `AdaptationSettings::visit_options` states about a field, as far as it is used here: the
/// libraries of a robot have no `OptionInfo`.
struct StatedRange {
  std::string_view name;
  double minimum = 0.0;
  double maximum = 0.0;
  std::string_view help;
};

[[noreturn]] void refuse(std::string_view setting, std::string expected, double found) {
  throw Error({.place = fmt::format("adaptation: {}", setting),
               .expected = std::move(expected),
               .found = fmt::format("{}", found)});
}

/// NaN, the default of some, means "auto".
bool takes_auto(std::string_view name) {
  bool found = false;
  const AdaptationSettings defaults;
  AdaptationSettings::visit_options(defaults, [&](double value, const StatedRange& stated) {
    found = found || (stated.name == name && std::isnan(value));
  });
  return found;
}

void check(const AdaptationSettings& settings) {
  AdaptationSettings::visit_options(settings, [](double value, const StatedRange& stated) {
    if (value >= stated.minimum && value <= stated.maximum) return;
    const bool has_auto = takes_auto(stated.name);
    if (has_auto && std::isnan(value)) return;
    refuse(stated.name,
           fmt::format("{} to {}{}", stated.minimum, stated.maximum, has_auto ? ", or NaN" : ""),
           value);
  });
  if (!(settings.oldest_reference_s >= 0.0))
    refuse("oldest_reference_s", "at least 0", settings.oldest_reference_s);
}

double length_of(const DenseLayer& layer) {
  double square = 0.0;
  const auto add = [&](float weight) {
    square += static_cast<double>(weight) * static_cast<double>(weight);
  };
  std::ranges::for_each(layer.weights.values, add);
  std::ranges::for_each(layer.bias, add);
  if (square == 0.0)
    throw Error({.place = "adaptation: last layer",
                 .expected = "a weight that is not 0",
                 .found = "none",
                 .advice = "Train the network first: adaptation moves a share of its weights."});
  return std::sqrt(square);
}

/// @param zero what a time of 0 means.
std::size_t ticks_in(double time_s, double period_s, std::size_t zero) {
  if (time_s == 0.0) return zero;
  return static_cast<std::size_t>(std::clamp(std::ceil(time_s / period_s), 1.0, kMaxTicks));
}

std::size_t padded(std::size_t count) {
  const std::size_t lanes = adaptation_kernels::lanes();
  return (count + lanes - 1) / lanes * lanes;
}

}  // namespace

std::string_view name(UpdateOutcome outcome) noexcept {
  return kNames[static_cast<std::size_t>(outcome)];
}

LastLayerAdapter::LastLayerAdapter(const AdaptationSettings& settings, const DenseLayer& last,
                                   double target_scale, double sample_period_s)
    : settings_((check(settings), check_positive(sample_period_s, "adaptation: sample_period_s"),
                 settings)),
      frozen_(last),
      target_scale_(target_scale),
      bound_(settings.largest_change * length_of(last)),
      frozen_after_ticks_(ticks_in(settings.frozen_after_s, sample_period_s,
                                   std::numeric_limits<std::size_t>::max())),
      features_(last.weights.columns),
      deviation_(padded(features_ + 1), 0.0),
      extended_(deviation_),
      comparison_(ticks_in(settings.comparison_s, sample_period_s, 0)) {
  check_layer(last, features_, "adaptation: last layer");
  check_last_layer(last, "adaptation: last layer");
  check_positive(target_scale, "adaptation: target_scale");
  if (std::isnan(settings_.largest_error)) settings_.largest_error = target_scale;
  if (settings_.rule != AdaptationRule::rls) return;
  if (features_ > kMaxRlsFeatures)
    throw Error({.place = "adaptation: rls",
                 .expected = fmt::format("at most {} features of the last layer", kMaxRlsFeatures),
                 .found = fmt::format("{}", features_),
                 .advice = "Use nlms: its cost grows with the features, not their square."});
  pending_ = product_ = deviation_;
  covariance_.resize(adaptation_kernels::triangle_size(deviation_.size()));
  reset_covariance();
}

void LastLayerAdapter::reset() noexcept {
  roll_back();
  counts_ = {};
  has_step_ = false;
  last_reference_ = kNotMeasured;
  unchanged_ticks_ = 0;
}

double LastLayerAdapter::step(std::span<const float> features, double frozen_value) noexcept {
  has_step_ = false;
  if (features.size() != features_) return frozen_value;
  const auto [correction, square] =
      adaptation_kernels::extend(features.data(), features_, deviation_.data(), extended_.data());
  const double adapted = frozen_value + target_scale_ * correction;
  if (!std::isfinite(adapted) || !std::isfinite(square)) return frozen_value;
  extended_square_ = square;
  frozen_value_ = frozen_value;
  adapted_value_ = adapted;
  has_step_ = true;
  return adapted;
}

UpdateOutcome LastLayerAdapter::learn(const ReferenceSample& reference) noexcept {
  if (paused_) return counted(UpdateOutcome::paused);
  const UpdateOutcome verdict = outcome_of(reference);
  has_step_ = false;
  if (verdict != UpdateOutcome::updated) return counted(verdict);
  const double error = (reference.value - adapted_value_) / target_scale_;
  square_ = settings_.rule == AdaptationRule::nlms ? nlms(error) : rls(error);
  if (square_ <= bound_ * bound_) return counted(UpdateOutcome::updated);
  // A hair inside, so that rounding does not leave it outside.
  const double shrink = (1.0 - 1e-12) * bound_ / std::sqrt(square_);
  square_ = adaptation_kernels::blend(deviation_.data(), shrink, 0.0, extended_.data(),
                                      deviation_.size());
  return counted(UpdateOutcome::limited);
}

UpdateOutcome LastLayerAdapter::pass_over(UpdateOutcome reason) noexcept {
  has_step_ = false;
  if (paused_) return counted(UpdateOutcome::paused);
  compare(0.0, 0.0);
  return counted(reason);
}

UpdateOutcome LastLayerAdapter::outcome_of(const ReferenceSample& reference) noexcept {
  const double value = reference.value;
  // A slower sensor has no new information between its samples: steps with an unchanged value are
  // counted.
  const bool is_new = std::isfinite(value) && value != last_reference_;
  unchanged_ticks_ = is_new ? 0 : unchanged_ticks_ + 1;
  if (is_new) last_reference_ = value;
  const UpdateOutcome doubt = doubt_about(reference);
  if (doubt != UpdateOutcome::updated) {
    compare(0.0, 0.0);
    return doubt;
  }
  compare(std::abs(value - adapted_value_), std::abs(value - frozen_value_));
  // Only now: the comparison may have rolled the weights back.
  const double error = std::abs(value - adapted_value_);
  if (error > settings_.largest_error) return UpdateOutcome::error_too_large;
  if (error < settings_.dead_zone * settings_.sensor_std) return UpdateOutcome::dead_zone;
  return UpdateOutcome::updated;
}

UpdateOutcome LastLayerAdapter::doubt_about(const ReferenceSample& reference) const noexcept {
  if (!has_step_) return UpdateOutcome::no_estimate;
  if (!std::isfinite(reference.value)) return UpdateOutcome::reference_not_finite;
  if (!(reference.age_s <= settings_.oldest_reference_s) || unchanged_ticks_ >= frozen_after_ticks_)
    return UpdateOutcome::reference_stale;
  if (std::abs(reference.value) >= settings_.saturation) return UpdateOutcome::reference_saturated;
  return UpdateOutcome::updated;
}

void LastLayerAdapter::compare(double adapted_error, double frozen_error) noexcept {
  // Off from both, the sensor is wrong rather than either.
  if (std::min(adapted_error, frozen_error) > settings_.largest_error)
    adapted_error = frozen_error = 0.0;
  if (!comparison_.step(adapted_error * adapted_error, frozen_error * frozen_error)) return;
  roll_back();
  ++counts_.roll_backs;
}

void LastLayerAdapter::roll_back() noexcept {
  std::ranges::fill(deviation_, 0.0);
  square_ = 0.0;
  adapted_value_ = frozen_value_;
  comparison_.reset();
  if (settings_.rule == AdaptationRule::rls) reset_covariance();
}

double LastLayerAdapter::nlms(double error) noexcept {
  const double gain = settings_.step_size * error / (settings_.regularisation + extended_square_);
  return adaptation_kernels::blend(deviation_.data(), 1.0 - settings_.leak, gain, extended_.data(),
                                   deviation_.size());
}

double LastLayerAdapter::rls(double error) noexcept {
  namespace kernels = adaptation_kernels;
  const std::size_t size = deviation_.size();
  const double trace = kernels::update_and_multiply(
      covariance_.data(), size, pending_scale_, pending_.data(), extended_.data(), product_.data());
  const double spread = kernels::dot(extended_.data(), product_.data(), size);
  const double normaliser = settings_.forgetting + spread;
  const double root = std::sqrt(normaliser);
  // What P is after this update, without having touched it.
  const double smaller = 1.0 / root;
  std::ranges::transform(product_, pending_.begin(), [&](double x) { return x * smaller; });
  const double left = trace - kernels::dot(pending_.data(), pending_.data(), size);
  if (!(spread >= 0.0) || !(left > 0.0) || !std::isfinite(normaliser)) {
    reset_covariance();
    ++counts_.covariance_resets;
    return square_;
  }
  const double cap =
      settings_.trace_cap * settings_.initial_covariance * static_cast<double>(features_ + 1);
  pending_scale_ = std::min(1.0 / settings_.forgetting, cap / left);
  return kernels::blend(deviation_.data(), 1.0, error / normaliser, product_.data(), size);
}

void LastLayerAdapter::reset_covariance() noexcept {
  std::ranges::fill(covariance_, 0.0);
  for (std::size_t row = 0; row <= features_; ++row)
    covariance_[adaptation_kernels::diagonal_index(row)] = settings_.initial_covariance;
  std::ranges::fill(pending_, 0.0);
  pending_scale_ = 1.0;
}

UpdateOutcome LastLayerAdapter::counted(UpdateOutcome outcome) noexcept {
  ++counts_.outcomes[static_cast<std::size_t>(outcome)];
  return outcome;
}

double LastLayerAdapter::relative_change() const noexcept {
  return settings_.largest_change * std::sqrt(square_) / bound_;
}

DenseLayer LastLayerAdapter::adapted() const {
  DenseLayer layer = frozen_;
  const auto moved = [](float weight, double by) {
    return static_cast<float>(static_cast<double>(weight) + by);
  };
  for (std::size_t j = 0; j < features_; ++j)
    layer.weights(0, j) = moved(layer.weights(0, j), deviation_[j]);
  layer.bias.front() = moved(layer.bias.front(), deviation_[features_]);
  return layer;
}

}  // namespace torsio
