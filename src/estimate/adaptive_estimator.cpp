#include "torsio/estimate/adaptive_estimator.hpp"

namespace torsio {

AdaptiveEstimator::AdaptiveEstimator(const EstimatorSettings& settings,
                                     const AnyModel::Parameters& base,
                                     const AdaptationSettings& adaptation)
    : estimator_(settings, AdaptiveModel({.base = base,
                                          .adaptation = adaptation,
                                          .sample_period_s = 1.0 / settings.sample_rate_Hz})) {}

void AdaptiveEstimator::reset() noexcept {
  estimator_.reset();
  last_fault_ = Fault::warming_up;
}

Estimate AdaptiveEstimator::step(std::span<const double> raw) noexcept {
  const Estimate estimate = estimator_.step(raw);
  last_fault_ = estimate.fault;
  return estimate;
}

UpdateOutcome AdaptiveEstimator::learn(const ReferenceSample& reference) noexcept {
  ModelAdapter& adapter = estimator_.model().adapter();
  if (last_fault_ == Fault::none) return adapter.learn(reference);
  return adapter.pass_over(last_fault_ == Fault::warming_up ? UpdateOutcome::warming_up
                                                            : UpdateOutcome::no_estimate);
}

}  // namespace torsio
