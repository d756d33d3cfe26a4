#include "fit/common/strokes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "fit/common/guards.hpp"
#include "numerics/quantile.hpp"
#include "numerics/reversals.hpp"
#include "torsio/estimate/estimator_core.hpp"

namespace torsio {
namespace {

/// The duration of the whole stroke that a sample is in, for each [samples].
std::vector<double> whole_strokes(const Sequence& sequence, double dead_band) {
  const std::size_t samples = sequence.target.size();
  std::vector<double> durations(samples, 0.0);
  detail::StrokeClock clock(dead_band);
  std::size_t begin = 0;
  double before = 0.0;
  const auto close = [&](std::size_t end) {
    std::fill(durations.begin() + static_cast<std::ptrdiff_t>(begin),
              durations.begin() + static_cast<std::ptrdiff_t>(end),
              static_cast<double>(end - begin));
    begin = end;
  };
  for (std::size_t n = 0; n < samples; ++n) {
    if (sequence.has_features(n)) clock.follow(sequence.features(n, 0));
    // At a turning point the clock starts again, some samples after it.
    if (clock.ticks() < before)
      close(std::max(begin, n + 1 - static_cast<std::size_t>(clock.ticks())));
    before = clock.ticks();
  }
  close(samples);
  return durations;
}

/// visit(sequence, sample) for those in use.
template <class Visit>
void for_each_place(const TrainingData& data, const Visit& visit) {
  for (std::size_t s = 0; s < data.sequences.size(); ++s)
    for (std::size_t n = 0; n < data.sequences[s].use.size(); ++n)
      if (data.sequences[s].use[n] != 0) visit(s, n);
}

}  // namespace

double stroke_dead_band(const TrainingData& data) {
  const FeatureRanges ranges = feature_ranges(data);
  return kReversalShare * std::max(ranges.highest[0] - ranges.lowest[0], 0.0);
}

double longest_stroke_s(const TrainingData& data) {
  const double dead_band = stroke_dead_band(data);
  std::vector<double> ticks;
  for (const Sequence& sequence : data.sequences) {
    detail::StrokeClock clock(dead_band);
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      clock.follow(sequence.features(n, 0));
      if (sequence.use[n] != 0) ticks.push_back(clock.longest());
    }
  }
  constexpr double kAlmostAll = 0.99;
  return ticks.empty() ? 0.0 : quantile(std::move(ticks), kAlmostAll) / data.sample_rate_Hz;
}

StrokeKinds stroke_kinds(const TrainingData& data) {
  const double dead_band = stroke_dead_band(data);
  StrokeKinds found;
  std::vector<std::vector<double>> durations;
  for (const Sequence& sequence : data.sequences) {
    durations.push_back(whole_strokes(sequence, dead_band));
    found.kinds.emplace_back(sequence.target.size(), std::uint8_t{0});
  }
  std::vector<double> used;
  for_each_place(data, [&](std::size_t s, std::size_t n) { used.push_back(durations[s][n]); });
  if (used.empty()) return found;
  constexpr double kFew = 0.05;  // share of the samples at either end that makes no group
  const double shortest = quantile(used, kFew);
  const double longest = quantile(used, 1.0 - kFew);
  constexpr double kTwoKinds = 2.5;
  constexpr double kThreeKinds = 6.0;
  if (!(longest >= kTwoKinds * shortest) || !(shortest > 0.0)) return found;
  const std::size_t count = longest >= kThreeKinds * shortest ? 3 : 2;
  const double width = std::log(longest / shortest) / static_cast<double>(count);
  std::array<std::size_t, 3> samples{};
  double longest_other = 0.0;
  for_each_place(data, [&](std::size_t s, std::size_t n) {
    const double place = std::log(durations[s][n] / shortest) / width;
    const auto kind = static_cast<std::uint8_t>(
        std::clamp(std::floor(place), 0.0, static_cast<double>(count - 1)));
    found.kinds[s][n] = kind;
    ++samples[kind];
    if (kind + 1U < count) longest_other = std::max(longest_other, durations[s][n]);
  });
  const std::size_t fewest = *std::ranges::min_element(std::span(samples).first(count));
  if (static_cast<double>(fewest) < kFew * static_cast<double>(used.size())) return found;
  found.count = count;
  double squares = 0.0;
  for_each_place(data, [&](std::size_t s, std::size_t n) {
    if (found.kinds[s][n] + 1U < count) return;
    const double r = durations[s][n] / longest_other;
    squares += std::pow((r - 1.0) * (r - 1.0) / r, 2);
  });
  found.novelty = std::sqrt(squares / static_cast<double>(samples[count - 1]));
  return found;
}

}  // namespace torsio
