#include "fit/common/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "fit/common/guards.hpp"
#include "fit/common/model_run.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kLeastSamples = 50.0;

/// By sequence and sample: whether it was taken out.
using Masks = std::vector<std::vector<std::uint8_t>>;

/// Takes the last third of the usable samples of each sequence out.
Masks take_last_third(TrainingData& data) {
  Masks taken;
  for (Sequence& sequence : data.sequences) {
    std::vector<std::uint8_t>& use = sequence.use;
    std::vector<std::uint8_t>& out = taken.emplace_back(use.size(), std::uint8_t{0});
    const auto usable = static_cast<std::size_t>(std::ranges::count(use, std::uint8_t{1}));
    std::size_t kept = usable - usable / 3;
    for (std::size_t n = 0; n < use.size(); ++n) {
      if (use[n] == 0) continue;
      if (kept > 0) {
        --kept;
      } else {
        std::swap(use[n], out[n]);
      }
    }
  }
  return taken;
}

/// Standard deviation of the target in all usable samples.
double spread_of(const TrainingData& data, const Masks& taken) {
  double sum = 0.0;
  double square_sum = 0.0;
  double count = 0.0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s)
    for (std::size_t n = 0; n < taken[s].size(); ++n) {
      if (taken[s][n] == 0 && data.sequences[s].use[n] == 0) continue;
      const double target = data.sequences[s].target[n];
      sum += target;
      square_sum += target * target;
      count += 1.0;
    }
  const double mean = sum / count;
  return std::sqrt(std::max(0.0, square_sum / count - mean * mean));
}

/// Samples outside the range of the rest are not counted: an estimator does not use the model there.
HeldOutErrors errors_of(const AnyModel& model, const TrainingData& data, const Masks& taken,
                        const FeatureRanges& ranges) {
  const auto is_inside = [&](std::span<const double> features) {
    for (std::size_t j = 0; j < features.size(); ++j)
      if (!(features[j] >= ranges.lowest[j] && features[j] <= ranges.highest[j])) return false;
    return true;
  };
  double square_sum = 0.0;
  double ratio_sum = 0.0;
  double count = 0.0;
  double rated = 0.0;
  double returned = 0.0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    AnyModel own = model;
    const std::vector<Estimate> estimates = run(own, sequence);
    for (std::size_t n = 0; n < estimates.size(); ++n) {
      const Estimate& estimate = estimates[n];
      const double first = sequence.features(n, 0);
      if (taken[s][n] != 0 && first >= ranges.lowest.front() && first <= ranges.highest.front())
        returned += 1.0;
      if (taken[s][n] == 0 || !is_inside(sequence.features.row(n)) ||
          estimate.fault != Fault::none || !std::isfinite(estimate.value))
        continue;
      const double error = estimate.value - sequence.target[n];
      square_sum += error * error;
      count += 1.0;
      if (!(estimate.std_dev > 0.0)) continue;
      ratio_sum += (error / estimate.std_dev) * (error / estimate.std_dev);
      rated += 1.0;
    }
  }
  HeldOutErrors errors{.has_return = returned >= kLeastSamples};
  if (count < kLeastSamples) return errors;
  errors.rmse = std::sqrt(square_sum / count);
  errors.constant_rmse = spread_of(data, taken);
  if (const double ratio = std::sqrt(ratio_sum / rated); ratio > 1.0 && std::isfinite(ratio))
    errors.error_bar_factor = ratio;
  return errors;
}

}  // namespace

HeldOutErrors held_out_errors(const TrainingData& data,
                              const std::function<FittedModel(const TrainingData&)>& fit) {
  TrainingData rest = data;
  const Masks taken = take_last_third(rest);
  try {
    return errors_of(fit(rest).model, rest, taken, feature_ranges(rest));
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return {};
  }
}

}  // namespace torsio
