#include "check/motion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "check/signal_pair.hpp"
#include "numerics/quantile.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

constexpr double kHalfWindow_s = 0.05;
constexpr double kOutermost = 0.01;  // share of the samples on either side
constexpr double kAtRest = 0.05;     // share of the RMS speed

double rms(const std::vector<double>& values, double about = 0.0) {
  double sum = 0.0;
  for (const double value : values) sum += (value - about) * (value - about);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// How many times `allowed` two motions differ in the quantity in which they differ most: above 1
/// they are of different kinds.
double distance(const Motion& a, const Motion& b) {
  const auto factor = [](double of_a, double of_b) {
    return of_a == of_b ? 0.0 : std::abs(std::log(of_a / of_b)) / std::log(kMotionRatio);
  };
  return std::max({factor(a.amplitude, b.amplitude), factor(a.rms_speed, b.rms_speed),
                   factor(a.frequency_Hz, b.frequency_Hz),
                   std::abs(a.rest_share - b.rest_share) / kRestDifference});
}

}  // namespace

Motion motion_of(const DatasetRecord& record, Role role, const FeatureSpec& spec) {
  if (!record.has_role(role)) return {};
  const Recording& recording = record.recording;
  const std::vector<double> input = first_feature(recording, spec);
  const auto half_window = static_cast<std::size_t>(
      std::max(1.0, std::round(kHalfWindow_s * recording.sample_rate_Hz())));
  const std::vector<double> moved = movement(input, half_window);
  const double window_s = 2.0 * static_cast<double>(half_window) / recording.sample_rate_Hz();
  std::vector<double> values;
  std::vector<double> speeds;
  for (const Segment& segment : record.segments)
    for (std::size_t i = segment.begin; segment.role == role && i < segment.end; ++i)
      if (is_finite(moved[i])) {
        values.push_back(input[i]);
        speeds.push_back(std::abs(moved[i]) / window_s);
      }
  if (values.empty()) return {};
  Motion motion{.rms_speed = rms(speeds)};
  if (!(motion.rms_speed > 0.0)) return {};
  motion.frequency_Hz = motion.rms_speed / (2.0 * std::numbers::pi * rms(values, mean(values)));
  motion.rest_share = static_cast<double>(std::ranges::count_if(
                          speeds, [&](double v) { return v < kAtRest * motion.rms_speed; })) /
                      static_cast<double>(speeds.size());
  motion.amplitude = 0.5 * (quantile(values, 1.0 - kOutermost) - quantile(values, kOutermost));
  return motion;
}

std::string OtherMotion::text() const {
  std::vector<std::string> parts;
  const auto add = [&](double tested, double known, const char* what) {
    const double ratio = tested / known;
    if (ratio > kMotionRatio || ratio < 1.0 / kMotionRatio)
      parts.push_back(fmt::format("{:.2g} times the {}", ratio, what));
  };
  add(held_out.amplitude, trained.amplitude, "amplitude");
  add(held_out.rms_speed, trained.rms_speed, "speed");
  add(held_out.frequency_Hz, trained.frequency_Hz, "frequency");
  if (std::abs(held_out.rest_share - trained.rest_share) > kRestDifference)
    parts.push_back(fmt::format("{:.0f} instead of {:.0f} % of the time at rest",
                                100.0 * held_out.rest_share, 100.0 * trained.rest_share));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<OtherMotion> other_motions(const Dataset& dataset, const FeatureSpec& spec) {
  struct Trained {
    std::string recording;
    Motion motion;
  };
  std::vector<Trained> trained;
  for (const DatasetRecord& record : dataset.records)
    if (const Motion motion = motion_of(record, Role::train, spec); motion.rms_speed > 0.0)
      trained.push_back({record.recording.name(), motion});
  std::vector<OtherMotion> others;
  if (trained.empty()) return others;
  for (const DatasetRecord& record : dataset.records)
    for (const Role role : {Role::validation, Role::test}) {
      const Motion motion = motion_of(record, role, spec);
      if (!(motion.rms_speed > 0.0)) continue;
      const auto nearest = std::ranges::min_element(
          trained, {}, [&](const Trained& known) { return distance(motion, known.motion); });
      if (distance(motion, nearest->motion) > 1.0)
        others.push_back({record.recording.name(), nearest->recording, motion, nearest->motion});
    }
  return others;
}

}  // namespace torsio
