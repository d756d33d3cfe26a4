#include "check/signal_pair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "data/finest_step.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::size_t kJumpNeighbourhood = 3;
constexpr double kRestShare = 0.05;

/// Standard deviation of white noise, from the median of third differences.
double white_noise(const std::vector<double>& values) {
  constexpr double kMedianOverSigma = 0.6745;
  std::vector<double> thirds;
  for (std::size_t i = 3; i < values.size(); ++i)
    if (const double third =
            std::abs(values[i] - 3.0 * values[i - 1] + 3.0 * values[i - 2] - values[i - 3]);
        is_finite(third))
      thirds.push_back(third);
  if (thirds.empty()) return 0.0;
  const auto middle = thirds.begin() + static_cast<std::ptrdiff_t>(thirds.size() / 2);
  std::ranges::nth_element(thirds, middle);
  return *middle / (kMedianOverSigma * std::sqrt(20.0));
}

}  // namespace

Extent extent_of(std::span<const double> values) {
  // The lanes do not wait for each other.
  std::array<Extent, 4> lanes;
  std::size_t i = 0;
  for (; i + lanes.size() <= values.size(); i += lanes.size())
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) lanes[lane].include(values[i + lane]);
  for (; i < values.size(); ++i) lanes[0].include(values[i]);
  Extent extent;
  for (const Extent& lane : lanes) {
    extent.lowest = std::min(extent.lowest, lane.lowest);
    extent.highest = std::max(extent.highest, lane.highest);
  }
  return extent;
}

std::pair<Extent, Extent> known_extents(const Pair& pair, std::size_t begin, std::size_t end) {
  std::pair<Extent, Extent> extents;
  for (std::size_t i = begin; i < end; ++i)
    if (is_known(pair, i))
      extents.first.include(pair.input[i]), extents.second.include(pair.target[i]);
  return extents;
}

std::vector<double> bridged(const Channel& channel) {
  std::vector<double> values(channel.values.size(), kNotMeasured);
  std::size_t last = values.size();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!channel.is_fresh(i) || !is_finite(channel.values[i])) continue;
    values[i] = channel.values[i];
    if (last < i) {
      const double slope = (values[i] - values[last]) / static_cast<double>(i - last);
      for (std::size_t j = last + 1; j < i; ++j)
        values[j] = values[last] + slope * static_cast<double>(j - last);
    }
    last = i;
  }
  return values;
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0.0;
  double sx = 0.0;
  double sy = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double a = x[i];
    const double b = y[i];
    if (!is_finite(a) || !is_finite(b)) continue;
    n += 1.0, sx += a, sy += b, xx += a * a, xy += a * b, yy += b * b;
  }
  const double spread = (n * xx - sx * sx) * (n * yy - sy * sy);
  return spread > 0.0 ? (n * xy - sx * sy) / std::sqrt(spread) : 0.0;
}

Variation variation_of(const std::vector<double>& values) {
  Variation variation;
  double mean = 0.0;
  for (const double value : values) {
    if (!is_finite(value)) continue;
    variation.count += 1.0;
    const double step = value - mean;
    mean += step / variation.count;
    variation.squares += step * (value - mean);
  }
  return variation;
}

std::vector<double> movement(const std::vector<double>& values, std::size_t half_window) {
  std::vector<double> differences(values.size(), kNotMeasured);
  for (std::size_t i = half_window; i + half_window < values.size(); ++i)
    differences[i] = values[i + half_window] - values[i - half_window];
  return differences;
}

Jump largest_jump(const std::vector<double>& values) {
  Jump jump;
  const auto height = [&](std::size_t i) { return std::abs(values[i] - values[i - 1]); };
  for (std::size_t i = 1; i < values.size(); ++i)
    if (height(i) > jump.height) jump = {.sample = i, .height = height(i)};  // false for NaN
  for (std::size_t i = 1; i < values.size(); ++i)
    if (i + kJumpNeighbourhood < jump.sample || i > jump.sample + kJumpNeighbourhood)
      if (height(i) > jump.next_height) jump.next_height = height(i);
  return jump;
}

std::vector<Rest> rests_of(const Channel& channel, std::size_t shortest) {
  std::vector<Rest> rests;
  Rest rest;
  const std::size_t size = channel.values.size();
  for (std::size_t i = 0; i < size; ++i) {
    rest.end = i + 1;
    if (rest.end < size && channel.values[rest.end] == channel.values[i]) continue;
    if (rest.length() >= shortest) rests.push_back(rest);
    rest.begin = rest.end;
  }
  std::ranges::stable_sort(rests, std::greater<>(), &Rest::length);
  return rests;
}

bool is_turning_point(const Rest& rest, const std::vector<double>& values, double step_at_most) {
  if (rest.begin == 0 || rest.end >= values.size()) return false;
  const double before = values[rest.begin] - values[rest.begin - 1];
  const double after = values[rest.end] - values[rest.end - 1];
  return before * after < 0.0 && std::abs(after) <= step_at_most;
}

double share_fresh(const Channel& channel) {
  if (channel.fresh.empty()) return 1.0;
  const auto fresh = std::ranges::count_if(channel.fresh, [](auto mark) { return mark != 0; });
  return static_cast<double>(fresh) / static_cast<double>(channel.fresh.size());
}

double share_moved(const Channel& channel, const Rest& meanwhile) {
  Extent passed;
  for (std::size_t i = meanwhile.begin; i < meanwhile.end; ++i) passed.include(channel.values[i]);
  const double whole = extent_of(channel.values).width();
  return whole > 0.0 ? passed.width() / whole : 0.0;
}

bool is_odd_one_out(const Rest& rest, const std::vector<Rest>& rests, const Channel& channel,
                    const Channel& other) {
  constexpr double kLittle = 0.02;  // share of the other's range
  constexpr double kTogether = 0.9;
  constexpr double kFewCodes = 5.0;
  constexpr double kNoiseRange = 6.0;  // over the standard deviation, in hundreds of samples
  const double whole = extent_of(other.values).width();
  const double moved = share_moved(other, rest) -
                       (whole > 0.0 ? kNoiseRange * white_noise(other.values) / whole : 0.0);
  return moved >= kLittle &&
         moved * extent_of(channel.values).width() >= kFewCodes * finest_step(channel) &&
         std::abs(correlation(channel.values, other.values)) >= kTogether &&
         std::ranges::none_of(rests, [&](const Rest& each) {
           return !(each == rest) && 2 * each.length() >= rest.length() &&
                  2.0 * share_moved(other, each) >= moved;
         });
}

Line line_through(const Pair& pair) {
  Line line;
  double count = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < pair.input.size(); ++i) {
    if (!is_finite(pair.input[i]) || !is_finite(pair.target[i])) continue;
    count += 1.0;
    const double dx = pair.input[i] - line.mean_input;
    line.mean_input += dx / count;
    line.mean_target += (pair.target[i] - line.mean_target) / count;
    xx += dx * (pair.input[i] - line.mean_input);
    xy += dx * (pair.target[i] - line.mean_target);
  }
  if (xx > 0.0) line.slope = xy / xx;
  return line;
}

std::vector<double> typical_speeds(const std::vector<double>& differences) {
  std::vector<double> speeds;
  speeds.reserve(differences.size());
  for (const double difference : differences)
    if (is_finite(difference)) speeds.push_back(std::abs(difference));
  if (speeds.empty()) return {};
  const double fastest = *std::ranges::max_element(speeds);
  std::erase_if(speeds, [&](double speed) { return speed <= kRestShare * fastest; });
  if (speeds.empty()) return {};
  const auto low = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() / 10);
  const auto high = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() * 9 / 10);
  std::ranges::nth_element(speeds, low);
  const double slow = *low;
  std::ranges::nth_element(low, high, speeds.end());
  return {slow, *high};
}

}  // namespace torsio
