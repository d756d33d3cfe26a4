#include "torsio/estimate/torque_sources.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "core/checks.hpp"
#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

const std::string kPlace = "torque sources";

void check_target(const EstimatorSettings& settings) {
  const auto target = split_channel_name(settings.target);
  if (target && target->unit->si_suffix == "Nm") return;
  throw Error({.place = kPlace,
               .expected = "models with a torque in Nm as target",
               .found = fmt::format("'{}'", settings.target)});
}

/// Sources that were learned from one sensor have its error in common: their differences do not contain it. Zeros
/// are set afterwards.
Estimator without_target_uncertainty(Estimator estimator) {
  if (!estimator.settings().target_uncertainty.is_stated()) return estimator;
  EstimatorSettings settings = estimator.settings();
  settings.target_uncertainty = {};
  return {std::move(settings), estimator.model()};
}

}  // namespace

FrictionFilter::FrictionFilter(const Settings& settings, double sample_rate_Hz)
    : settings_(settings) {
  require_positive(kPlace, "std_dev_at_start", settings.std_dev_at_start);
  require_positive(kPlace, "drift_per_sqrt_s", settings.drift_per_sqrt_s);
  require_positive(kPlace, "correlation_s", settings.correlation_s);
  require_positive(kPlace, "sample rate", sample_rate_Hz);
  if (!(settings.lowest > 0.0 && settings.lowest < 1.0 && settings.highest > 1.0 &&
        std::isfinite(settings.highest)))
    throw Error({.place = kPlace + ": friction",
                 .expected = "bounds above 0 that contain 1",
                 .found = fmt::format("{} to {}", settings.lowest, settings.highest)});
  samples_ = std::max(1.0, settings.correlation_s * sample_rate_Hz);
  process_noise_ = settings.drift_per_sqrt_s * settings.drift_per_sqrt_s / sample_rate_Hz;
  reset();
}

void FrictionFilter::reset() noexcept { set(1.0, settings_.std_dev_at_start); }

void FrictionFilter::set(double factor, double std_dev) noexcept {
  factor_ = std::isfinite(factor) ? std::clamp(factor, settings_.lowest, settings_.highest) : 1.0;
  variance_ = std::isfinite(std_dev) ? std_dev * std_dev
                                     : settings_.std_dev_at_start * settings_.std_dev_at_start;
}

double FrictionFilter::std_dev() const noexcept { return std::sqrt(variance_); }

void FrictionFilter::step(double friction_Nm, double implied_Nm, double std_dev_Nm) noexcept {
  const double most = settings_.std_dev_at_start * settings_.std_dev_at_start;
  variance_ = std::min(variance_ + process_noise_, std::max(variance_, most));
  if (!std::isfinite(friction_Nm) || !std::isfinite(implied_Nm) || !(std_dev_Nm > 0.0)) return;
  const double noise = samples_ * std_dev_Nm * std_dev_Nm;
  const double gain = variance_ * friction_Nm / (variance_ * friction_Nm * friction_Nm + noise);
  if (!std::isfinite(gain)) return;
  factor_ = std::clamp(factor_ + gain * (implied_Nm - factor_ * friction_Nm), settings_.lowest,
                       settings_.highest);
  variance_ *= 1.0 - gain * friction_Nm;
}

Estimate TorqueSources::Fed::step(std::span<const double> raw) noexcept {
  for (std::size_t k = 0; k < places.size(); ++k) values[k] = raw[places[k]];
  return estimator.step(values);
}

TorqueSources::Fed TorqueSources::fed(Estimator estimator) {
  check_target(estimator.settings());
  estimator = without_target_uncertainty(std::move(estimator));
  const double rate_Hz = estimator.settings().sample_rate_Hz;
  if (sample_rate_Hz_ == 0.0) sample_rate_Hz_ = rate_Hz;
  if (rate_Hz != sample_rate_Hz_)
    throw Error({.place = kPlace,
                 .expected = fmt::format("models with a sample rate of {} Hz", sample_rate_Hz_),
                 .found = fmt::format("{} Hz", rate_Hz)});
  std::vector<std::size_t> places;
  places.reserve(estimator.raw_inputs().size());
  for (const std::string& name : estimator.raw_inputs()) {
    const auto found = std::ranges::find(raw_inputs_, name);
    places.push_back(static_cast<std::size_t>(found - raw_inputs_.begin()));
    if (found == raw_inputs_.end()) raw_inputs_.push_back(name);
  }
  const std::size_t count = places.size();
  return {std::move(estimator), std::move(places), std::vector<double>(count)};
}

TorqueSources::TorqueSources(std::vector<SourceModel> sources) : estimates_(sources.size()) {
  if (sources.empty())
    throw Error({.place = kPlace, .expected = "at least one model", .found = "none"});
  for (SourceModel& model : sources) {
    require_positive(kPlace, "error_bar_factor", model.error_bar_factor);
    Source source{.torque = fed(std::move(model.torque)),
                  .friction = {},
                  .filter = {},
                  .error_bar_factor = model.error_bar_factor};
    if (model.friction) {
      source.friction = fed(std::move(*model.friction));
      source.filter = FrictionFilter({}, sample_rate_Hz_);
    }
    sources_.push_back(std::move(source));
  }
  reset();
}

void TorqueSources::set_zero(std::string_view channel, double value) {
  if (std::ranges::find(raw_inputs_, channel) == raw_inputs_.end())
    throw UsageError({.place = "set_zero",
                      .expected = fmt::format("one of {}", fmt::join(raw_inputs_, ", ")),
                      .found = fmt::format("'{}'", channel),
                      .advice = did_you_mean(channel, raw_inputs_)});
  const auto set = [&](Fed& fed) {
    const std::vector<std::string>& names = fed.estimator.raw_inputs();
    if (std::ranges::find(names, channel) != names.end()) fed.estimator.set_zero(channel, value);
  };
  for (Source& source : sources_) {
    set(source.torque);
    if (source.friction) set(*source.friction);
  }
}

double TorqueSources::largest_step(std::string_view channel) const {
  double largest = std::numeric_limits<double>::infinity();
  const auto see = [&](const Fed& fed) {
    const std::vector<double>& steps = fed.estimator.settings().disturbances.largest_step;
    const std::vector<std::string>& names = fed.estimator.raw_inputs();
    for (std::size_t k = 0; k < steps.size(); ++k)
      if (names[k] == channel) largest = std::min(largest, detail::kJumpFactor * steps[k]);
  };
  for (const Source& source : sources_) {
    see(source.torque);
    if (source.friction) see(*source.friction);
  }
  return largest;
}

void TorqueSources::reset() noexcept {
  for (Source& source : sources_) {
    source.torque.estimator.reset();
    if (source.friction) source.friction->estimator.reset();
    if (source.filter) source.filter->reset();
    source.has_failed = false;
  }
  for (Estimate& estimate : estimates_) estimate = {.fault = Fault::warming_up};
}

void TorqueSources::fail_model(std::size_t source) noexcept {
  if (source < sources_.size()) sources_[source].has_failed = true;
}

void TorqueSources::refuse(Fault fault) noexcept {
  for (Estimate& estimate : estimates_) estimate.fault = fault;
}

std::span<const Estimate> TorqueSources::step(std::span<const double> raw) noexcept {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    Source& source = sources_[i];
    Estimate estimate = source.torque.step(raw);
    estimate.std_dev *= source.error_bar_factor;
    if (source.friction) {
      const Estimate friction = source.friction->step(raw);
      estimate.std_dev = std::hypot(estimate.std_dev, source.friction->estimator.start_std_dev());
      source.without_friction = estimate;
      source.friction_Nm = friction.value;
      const double spread_Nm = source.filter->std_dev() * friction.value;
      estimate.value += source.filter->factor() * friction.value;
      estimate.std_dev = std::sqrt(estimate.std_dev * estimate.std_dev + spread_Nm * spread_Nm);
      if (estimate.fault == Fault::none) estimate.fault = friction.fault;
    }
    if (source.has_failed) estimate.fault = Fault::model_not_finite;
    estimates_[i] = estimate;
  }
  for (std::size_t i = 0; i < sources_.size(); ++i)
    if (sources_[i].filter) adapt(i);
  return estimates_;
}

void TorqueSources::adapt(std::size_t source) noexcept {
  double weights = 0.0;
  double sum_Nm = 0.0;
  for (std::size_t i = 0; i < estimates_.size(); ++i) {
    if (i == source || estimates_[i].fault != Fault::none || !(estimates_[i].std_dev > 0.0))
      continue;
    const double weight = 1.0 / (estimates_[i].std_dev * estimates_[i].std_dev);
    weights += weight;
    sum_Nm += weight * estimates_[i].value;
  }
  Source& self = sources_[source];
  const bool is_known = weights > 0.0 && estimates_[source].fault == Fault::none;
  const double own_Nm = self.without_friction.std_dev;
  self.filter->step(is_known ? self.friction_Nm : kNotMeasured,
                    sum_Nm / weights - self.without_friction.value,
                    std::sqrt(own_Nm * own_Nm + 1.0 / weights));
}

double TorqueSources::friction_factor(std::size_t source) const noexcept {
  return sources_[source].filter ? sources_[source].filter->factor() : 1.0;
}

void TorqueSources::set_friction_factor(std::size_t source, double factor,
                                        double std_dev) noexcept {
  if (sources_[source].filter) sources_[source].filter->set(factor, std_dev);
}

}  // namespace torsio
