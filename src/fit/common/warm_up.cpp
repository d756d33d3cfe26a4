#include "fit/common/warm_up.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "fit/common/model_run.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

/// The smallest error bar; NaN without one.
double smallest_std_dev(const ResidualTable& residuals) {
  double smallest = kNotMeasured;
  for (const double each : residuals.std_dev)
    if (each > 0.0) smallest = std::fmin(smallest, each);
  return smallest;
}

/// Samples after a reset at `start` until the model agrees with `undisturbed`; none if it does not.
std::optional<std::size_t> samples_to_agree(AnyModel model, const Sequence& sequence,
                                            std::span<const Estimate> undisturbed,
                                            std::size_t start, std::size_t longest,
                                            double std_dev) {
  // Two runs of one model approach each other; once they have been this near for so long, the rest of
  // the sequence shows nothing new.
  constexpr double kNear = 0.05;
  constexpr std::size_t kNearSamples = 100;
  model.reset();
  std::size_t agreed_after = 0;
  std::size_t near = 0;
  const std::size_t end = std::min(undisturbed.size(), start + longest);
  for (std::size_t n = start; n < end; ++n) {
    if (!sequence.has_features(n)) continue;
    const Estimate estimate = model.step(sequence.features.row(n));
    const double distance = std::abs(estimate.value - undisturbed[n].value);
    const bool agrees = distance <= std_dev && estimate.fault == undisturbed[n].fault;
    if (!agrees) agreed_after = n + 1 - start;
    near = distance <= kNear * std_dev ? near + 1 : 0;
    if (near == kNearSamples) return agreed_after;
  }
  // It has to agree for as long as it took, or the sequence is too short to show it.
  if (start + 2 * agreed_after >= end) return std::nullopt;
  return agreed_after;
}

}  // namespace

double warm_up_s(const AnyModel& model, const TrainingData& data, const ResidualTable& residuals) {
  const double std_dev = smallest_std_dev(residuals);
  if (std::isnan(std_dev)) return kNotMeasured;
  std::size_t samples = 0;
  for (const Sequence& sequence : data.sequences) samples += sequence.features.rows;
  const std::size_t stride = std::max<std::size_t>(samples / kWarmUpStarts, 1);
  const auto longest = static_cast<std::size_t>(kLongestWarmUpSeconds * data.sample_rate_Hz);
  std::size_t slowest = 0;
  std::size_t passed = 0;
  bool has_compared = false;
  for (const Sequence& sequence : data.sequences) {
    AnyModel whole = model;
    const std::vector<Estimate> undisturbed = run(whole, sequence);
    // Not in the last quarter, where too little follows.
    const std::size_t last = 3 * (undisturbed.size() / 4);
    for (std::size_t n = (stride - passed % stride) % stride; n < last; n += stride) {
      const auto took = samples_to_agree(model, sequence, undisturbed, n, longest, std_dev);
      if (!took) return kNotMeasured;
      slowest = std::max(slowest, *took);
      has_compared = true;
    }
    passed += undisturbed.size();
  }
  if (!has_compared) return kNotMeasured;
  return kWarmUpSafety * static_cast<double>(slowest) / data.sample_rate_Hz;
}

}  // namespace torsio
