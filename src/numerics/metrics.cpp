#include "torsio/numerics/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Welford's update of a mean and of the squared deviations from it.
void update(double value, double count, double& mean, double& spread) noexcept {
  const double before = value - mean;
  mean += before / count;
  spread += before * (value - mean);
}

}  // namespace

void MetricsAccumulator::add(double value, double target) noexcept {
  if (std::isnan(target)) return;
  const double error = value - target;
  ++samples_;
  const auto count = static_cast<double>(samples_);
  square_sum_ += error * error;
  // A model whose output was NaN must have the metric NaN, which std::max would suppress.
  max_abs_ = std::isnan(error) ? error : std::max(max_abs_, std::abs(error));
  update(std::abs(error), count, mean_abs_, abs_spread_);
  update(target, count, mean_target_, target_spread_);
}

void MetricsAccumulator::add(std::span<const double> values, std::span<const double> targets,
                             std::span<const std::uint8_t> use) {
  if (values.size() != targets.size() || (!use.empty() && use.size() != targets.size()))
    throw Error({.problem = "metrics need equally many values, targets and marks",
                 .found = std::to_string(values.size()) + ", " + std::to_string(targets.size()) +
                          " and " + std::to_string(use.size())});
  for (std::size_t n = 0; n < values.size(); ++n)
    if (use.empty() || use[n] != 0) add(values[n], targets[n]);
}

Metrics MetricsAccumulator::metrics() const noexcept {
  if (samples_ == 0) return {};
  const auto count = static_cast<double>(samples_);
  Metrics result{.samples = samples_,
                 .rmse = std::sqrt(square_sum_ / count),
                 .mad = mean_abs_,
                 .std_abs = std::sqrt(abs_spread_ / count),
                 .max_abs = max_abs_};
  if (target_spread_ > 0.0)
    result.fit_percent = 100.0 * (1.0 - std::sqrt(square_sum_ / target_spread_));
  return result;
}

}  // namespace torsio
