#include "check/advise/strokes.hpp"

#include <algorithm>
#include <cmath>

namespace torsio {
namespace {

constexpr double kEnd = 0.05;  // share of the travel at either end
// Time of a sine in the outer 5 % at both ends over its time between them: a rest is longer.
constexpr double kEndsOfASine = 0.41;

/// Samples at which the signal reverses by more than `dead_band`.
std::vector<std::size_t> reversals(const std::vector<double>& values, double dead_band) {
  std::vector<std::size_t> found;
  std::size_t lowest = values.size();
  std::size_t highest = values.size();
  int direction = 0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!std::isfinite(values[n])) continue;
    if (lowest == values.size() || values[n] < values[lowest]) lowest = n;
    if (highest == values.size() || values[n] > values[highest]) highest = n;
    if (direction >= 0 && values[n] < values[highest] - dead_band) {
      if (direction > 0) found.push_back(highest);
      direction = -1;
      lowest = n;
    } else if (direction <= 0 && values[n] > values[lowest] + dead_band) {
      if (direction < 0) found.push_back(lowest);
      direction = 1;
      highest = n;
    } else {
      continue;
    }
    // From here on only the excursion in the new direction counts.
    (direction > 0 ? lowest : highest) = n;
  }
  return found;
}

Stroke stroke(const std::vector<double>& values, std::size_t begin, std::size_t end,
              double sample_rate_Hz) {
  Stroke result{.begin = begin, .end = end, .lowest = HUGE_VAL, .highest = -HUGE_VAL};
  for (std::size_t n = begin; n < end; ++n) {
    if (!std::isfinite(values[n])) continue;
    result.lowest = std::min(result.lowest, values[n]);
    result.highest = std::max(result.highest, values[n]);
  }
  const double travel = result.highest - result.lowest;
  if (!(travel > 0.0)) {
    result.hold_s = static_cast<double>(end - begin) / sample_rate_Hz;
    return result;
  }
  std::size_t moving = 0;
  for (std::size_t n = begin; n < end; ++n)
    if (values[n] > result.lowest + kEnd * travel && values[n] < result.highest - kEnd * travel)
      ++moving;
  const double moving_s = static_cast<double>(std::max<std::size_t>(moving, 1)) / sample_rate_Hz;
  const double duration_s = static_cast<double>(end - begin) / sample_rate_Hz;
  result.frequency_Hz = 0.5 * (1.0 - 2.0 * kEnd) / moving_s;
  result.hold_s = std::max(0.0, duration_s - (1.0 + kEndsOfASine) * moving_s);
  return result;
}

}  // namespace

std::vector<Stroke> strokes_of(const std::vector<double>& values, double dead_band,
                               double sample_rate_Hz) {
  if (std::ranges::none_of(values, [](double value) { return std::isfinite(value); })) return {};
  std::vector<Stroke> strokes;
  std::size_t begin = 0;
  for (const std::size_t end : reversals(values, dead_band)) {
    strokes.push_back(stroke(values, begin, end, sample_rate_Hz));
    begin = end;
  }
  strokes.push_back(stroke(values, begin, values.size(), sample_rate_Hz));
  std::erase_if(strokes, [](const Stroke& each) { return !(each.lowest <= each.highest); });
  return strokes;
}

}  // namespace torsio
