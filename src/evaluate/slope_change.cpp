#include "evaluate/slope_change.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace torsio {
namespace {

constexpr double kLeastChange = 0.05;
constexpr double kClearInversion = -0.7;  ///< correlation of target and estimate
constexpr std::size_t kFewestSamples = 100;

/// Sums over the samples without a fault.
struct EstimateAndTarget {
  std::size_t samples = 0;
  double mean_estimate = 0.0;
  double mean_target = 0.0;
  double estimate_2 = 0.0;  ///< sum of the squared distances from the mean
  double target_2 = 0.0;
  double both = 0.0;

  void add(double estimate, double target) {
    ++samples;
    const double from_mean = estimate - mean_estimate;
    const double target_from_mean = target - mean_target;
    const auto count = static_cast<double>(samples);
    mean_estimate += from_mean / count;
    mean_target += target_from_mean / count;
    estimate_2 += from_mean * (estimate - mean_estimate);
    target_2 += target_from_mean * (target - mean_target);
    both += from_mean * (target - mean_target);
  }
};

EstimateAndTarget compared(const ScoredRun& run) {
  EstimateAndTarget sums;
  for (std::size_t i = 0; i < run.prediction.estimates.size(); ++i) {
    const Estimate& estimate = run.prediction.estimates[i];
    const double target = run.target->values[i];
    if (estimate.fault == Fault::none && run.is_scored(i) && std::isfinite(target))
      sums.add(estimate.value, target);
  }
  return sums;
}

/// How many times as steeply the target rises; empty: no other slope is shown.
std::optional<double> other_slope(const EstimateAndTarget& sums) {
  if (sums.samples < kFewestSamples || !(sums.estimate_2 > 0.0) || !(sums.target_2 > 0.0))
    return {};
  const double correlation = sums.both / std::sqrt(sums.estimate_2 * sums.target_2);
  const double over_estimate = sums.both / sums.estimate_2;
  if (correlation < kClearInversion) return over_estimate;
  if (!(correlation > 0.0)) return {};
  const double over_target = sums.target_2 / sums.both;
  const bool is_less = std::max(over_estimate, over_target) <= 1.0 - kLeastChange;
  const bool is_more = std::min(over_estimate, over_target) >= 1.0 + kLeastChange;
  if (!is_less && !is_more) return {};
  return std::sqrt(sums.target_2 / sums.estimate_2);
}

}  // namespace

std::vector<std::string> slope_warnings(const ModelFile& file, const std::vector<ScoredRun>& runs) {
  std::vector<std::string> warnings;
  const std::string& target = file.settings.target;
  const std::string& input = file.settings.features.inputs.front();
  for (const ScoredRun& run : runs) {
    const std::optional<double> slope = other_slope(compared(run));
    if (!slope) continue;
    const std::string& recording = run.record->recording.name();
    warnings.push_back(
        *slope < 0.0
            ? fmt::format("{}: {} falls where it rose with {} in the training: the sign of one of "
                          "the two is inverted",
                          recording, target, input)
            : fmt::format(
                  "{}: {} rises {:.2f} times as steeply with {} as in the training: another "
                  "stiffness, or another scale of one of the two; run  torsio drift",
                  recording, target, *slope, input));
  }
  return warnings;
}

}  // namespace torsio
