#include "report/document/decimation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace torsio {
namespace {

constexpr float kGap = std::numeric_limits<float>::quiet_NaN();

float shown(double value) { return std::isfinite(value) ? static_cast<float>(value) : kGap; }

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  /// At least the smallest number that can be divided by.
  [[nodiscard]] double width() const {
    return high > low ? high - low : std::numeric_limits<double>::min();
  }
};

Range range_of(std::span<const double> values) {
  Range range;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range;
}

}  // namespace

std::vector<float> overview_of(std::span<const double> values, std::size_t bucket) {
  std::vector<float> overview;
  overview.reserve(2 * (values.size() / bucket + 1));
  for (std::size_t begin = 0; begin < values.size(); begin += bucket) {
    const std::size_t end = std::min(begin + bucket, values.size());
    std::size_t lowest = end;
    std::size_t highest = end;
    for (std::size_t n = begin; n < end; ++n) {
      if (!std::isfinite(values[n])) continue;
      if (lowest == end || values[n] < values[lowest]) lowest = n;
      if (highest == end || values[n] > values[highest]) highest = n;
    }
    const bool is_gap = lowest == end;
    overview.push_back(is_gap ? kGap : shown(values[std::min(lowest, highest)]));
    overview.push_back(is_gap ? kGap : shown(values[std::max(lowest, highest)]));
  }
  return overview;
}

std::vector<float> detail_of(std::span<const double> values,
                             const std::vector<DetailWindow>& windows) {
  std::vector<float> detail;
  for (const DetailWindow& window : windows)
    for (const double value : values.subspan(window.begin, window.end - window.begin))
      detail.push_back(shown(value));
  return detail;
}

OverviewPlan plan_overview(std::size_t samples, std::size_t series,
                           const std::vector<PlaceOfInterest>& places, std::size_t max_values) {
  constexpr std::size_t kShortest = 200;
  constexpr std::size_t kLongest = 4000;
  OverviewPlan plan;
  const std::size_t each =
      std::max<std::size_t>(max_values / 2 / std::max<std::size_t>(series, 1), 1);
  // Each bucket has two values.
  plan.bucket = std::max<std::size_t>((2 * samples + each - 1) / each, 1);
  if (samples <= each) {
    plan.windows = {{0, samples, "the whole recording"}};
    return plan;
  }
  const std::size_t length = std::min(std::clamp(each / kMaxWindows, kShortest, kLongest), samples);
  for (const PlaceOfInterest& place : places) {
    if (plan.windows.size() == kMaxWindows) break;
    const bool is_shown = std::ranges::any_of(plan.windows, [&](const DetailWindow& window) {
      return place.sample >= window.begin && place.sample < window.end;
    });
    if (is_shown) continue;
    const std::size_t before = std::min(place.sample, length / 2);
    const std::size_t begin = std::min(place.sample - before, samples - length);
    plan.windows.push_back({begin, begin + length, place.label});
  }
  return plan;
}

ThinnedCurve thinned(std::span<const double> x, std::span<const double> y, std::size_t max_points) {
  const Range x_range = range_of(x);
  const Range y_range = range_of(y);
  ThinnedCurve curve;
  for (double step = 1.0 / 600.0;; step *= 1.5) {
    curve = {};
    bool has_last = false;
    double last_x = 0.0;
    double last_y = 0.0;
    for (std::size_t n = 0; n < x.size(); ++n) {
      const bool is_point = std::isfinite(x[n]) && std::isfinite(y[n]);
      if (!is_point && !has_last) continue;
      const double moved_x = std::abs(x[n] - last_x) / x_range.width();
      const double moved_y = std::abs(y[n] - last_y) / y_range.width();
      // Most points are so near that the distance need not be computed.
      const bool is_near =
          std::max(moved_x, moved_y) < 0.7 * step || std::hypot(moved_x, moved_y) < step;
      const bool is_last = n + 1 == x.size();
      if (is_point && has_last && is_near && !is_last) continue;
      curve.x.push_back(x[n]);
      curve.y.push_back(y[n]);
      curve.kept.push_back(n);
      has_last = is_point;
      last_x = x[n];
      last_y = y[n];
      if (curve.x.size() > max_points && step < 0.5) break;
    }
    if (curve.x.size() <= max_points || step >= 0.5) return curve;
  }
}

std::vector<PlaceOfInterest> reversals_of(std::span<const double> x) {
  const double least = 0.05 * range_of(x).width();
  std::vector<std::size_t> turns;
  std::size_t extreme = 0;
  int direction = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    if (!std::isfinite(x[n])) continue;
    if (!std::isfinite(x[extreme])) extreme = n;
    const double moved = x[n] - x[extreme];
    if (direction == 0 ? std::abs(moved) > least : moved * direction < -least) {
      if (direction != 0) turns.push_back(extreme);
      direction = moved > 0.0 ? 1 : -1;
      extreme = n;
    } else if (moved * direction > 0.0) {
      extreme = n;
    }
  }
  if (turns.empty()) return {};
  return {{turns.front(), "first reversal"}, {turns.back(), "last reversal"}};
}

}  // namespace torsio
