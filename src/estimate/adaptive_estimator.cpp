#include "torsio/estimate/adaptive_estimator.hpp"

namespace torsio {
namespace {

/// A motion whose torque varies by a tenth of that of the training shows how the reference follows it.
constexpr double kLeastSpread = 0.1;

}  // namespace

AdaptiveEstimator::AdaptiveEstimator(const EstimatorSettings& settings,
                                     const AnyModel::Parameters& base,
                                     const AdaptationSettings& adaptation)
    : estimator_(settings, AdaptiveModel({.base = base,
                                          .adaptation = adaptation,
                                          .sample_period_s = 1.0 / settings.sample_rate_Hz})),
      check_(adapter().settings(), kLeastSpread * adapter().target_scale(),
             1.0 / settings.sample_rate_Hz) {}

void AdaptiveEstimator::reset() noexcept {
  estimator_.reset();
  check_.reset();
  last_fault_ = Fault::warming_up;
}

void AdaptiveEstimator::forget() noexcept {
  estimator_.model().adapter().reset();
  check_.reset();
}

Estimate AdaptiveEstimator::step(std::span<const double> raw) noexcept {
  Estimate estimate = estimator_.step(raw);
  last_fault_ = estimate.fault;
  if (estimate.fault != Fault::none) return estimate;  // the references were not for its value
  // Also an error bar that is not known, NaN, is at least that.
  if (const double rmse = adapter().recent_rmse(); rmse > 0.0 && !(estimate.std_dev >= rmse))
    estimate.std_dev = rmse;
  return estimate;
}

UpdateOutcome AdaptiveEstimator::learn(const ReferenceSample& reference) noexcept {
  ModelAdapter& adapter = estimator_.model().adapter();
  if (last_fault_ != Fault::none) {
    check_.pass();
    return adapter.pass_over(last_fault_ == Fault::warming_up ? UpdateOutcome::warming_up
                                                              : UpdateOutcome::no_estimate);
  }
  const double usable = adapter.accepts(reference) ? reference.value : kNotMeasured;
  return adapter.learn(
      reference, check_.step(adapter.frozen_value(), estimator_.model().first_feature(), usable));
}

}  // namespace torsio
