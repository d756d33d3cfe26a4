#include "torsio/model/common/model_adapter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, kUpdateOutcomes> kNames{"updated",
                                                               "limited",
                                                               "paused",
                                                               "warming_up",
                                                               "no_estimate",
                                                               "reference_not_finite",
                                                               "reference_stale",
                                                               "reference_saturated",
                                                               "error_too_large",
                                                               "dead_zone",
                                                               "rolling_back",
                                                               "reference_unconfirmed",
                                                               "reference_dead",
                                                               "reference_opposite",
                                                               "reference_unrelated",
                                                               "reference_scaled",
                                                               "reference_delayed",
                                                               "reference_outlier"};

/// What `AdaptationSettings::visit_options` states about a field, as far as it is used here: the
/// libraries of a robot have no `OptionInfo`.
struct StatedRange {
  std::string_view name;
  double minimum = 0.0;
  double maximum = 0.0;
  std::string_view help;
};

constexpr std::string_view kPlace = "adaptation";

/// NaN, the default of some, means "auto".
bool takes_auto(std::string_view name) {
  bool found = false;
  const AdaptationSettings defaults;
  AdaptationSettings::visit_options(defaults, [&](auto value, const StatedRange& stated) {
    found = found || (stated.name == name && std::isnan(static_cast<double>(value)));
  });
  return found;
}

void require_positive_setting(double value, const char* setting) {
  require(value > 0.0 && std::isfinite(value), {kPlace, setting}, "a positive number", value);
}

AdaptationSettings checked(AdaptationSettings settings, AdaptationRule rule,
                           double initial_covariance, double target_scale) {
  require_positive_setting(target_scale, "target_scale");
  AdaptationSettings::visit_options(settings, [](auto given, const StatedRange& stated) {
    const auto value = static_cast<double>(given);
    if (value >= stated.minimum && value <= stated.maximum) return;
    const bool has_auto = takes_auto(stated.name);
    if (has_auto && std::isnan(value)) return;
    refuse({kPlace, stated.name},
           fmt::format("{} to {}{}", stated.minimum, stated.maximum, has_auto ? ", or NaN" : ""),
           value);
  });
  require(settings.oldest_reference_s >= 0.0, {kPlace, "oldest_reference_s"}, "at least 0",
          settings.oldest_reference_s);
  if (settings.rule == AdaptationRule::automatic) settings.rule = rule;
  if (std::isnan(settings.initial_covariance)) settings.initial_covariance = initial_covariance;
  if (std::isnan(settings.largest_error)) settings.largest_error = target_scale;
  return settings;
}

/// @param zero what a time of 0 means.
std::size_t ticks_in(double time_s, double period_s, std::size_t zero) {
  return time_s == 0.0 ? zero : detail::ticks_in(time_s, period_s);
}

}  // namespace

std::string_view name(UpdateOutcome outcome) noexcept {
  return kNames[static_cast<std::size_t>(outcome)];
}

void detail::require_rule(AdaptationRule rule, bool is_supported, const std::string& family,
                          const std::string& supported) {
  if (is_supported) return;
  throw UsageError({.place = "adaptation method",
                    .expected = fmt::format("{} for a {}", supported, family),
                    .found = std::string(name(rule))});
}

ModelAdapter::ModelAdapter(const AdaptationSettings& settings, const Defaults& defaults,
                           double target_scale, double sample_period_s)
    : settings_((require_positive_setting(sample_period_s, "sample_period_s"),
                 checked(settings, defaults.rule, defaults.initial_covariance, target_scale))),
      target_scale_(target_scale),
      frozen_after_ticks_(ticks_in(settings.frozen_after_s, sample_period_s,
                                   std::numeric_limits<std::size_t>::max())),
      comparison_(ticks_in(settings.comparison_s, sample_period_s, 0)) {}

void ModelAdapter::reset() noexcept {
  roll_back();
  restore_at_once();
  counts_ = {};
  has_step_ = false;
  last_reference_ = kNotMeasured;
  unchanged_ticks_ = 0;
}

void ModelAdapter::end_step(double frozen_value, double adapted_value) noexcept {
  frozen_value_ = frozen_value;
  adapted_value_ = adapted_value;
  has_step_ = true;
}

UpdateOutcome ModelAdapter::learn(const ReferenceSample& reference,
                                  UpdateOutcome opinion) noexcept {
  if (paused_) return counted(UpdateOutcome::paused);
  const UpdateOutcome verdict = outcome_of(reference, opinion);
  has_step_ = false;
  if (verdict != UpdateOutcome::updated) return counted(verdict);
  return counted(update((reference.value - adapted_value_) / target_scale_));
}

UpdateOutcome ModelAdapter::pass_over(UpdateOutcome reason) noexcept {
  has_step_ = false;
  if (paused_) return counted(UpdateOutcome::paused);
  compare_nothing();
  return counted(reason);
}

UpdateOutcome ModelAdapter::outcome_of(const ReferenceSample& reference,
                                       UpdateOutcome opinion) noexcept {
  const double value = reference.value;
  // A slower sensor has no new information between its samples: steps with an unchanged value are
  // counted.
  const bool is_new = std::isfinite(value) && value != last_reference_;
  unchanged_ticks_ = is_new ? 0 : unchanged_ticks_ + 1;
  if (is_new) last_reference_ = value;
  UpdateOutcome doubt = doubt_about(reference);
  if (doubt == UpdateOutcome::updated) doubt = opinion;
  if (doubt != UpdateOutcome::updated) {
    compare_nothing();
    return doubt;
  }
  compare(std::abs(value - adapted_value_), std::abs(value - frozen_value_));
  // Only now: the comparison may have rolled the weights back.
  const double error = std::abs(value - adapted_value_);
  if (error > settings_.largest_error) return UpdateOutcome::error_too_large;
  if (error < settings_.dead_zone * settings_.sensor_std) return UpdateOutcome::dead_zone;
  return UpdateOutcome::updated;
}

UpdateOutcome ModelAdapter::doubt_about(const ReferenceSample& reference) const noexcept {
  if (!has_step_) return UpdateOutcome::no_estimate;
  if (!std::isfinite(reference.value)) return UpdateOutcome::reference_not_finite;
  // First: at the end of its range a sensor does not change either.
  if (std::abs(reference.value) >= settings_.saturation) return UpdateOutcome::reference_saturated;
  if (!(reference.age_s <= settings_.oldest_reference_s) || unchanged_ticks_ >= frozen_after_ticks_)
    return UpdateOutcome::reference_stale;
  return UpdateOutcome::updated;
}

void ModelAdapter::compare(double adapted_error, double frozen_error) noexcept {
  // Off from both, the sensor is wrong rather than either.
  if (std::min(adapted_error, frozen_error) > settings_.largest_error) return compare_nothing();
  if (comparison_.step(adapted_error * adapted_error, frozen_error * frozen_error))
    discard_what_was_learned();
}

void ModelAdapter::compare_nothing() noexcept {
  if (comparison_.pass()) discard_what_was_learned();
}

void ModelAdapter::discard_what_was_learned() noexcept {
  roll_back();
  ++counts_.roll_backs;
}

void ModelAdapter::roll_back() noexcept {
  restore();
  adapted_value_ = frozen_value_;
  comparison_.reset();
}

UpdateOutcome ModelAdapter::counted(UpdateOutcome outcome) noexcept {
  ++counts_.outcomes[static_cast<std::size_t>(outcome)];
  return outcome;
}

}  // namespace torsio
