#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "data/inspect_clock.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

constexpr double kLargestStraySamples = 0.25;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

double rounded_to_digits(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  double rounded = value;
  std::from_chars(text.data(), text.data() + text.size(), rounded);
  return rounded;
}

}  // namespace

bool ClockReport::is_uniform() const noexcept {
  return sample_rate_Hz > 0.0 && first_not_increasing == 0 && not_finite == 0 &&
         largest_stray_s * sample_rate_Hz <= kLargestStraySamples;
}

ClockReport inspect_clock(std::span<const double> stamps) {
  ClockReport report;
  report.not_finite = static_cast<std::size_t>(
      std::ranges::count_if(stamps, [](double stamp) { return !std::isfinite(stamp); }));
  if (stamps.size() < 2 || report.not_finite > 0) return report;

  const double first = stamps.front();
  const double duration = stamps.back() - first;
  const auto intervals = static_cast<double>(stamps.size() - 1);
  std::vector<double> positive;
  positive.reserve(stamps.size());
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double interval = stamps[i] - stamps[i - 1];
    if (interval > 0.0) {
      positive.push_back(interval);
      continue;
    }
    ++(interval == 0.0 ? report.duplicated : report.backward);
    if (report.first_not_increasing == 0) report.first_not_increasing = i;
  }
  report.stamp_step_s = median(std::move(positive));
  if (!(duration > 0.0) || !std::isfinite(intervals / duration)) return report;

  report.sample_rate_Hz = intervals / duration;
  double oddest = -1.0;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double even = duration * (static_cast<double>(i) / intervals);
    const double stray = std::abs(stamps[i] - first - even);
    if (stray > report.largest_stray_s) {
      report.largest_stray_s = stray;
      report.max_stray = i;
    }
    const double oddness = std::abs(stamps[i] - stamps[i - 1] - report.stamp_step_s);
    if (oddness > oddest) {
      oddest = oddness;
      report.worst_interval = i;
    }
  }
  return report;
}

double simplest_rate(double rate, double relative_tolerance) {
  constexpr int kMaxDigits = 15;
  for (int digits = 1; digits <= kMaxDigits; ++digits) {
    const double frequency = rounded_to_digits(rate, digits);
    if (std::abs(frequency - rate) <= relative_tolerance * rate) return frequency;
    const double from_period = 1.0 / rounded_to_digits(1.0 / rate, digits);
    if (std::abs(from_period - rate) <= relative_tolerance * rate) return from_period;
  }
  return rate;
}

}  // namespace torsio
