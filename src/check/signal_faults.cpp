#include "check/signal_faults.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "check/signal_pair.hpp"
#include "data/finest_step.hpp"
#include "data/marks_of_changes.hpp"
#include "numerics/quantile.hpp"

namespace torsio {
namespace {

constexpr double kWindow_s = 0.1;
constexpr std::size_t kFewInAWindow = 8;
constexpr std::size_t kWindowsOfABurst = 3;
constexpr double kUsualQuantile = 0.9;
constexpr double kOverUsual = 8.0;
constexpr double kThirdDifference = 20.0;  ///< 1 + 9 + 9 + 1: variance of that of white noise
constexpr std::size_t kAround = 20;        ///< new samples before and after a spike
constexpr double kOverAround = 6.0;
constexpr double kNeighboursAgree = 0.3;  ///< share of the spike's height
constexpr std::size_t kHashedRows = 16;
constexpr std::size_t kFewDistinctRows = 20;
constexpr double kEqualShare = 1e-9;  ///< share of the range within which values are equal
constexpr double kCutQuantile = 0.999;
constexpr double kOverQuantile = 3.0;
constexpr std::size_t kCutNeighbourhood = 8;
constexpr std::size_t kFewSteps = 100;
constexpr double kFewRows = 8.0;
constexpr double kAgree = 1.5;
constexpr std::size_t kFewIntervals = 100;
constexpr std::size_t kMaxBroken = 3;
constexpr std::size_t kFewRuns = 20;
constexpr double kLongRun = 3.0;          ///< times the usual one: the joint is at rest
constexpr double kRunsOfOneLength = 0.9;  ///< share of the runs
constexpr double kCodesOfAHeldStep = 3.0;

/// x3 - 3 x2 + 3 x1 - x0 of four successive new samples.
double third_difference(const Channel& channel, const std::vector<std::size_t>& samples,
                        std::size_t k) {
  const auto at = [&](std::size_t ahead) { return channel.values[samples[k + ahead]]; };
  return at(3) - 3.0 * at(2) + 3.0 * at(1) - at(0);
}

/// Narrows [begin, end) to the samples whose third differences are large.
void narrow(Burst& burst, const Channel& channel, double large) {
  const std::vector<std::size_t> samples = new_samples(channel);
  std::optional<std::size_t> first;
  std::size_t last = 0;
  const auto from = std::ranges::lower_bound(samples, burst.begin) - samples.begin();
  for (auto k = static_cast<std::size_t>(from); k + 3 < samples.size() && samples[k] < burst.end;
       ++k)
    if (std::abs(third_difference(channel, samples, k)) > large) {
      if (!first) first = samples[k + 3];
      last = samples[k];
    }
  if (first && *first < last) burst.begin = *first, burst.end = last + 1;
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15ULL;
  return hash ^ (hash >> 29);
}

/// The steps of a channel, compared with its speeds before and after them.
struct Steps {
  std::vector<double> excess;  ///< step minus the mean of both speeds, over its usual size
  std::vector<double> rows;    ///< step over that mean: the time that it takes
};

std::optional<Steps> steps_of(const Channel& channel, double code) {
  const std::vector<std::size_t> samples = new_samples(channel);
  const std::size_t size = channel.values.size();
  Steps steps{std::vector<double>(size, 0.0), std::vector<double>(size, 0.0)};
  const auto value = [&](std::size_t k) { return channel.values[samples[k]]; };
  const double rows_of_a_step = static_cast<double>(size) / static_cast<double>(samples.size());
  constexpr std::size_t kSlope = 4;
  std::vector<double> moving;
  for (std::size_t k = kSlope + 1; k + kSlope < samples.size(); ++k) {
    const double before = (value(k - 1) - value(k - 1 - kSlope)) / kSlope;
    const double after = (value(k + kSlope) - value(k)) / kSlope;
    const double step = value(k) - value(k - 1);
    const double speed = 0.5 * (before + after);
    steps.excess[samples[k]] = std::abs(step - speed);
    steps.rows[samples[k]] = speed != 0.0 ? rows_of_a_step * step / speed : 0.0;
    if (step != speed) moving.push_back(std::abs(step - speed));
  }
  if (moving.size() < kFewSteps) return {};
  const double usual = quantile(std::move(moving), kCutQuantile) + code;
  for (double& each : steps.excess) each /= usual;
  return steps;
}

/// The number of rows on which two channels that jump near a sample agree; 0 if none do.
double missing_rows(const std::vector<Steps>& channels, std::size_t sample) {
  std::vector<double> rows;
  for (const Steps& steps : channels) {
    // A held channel shows the cut at its next new sample.
    const std::size_t end = std::min(steps.excess.size(), sample + kCutNeighbourhood + 1);
    std::size_t highest = sample;
    for (std::size_t i = sample; i < end; ++i)
      if (steps.excess[i] > steps.excess[highest]) highest = i;
    if (steps.excess[highest] > kOverQuantile) rows.push_back(steps.rows[highest]);
  }
  std::ranges::sort(rows);
  for (std::size_t k = 1; k < rows.size(); ++k)
    if (rows[k - 1] >= kFewRows && rows[k] <= kAgree * rows[k - 1])
      return std::sqrt(rows[k - 1] * rows[k]);
  return 0.0;
}

}  // namespace

std::vector<std::size_t> new_samples(const Channel& channel) {
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < channel.values.size(); ++i)
    if (channel.is_fresh(i) && is_finite(channel.values[i])) samples.push_back(i);
  return samples;
}

NoiseCourse noise_course(const Channel& channel, double sample_rate_Hz) {
  NoiseCourse course;
  const std::vector<std::size_t> samples = new_samples(channel);
  const double rate_Hz = channel.values.empty()
                             ? 0.0
                             : sample_rate_Hz * static_cast<double>(samples.size()) /
                                   static_cast<double>(channel.values.size());
  const std::size_t window =
      std::max(kFewInAWindow, static_cast<std::size_t>(std::round(kWindow_s * rate_Hz)));
  for (std::size_t begin = 0; begin + window + 3 <= samples.size(); begin += window) {
    double sum = 0.0;
    for (std::size_t k = begin; k < begin + window; ++k) {
      const double third = third_difference(channel, samples, k);
      sum += third * third;
    }
    course.samples.push_back(samples[begin]);
    course.sigma.push_back(std::sqrt(sum / (kThirdDifference * static_cast<double>(window))));
  }
  course.samples.push_back(channel.values.size());
  return course;
}

double usual_noise(const NoiseCourse& course) {
  return course.sigma.empty() ? 0.0 : quantile(course.sigma, 0.5);
}

std::optional<Burst> find_burst(const Channel& channel, const NoiseCourse& course,
                                double sample_rate_Hz, double least) {
  if (course.sigma.size() < 10 * kWindowsOfABurst) return {};
  Burst burst{.usual = quantile(course.sigma, kUsualQuantile)};
  const double high = std::max(least, kOverUsual * burst.usual);
  std::size_t run = 0;
  for (std::size_t k = 0; k <= course.sigma.size(); ++k) {
    if (k < course.sigma.size() && course.sigma[k] > high) {
      ++run;
      continue;
    }
    if (run >= kWindowsOfABurst) {
      burst.begin = course.samples[k - run];
      burst.end = course.samples[k];
      burst.sigma = *std::max_element(course.sigma.begin() + static_cast<std::ptrdiff_t>(k - run),
                                      course.sigma.begin() + static_cast<std::ptrdiff_t>(k));
      const double duration_s = static_cast<double>(burst.end - burst.begin) / sample_rate_Hz;
      if (duration_s >= 0.99 * kWindow_s * static_cast<double>(kWindowsOfABurst)) {
        narrow(burst, channel, 0.5 * std::sqrt(kThirdDifference) * high);
        return burst;
      }
    }
    run = 0;
  }
  return {};
}

std::vector<std::size_t> find_spikes(const Channel& channel, double least) {
  const std::vector<std::size_t> samples = new_samples(channel);
  std::vector<double> bend(samples.size(), 0.0);  // the sample minus the mean of its neighbours
  const auto value = [&](std::size_t k) { return channel.values[samples[k]]; };
  for (std::size_t k = 1; k + 1 < samples.size(); ++k)
    bend[k] = value(k) - 0.5 * (value(k - 1) + value(k + 1));
  std::vector<std::size_t> spikes;
  for (std::size_t k = 1; k + 1 < samples.size(); ++k) {
    const double height = std::abs(bend[k]);
    if (!(height > least) || std::abs(value(k + 1) - value(k - 1)) > kNeighboursAgree * height)
      continue;
    double around = 0.0;
    for (std::size_t j = k > kAround ? k - kAround : 0;
         j < std::min(samples.size(), k + kAround + 1); ++j)
      if (j + 1 < k || j > k + 1) around = std::max(around, std::abs(bend[j]));
    if (height > kOverAround * around) spikes.push_back(samples[k]);
  }
  return spikes;
}

std::optional<ReturningValue> find_returning_value(const Channel& channel, double least) {
  constexpr std::size_t kFewestReturns = 5;
  constexpr std::size_t kLongestReturn = 3;
  const std::vector<std::size_t> samples = new_samples(channel);
  const auto value = [&](std::size_t k) { return channel.values[samples[k]]; };
  Extent extent;
  for (std::size_t k = 0; k < samples.size(); ++k) extent.include(value(k));
  for (const double candidate : {0.0, extent.lowest, extent.highest}) {
    ReturningValue found{.value = candidate, .samples = {}};
    std::size_t returns = 0;
    for (std::size_t begin = 1, end = 1; begin + 1 < samples.size(); begin = end) {
      end = begin + 1;
      if (value(begin) != candidate) continue;
      while (end < samples.size() && value(end) == candidate) ++end;
      if (end == samples.size() || end - begin > kLongestReturn) continue;
      const double before = std::abs(value(begin - 1) - candidate);
      const double after = std::abs(value(end) - candidate);
      const double height = std::min(before, after);
      if (!(height > least) || std::abs(value(end) - value(begin - 1)) > kNeighboursAgree * height)
        continue;
      ++returns;
      for (std::size_t k = begin; k < end; ++k) found.samples.push_back(samples[k]);
    }
    if (returns >= kFewestReturns) return found;
  }
  return {};
}

std::vector<RepeatedBlock> find_repeats(const std::vector<const Channel*>& channels,
                                        std::size_t shortest) {
  if (channels.empty()) return {};
  const std::size_t rows = channels.front()->values.size();
  std::vector<std::uint64_t> row(rows, 0);
  for (const Channel* channel : channels) {
    // Rows that were resampled at their own stamps differ by their rounding.
    const double digit = kEqualShare * extent_of(channel->values).width();
    for (std::size_t i = 0; i < rows; ++i) {
      const double value = channel->values[i];
      const double rounded =
          digit > 0.0 && is_finite(value) ? std::round(value / digit) + 0.0 : value;
      row[i] = mixed(row[i], std::bit_cast<std::uint64_t>(rounded));
    }
  }
  std::unordered_map<std::uint64_t, std::size_t> first;  // rows where the blocks begin
  std::vector<RepeatedBlock> repeats;
  std::size_t next = 0;  // after the last repeat
  for (std::size_t i = 0; i + kHashedRows <= rows; ++i) {
    std::uint64_t block = 0;
    bool is_at_rest = true;
    for (std::size_t k = i; k < i + kHashedRows; ++k) {
      block = mixed(block, row[k]);
      is_at_rest = is_at_rest && row[k] == row[i];
    }
    if (is_at_rest) continue;
    const auto at = first.find(block);
    if (at == first.end()) {
      if (i % kHashedRows == 0) first.emplace(block, i);
      continue;
    }
    if (i < next) continue;
    RepeatedBlock found{.first = at->second, .again = i};
    // The blocks are hashed at every n-th row: the repeat may begin before.
    while (found.first > 0 && found.again > next && row[found.first - 1] == row[found.again - 1])
      --found.first, --found.again, ++found.length;
    std::size_t distinct = 0;
    while (found.again + found.length < rows && found.first + found.length < found.again &&
           row[found.first + found.length] == row[found.again + found.length])
      ++found.length;
    for (std::size_t k = found.again + 1; k < found.again + found.length; ++k)
      if (row[k] != row[k - 1]) ++distinct;
    if (distinct < kFewDistinctRows || found.length < shortest) continue;
    next = found.again + found.length;
    repeats.push_back(found);
  }
  return repeats;
}

std::optional<Cut> find_cut(const std::vector<const Channel*>& channels,
                            const std::vector<double>& codes) {
  std::vector<Steps> jumps;
  for (std::size_t c = 0; c < channels.size(); ++c)
    if (auto steps = steps_of(*channels[c], codes[c])) jumps.push_back(*std::move(steps));
  std::optional<Cut> cut;
  const std::size_t rows = jumps.size() < 2 ? 0 : channels.front()->values.size();
  for (std::size_t i = 0; i < rows; ++i) {
    if (std::ranges::none_of(jumps, [&](const Steps& s) { return s.excess[i] > kOverQuantile; }))
      continue;
    const double missing = missing_rows(jumps, i);
    if (missing == 0.0) continue;
    if (cut && i > cut->sample + 2 * kCutNeighbourhood) return {};  // the motion is like that
    if (cut) continue;
    // The speed after an earlier sample contains the jump, too.
    const auto height = [&](std::size_t k) {
      double highest = 0.0;
      for (const Steps& steps : jumps) highest = std::max(highest, steps.excess[k]);
      return highest;
    };
    cut = Cut{.sample = i, .rows = missing};
    for (std::size_t k = i; k < std::min(rows, i + kCutNeighbourhood); ++k)
      if (height(k) > height(cut->sample)) cut->sample = k;
  }
  return cut;
}

std::optional<BrokenCadence> find_broken_cadence(const Channel& channel) {
  const std::vector<std::size_t> samples = new_samples(channel);
  if (channel.fresh.empty() || samples.size() < kFewIntervals) return {};
  std::vector<std::size_t> intervals;
  for (std::size_t k = 1; k < samples.size(); ++k) intervals.push_back(samples[k] - samples[k - 1]);
  std::vector<std::size_t> sorted = intervals;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  BrokenCadence cadence{.usual = *middle};
  std::size_t broken = 0;
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    if (intervals[k] % cadence.usual == 0) continue;
    if (broken++ == 0) cadence.sample = samples[k + 1], cadence.found = intervals[k];
  }
  return broken > 0 && broken <= kMaxBroken ? std::optional(cadence) : std::nullopt;
}

std::size_t held_rows(const Channel& channel) {
  if (!channel.fresh.empty() || channel.step_before_resampling > 0.0) return 0;
  const std::vector<double>& values = channel.values;
  std::vector<double> lengths;
  std::vector<double> steps;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    while (end < values.size() && values[end] == values[begin]) ++end;
    if (end == begin) ++end;                           // not a number
    if (begin == 0 || end >= values.size()) continue;  // its length is not known
    lengths.push_back(static_cast<double>(end - begin));
    steps.push_back(std::abs(values[end] - values[begin]));
  }
  if (lengths.size() < kFewRuns) return 0;
  const double usual = quantile(lengths, 0.5);
  if (usual < 2.0) return 0;
  std::erase_if(lengths, [&](double length) { return length > kLongRun * usual; });
  const double slack = usual >= 3.0 ? 1.0 : 0.0;  // the clocks differ
  const auto of_one_length = std::ranges::count_if(lengths, [&](double length) {
    // Two equal measurements are one run.
    return length >= usual - slack && (length <= usual + 1.0 || length >= 2.0 * usual - slack);
  });
  if (static_cast<double>(of_one_length) < kRunsOfOneLength * static_cast<double>(lengths.size()))
    return 0;
  if (quantile(std::move(steps), 0.5) < kCodesOfAHeldStep * finest_step(values)) return 0;
  return static_cast<std::size_t>(usual);
}

std::vector<double> bridged_or_held(const Channel& channel) {
  if (held_rows(channel) == 0) return bridged(channel);
  Channel marked = channel;
  marked.fresh = marks_of_changes(channel.values);
  return bridged(marked);
}

double moved_within(const Channel& channel, std::size_t samples) {
  constexpr std::size_t kQuarters = 4;
  std::vector<double> values;
  for (const std::size_t i : new_samples(channel))
    if (i < samples) values.push_back(channel.values[i]);
  if (values.size() < 2 * kQuarters) return 0.0;
  double lowest = HUGE_VAL;
  double highest = -HUGE_VAL;
  double variance = 0.0;  // how much the mean of a quarter varies by noise
  for (std::size_t k = 0; k < kQuarters; ++k) {
    const std::span quarter = std::span(values).subspan(
        k * values.size() / kQuarters,
        (k + 1) * values.size() / kQuarters - k * values.size() / kQuarters);
    const auto count = static_cast<double>(quarter.size());
    const double mean = std::accumulate(quarter.begin(), quarter.end(), 0.0) / count;
    lowest = std::min(lowest, mean), highest = std::max(highest, mean);
    // From differences: the motion itself is not noise.
    for (std::size_t i = 1; i < quarter.size(); ++i)
      variance += 0.5 * (quarter[i] - quarter[i - 1]) * (quarter[i] - quarter[i - 1]) /
                  (count - 1.0) / count / kQuarters;
  }
  constexpr double kOverNoise = 4.0;
  return std::max(0.0, highest - lowest - kOverNoise * std::sqrt(variance));
}

}  // namespace torsio
