#include "fit/common/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fit/common/guards.hpp"
#include "fit/common/model_run.hpp"
#include "fit/common/usable_table.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLeastSamples = 50;

/// Without the last third of the usable samples of each sequence.
TrainingData without_last_third(TrainingData data) {
  for (Sequence& sequence : data.sequences) {
    const auto usable = static_cast<std::size_t>(std::ranges::count(sequence.use, std::uint8_t{1}));
    std::size_t kept = usable - usable / 3;
    for (std::uint8_t& use : sequence.use) {
      if (use == 0) continue;
      if (kept > 0)
        --kept;
      else
        use = 0;
    }
  }
  return data;
}

/// The errors on what `rest` does not use. Samples outside its range are not counted: an estimator does not use
/// the model there.
HeldOutErrors errors_of(const AnyModel& model, const TrainingData& data, const TrainingData& rest) {
  const FeatureRanges ranges = feature_ranges(rest);
  const auto is_inside = [&](std::span<const double> features, std::size_t first_ones) {
    for (std::size_t j = 0; j < first_ones; ++j)
      if (!(features[j] >= ranges.lowest[j] && features[j] <= ranges.highest[j])) return false;
    return true;
  };
  MetricsAccumulator errors;
  MetricsAccumulator ratios;
  MetricsAccumulator own_bars;
  std::size_t returned = 0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    AnyModel own = model;
    const std::vector<Estimate> estimates = run(own, sequence);
    for (std::size_t n = 0; n < estimates.size(); ++n) {
      const Estimate& estimate = estimates[n];
      if (estimate.std_dev > 0.0) own_bars.add(estimate.std_dev, 0.0);
      if (sequence.use[n] == 0 || rest.sequences[s].use[n] != 0) continue;
      const std::span<const double> features = sequence.features.row(n);
      if (is_inside(features, 1)) ++returned;
      if (estimate.fault != Fault::none || !std::isfinite(estimate.value) ||
          !is_inside(features, features.size()))
        continue;
      errors.add(estimate.value, sequence.target[n]);
      if (estimate.std_dev > 0.0)
        ratios.add((estimate.value - sequence.target[n]) / estimate.std_dev, 0.0);
    }
  }
  HeldOutErrors found{.has_return = returned >= kLeastSamples};
  if (own_bars.metrics().samples > 0) found.own_std_dev = own_bars.metrics().rmse;
  const Metrics metrics = errors.metrics();
  if (metrics.samples < kLeastSamples) return found;
  found.rmse = metrics.rmse;
  found.constant_rmse = target_std_dev(data);
  if (const double ratio = ratios.metrics().rmse; ratio > 1.0 && std::isfinite(ratio))
    found.error_bar_factor = ratio;
  return found;
}

}  // namespace

double target_std_dev(const TrainingData& data) {
  double sum = 0.0;
  double square_sum = 0.0;
  double count = 0.0;
  for_each_usable(data, [&](std::span<const double>, double target) {
    sum += target;
    square_sum += target * target;
    count += 1.0;
  });
  const double mean = sum / count;
  return std::sqrt(std::max(0.0, square_sum / count - mean * mean));
}

std::size_t reversals_of(const TrainingData& data) {
  std::size_t reversals = 0;
  for (const Sequence& sequence : data.sequences) {
    std::vector<double> motion;
    for (std::size_t n = 0; n < sequence.target.size(); ++n)
      if (sequence.use[n] != 0) motion.push_back(sequence.features(n, 0));
    reversals += count_reversals(motion, kFewReversals);
    if (reversals >= kFewReversals) break;
  }
  return reversals;
}

double other_recordings_factor(std::size_t recordings, std::size_t reversals) {
  if (recordings == 1 || reversals < kFewReversals) return 1.4;
  return recordings == 2 ? 1.3 : 1.0;
}

double error_share_with_all(std::size_t records, std::size_t folds) {
  const auto n = static_cast<double>(records);
  const double fitted_to = n * (1.0 - 1.0 / static_cast<double>(folds));
  return std::sqrt((1.0 + 1.0 / n) / (1.0 + 1.0 / fitted_to));
}

HeldOutErrors held_out_errors(const TrainingData& data,
                              const std::function<FittedModel(const TrainingData&)>& fit) {
  const TrainingData rest = without_last_third(data);
  try {
    return errors_of(fit(rest).model, data, rest);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return {};
  }
}

}  // namespace torsio
