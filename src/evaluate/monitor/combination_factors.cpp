#include "evaluate/monitor/combination_factors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {
namespace {

constexpr std::array kFactors{1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0};
constexpr double kLargestRatio = 1.01;
constexpr std::size_t kFactorsEvery = 11;  // sums of squares over a minute need no more

/// Squared errors over a segment of a recording.
struct ErrorSums {
  std::vector<double> sources;
  double combined = 0.0;
};

struct RunSegment {
  const MeasuredRun* run;
  std::size_t begin;
  std::size_t end;
};

std::vector<RunSegment> segments_of(std::span<const MeasuredRun> runs, std::size_t length) {
  std::vector<RunSegment> segments;
  for (const MeasuredRun& run : runs)
    for (std::size_t begin = 0; begin < run.torque_Nm.size(); begin += length)
      segments.push_back({&run, begin, std::min(begin + length, run.torque_Nm.size())});
  return segments;
}

ErrorSums error_sums(const RedundancySettings& settings, const RunSegment& segment) {
  Redundancy redundancy(settings);
  const MeasuredRun& run = *segment.run;
  const std::vector<SourceRun>& sources = *run.sources;
  ErrorSums sums{.sources = std::vector<double>(sources.size(), 0.0)};
  std::vector<Estimate> estimates(sources.size());
  for (std::size_t n = segment.begin; n < segment.end; n += kFactorsEvery) {
    bool is_usable = std::isfinite(run.torque_Nm[n]);
    for (std::size_t i = 0; i < sources.size(); ++i) {
      estimates[i].value = sources[i].value_Nm[n];
      estimates[i].std_dev = sources[i].std_dev_Nm[n];
      is_usable = is_usable && sources[i].is_valid(n);
    }
    if (!is_usable) continue;
    for (std::size_t i = 0; i < sources.size(); ++i)
      sums.sources[i] += std::pow(estimates[i].value - run.torque_Nm[n], 2);
    sums.combined += std::pow(redundancy.step(estimates).value_Nm - run.torque_Nm[n], 2);
  }
  return sums;
}

}  // namespace

std::vector<double> combination_factors(const RedundancySettings& settings,
                                        std::span<const MeasuredRun> runs, std::size_t segment) {
  const DenormalsOff denormals_off;
  const std::size_t count = settings.sources.size();
  const std::vector<RunSegment> segments = segments_of(runs, segment);
  std::vector<double> totals(count, 0.0);
  for (const RunSegment& each : segments) {
    const ErrorSums sums = error_sums(settings, each);
    for (std::size_t i = 0; i < count; ++i) totals[i] += sums.sources[i];
  }
  if (*std::ranges::max_element(totals) == 0.0) return {};
  const auto best = static_cast<std::size_t>(std::ranges::min_element(totals) - totals.begin());
  RedundancySettings tried = settings;
  for (const double factor : kFactors) {
    tried.error_bar_factors.assign(count, factor);
    tried.error_bar_factors[best] = 1.0;
    const bool is_enough = std::ranges::all_of(segments, [&](const RunSegment& each) {
      const ErrorSums sums = error_sums(tried, each);
      return std::sqrt(sums.combined) <= kLargestRatio * std::sqrt(sums.sources[best]);
    });
    if (is_enough) break;
  }
  return tried.error_bar_factors;
}

}  // namespace torsio
