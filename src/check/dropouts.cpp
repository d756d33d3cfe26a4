#include "check/dropouts.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "check/signal_faults.hpp"
#include "numerics/quantile.hpp"

namespace torsio {
namespace {

constexpr std::size_t kShortestBurst = 4;
constexpr std::size_t kShortestHold = 10;  ///< so many equal ones by chance do not occur
constexpr std::size_t kFewestBursts = 2;
constexpr double kUsualSteps = 0.99;
constexpr double kOverUsualSteps = 5.0;
constexpr double kMaxBurstShare = 0.5;
constexpr double kFewEqual = 0.2;     ///< share of equal neighbours outside of the bursts
constexpr double kLeastNoise = 1e-4;  ///< share of the range
constexpr double kAnyRate_Hz = 100.0;
constexpr std::size_t kMaxJumps = 12;
constexpr std::size_t kNearJump = 3;
constexpr double kOtherSteps = 0.2;  ///< share of a jump

/// A run of equal new samples, by their numbers.
struct Run {
  std::size_t begin = 0;
  std::size_t end = 0;
  double jump_there = 0.0;
  double jump_back = 0.0;
};

std::vector<Run> runs_of(const std::vector<double>& values) {
  std::vector<Run> runs;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    end = begin + 1;
    while (end < values.size() && values[end] == values[begin]) ++end;
    if (end - begin < kShortestBurst || begin == 0 || end == values.size()) continue;
    runs.push_back({.begin = begin,
                    .end = end,
                    .jump_there = std::abs(values[begin] - values[begin - 1]),
                    .jump_back = std::abs(values[end] - values[end - 1])});
  }
  return runs;
}

/// The runs of the value that most of them have that are entered or left with a jump, at least one of them with both.
std::vector<Run> runs_of_one_value(const std::vector<Run>& runs, const std::vector<double>& values,
                                   double jump) {
  std::map<double, std::vector<Run>> by_value;
  std::set<double> with_both;  // where the signal passes the value just then, one jump is small
  for (const Run& run : runs) {
    if (std::max(run.jump_there, run.jump_back) < jump) continue;
    by_value[values[run.begin]].push_back(run);
    if (std::min(run.jump_there, run.jump_back) >= jump) with_both.insert(values[run.begin]);
  }
  std::vector<Run> found;
  for (const double value : with_both)
    if (by_value[value].size() >= kFewestBursts && by_value[value].size() > found.size())
      found = by_value[value];
  return found;
}

std::vector<Run> held_runs(const std::vector<Run>& runs, const std::vector<double>& values,
                           double jump) {
  std::size_t equal = 0;
  for (std::size_t k = 1; k < values.size(); ++k)
    if (values[k] == values[k - 1]) ++equal;
  std::vector<Run> found;
  for (const Run& run : runs) {
    if (run.end - run.begin < kShortestHold) continue;
    equal -= run.end - run.begin - 1;
    if (run.jump_back >= jump && run.jump_there < jump) found.push_back(run);
  }
  const bool is_measured_anew =
      static_cast<double>(equal) < kFewEqual * static_cast<double>(values.size());
  return found.size() >= kFewestBursts && is_measured_anew ? found : std::vector<Run>{};
}

/// Whether the channel comes to such a run from another rest, and leaves it to one, as a command does that steps.
bool is_between_rests(const std::vector<Run>& found, const std::vector<double>& values) {
  const auto beside_rest = std::ranges::count_if(found, [&](const Run& run) {
    const bool before = run.begin >= 2 && values[run.begin - 1] == values[run.begin - 2];
    const bool after = run.end + 1 < values.size() && values[run.end] == values[run.end + 1];
    return before || after;
  });
  return 2 * static_cast<std::size_t>(beside_rest) > found.size();
}

}  // namespace

std::optional<Dropouts> find_dropouts(const Channel& channel, double least) {
  const std::vector<std::size_t> samples = new_samples(channel);
  if (samples.size() < kFewestSamples) return {};
  std::vector<double> values;
  values.reserve(samples.size());
  for (const std::size_t i : samples) values.push_back(channel.values[i]);
  const std::vector<Run> runs = runs_of(values);
  if (runs.size() < kFewestBursts) return {};
  std::vector<double> steps;
  for (std::size_t k = 1; k < values.size(); ++k)
    steps.push_back(std::abs(values[k] - values[k - 1]));
  const double jump = std::max(least, kOverUsualSteps * quantile(std::move(steps), kUsualSteps));
  std::vector<Run> found = runs_of_one_value(runs, values, jump);
  const bool is_one_value = !found.empty() && !is_between_rests(found, values);
  if (!is_one_value) {
    // A joint that sticks rests as well, and leaves with a jump; its sensor keeps its noise.
    const Channel plain{.name = channel.name, .values = values};
    const double noise = usual_noise(noise_course(plain, kAnyRate_Hz));
    if (noise < kLeastNoise * extent_of(values).width()) return {};
    found = held_runs(runs, values, jump);
  }
  if (found.empty()) return {};
  Dropouts dropouts{.is_one_value = is_one_value,
                    .value = values[found.front().begin],
                    .shortest = channel.values.size(),
                    .bursts = {}};
  std::size_t all = 0;
  for (const Run& run : found) {
    const Rest burst{samples[run.begin], samples[run.end]};
    all += burst.length();
    dropouts.shortest = std::min(dropouts.shortest, burst.length());
    dropouts.longest = std::max(dropouts.longest, burst.length());
    dropouts.highest_jump = std::max({dropouts.highest_jump, run.jump_there, run.jump_back});
    dropouts.bursts.push_back(burst);
  }
  if (static_cast<double>(all) > kMaxBurstShare * static_cast<double>(channel.values.size()))
    return {};
  return dropouts;
}

std::optional<Jumps> find_jumps(const std::vector<double>& values, double code, double times) {
  if (values.size() < kFewestSamples) return {};
  const auto height = [&](std::size_t i) { return std::abs(values[i] - values[i - 1]); };
  std::vector<std::size_t> order;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (is_finite(height(i))) order.push_back(i);
  constexpr std::size_t kEnough = (2 * kNearJump + 1) * (kMaxJumps + 1);
  const std::size_t enough = std::min(kEnough, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(enough),
                            [&](std::size_t a, std::size_t b) {
                              return std::pair(-height(a), a) < std::pair(-height(b), b);
                            });
  order.resize(enough);
  std::vector<std::size_t> places;  // the highest ones, each but once
  for (const std::size_t i : order) {
    const auto is_near = [&](std::size_t place) {
      return i + kNearJump >= place && i <= place + kNearJump;
    };
    if (places.size() <= kMaxJumps && std::ranges::none_of(places, is_near)) places.push_back(i);
  }
  if (places.empty()) return {};
  // A friction that reverses takes several samples; a jump is one step, or two where it was interpolated.
  const auto is_abrupt = [&](std::size_t place) {
    std::vector<double> near;
    for (std::size_t i = place > kNearJump ? place - kNearJump : 1;
         i < std::min(values.size(), place + kNearJump + 1); ++i)
      if (is_finite(height(i))) near.push_back(height(i));
    std::ranges::sort(near, std::greater<>());
    return near.size() < 3 || near[2] <= kOtherSteps * near[0];
  };
  for (std::size_t count = std::min(places.size() - 1, kMaxJumps); count >= 2; --count) {
    const double next = height(places[count]);
    const double lowest = height(places[count - 1]);
    if (!(lowest > 0.0 && lowest >= times * std::max(next, code))) continue;
    if (!std::all_of(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(count),
                     is_abrupt))
      continue;
    Jumps jumps{.samples = {places.begin(), places.begin() + static_cast<std::ptrdiff_t>(count)},
                .lowest = lowest,
                .highest = height(places.front()),
                .next_height = next};
    std::ranges::sort(jumps.samples);
    return jumps;
  }
  return {};
}

}  // namespace torsio
