#include "identify/drive/error_gain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "identify/drive/drive_findings.hpp"
#include "identify/drive/drive_logs.hpp"
#include "joint_load/load_fact.hpp"
#include "numerics/jackknife.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// What the law of one recording reads and commands.
struct LawSignals {
  std::string recording;
  double sample_period_s = 0.0;
  double gain = 0.0;
  std::vector<double> goal_rad;
  std::vector<double> angle_rad;
  std::vector<double> duty_1;
  std::vector<double> enabled_1;  ///< empty: always
};

std::vector<LawSignals> law_signals(const std::vector<Recording>& recordings,
                                    const DriveSheet& sheet) {
  std::vector<LawSignals> all;
  for (const Recording& recording : recordings) {
    if (!recording.has("duty_1")) continue;
    all.push_back({.recording = recording.name(),
                   .sample_period_s = 1.0 / recording.sample_rate_Hz(),
                   .gain = fact_in(sheet.gain, recording, sheet.file, "gain"),
                   .goal_rad = finite_channel(recording, command_channel(recording, sheet)),
                   .angle_rad = angle_after_gear(recording, sheet),
                   .duty_1 = finite_channel(recording, "duty_1"),
                   .enabled_1 = {}});
    if (recording.has("enabled_1")) all.back().enabled_1 = finite_channel(recording, "enabled_1");
  }
  return all;
}

/// The goal as it was `delay_s` ago, at least its first value.
std::vector<double> delayed_goal(const LawSignals& signals, double delay_s) {
  const double steps = delay_s / signals.sample_period_s;
  std::vector<double> goal(signals.goal_rad.size());
  for (std::size_t n = 0; n < goal.size(); ++n) {
    const double place = std::max(static_cast<double>(n) - steps, 0.0);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, goal.size() - 1);
    goal[n] = std::lerp(signals.goal_rad[below], signals.goal_rad[above],
                        place - static_cast<double>(below));
  }
  return goal;
}

/// The largest change of goal or angle next to each sample. Goal, angle and duty are read one after the other, so that
/// they do not belong together in a fast motion.
std::vector<double> changes(const std::vector<double>& goal, const std::vector<double>& angle) {
  std::vector<double> change(goal.size(), 0.0);
  for (std::size_t n = 1; n + 1 < goal.size(); ++n)
    change[n] =
        std::max(std::abs(goal[n + 1] - goal[n - 1]), std::abs(angle[n + 1] - angle[n - 1]));
  return change;
}

struct ErrorGainSums {
  double product = 0.0;
  double square = 0.0;
  double duty_square = 0.0;
  std::size_t samples = 0;
};

/// Over the slower half of the samples.
ErrorGainSums sums_at(const LawSignals& signals, double max_duty_1, double delay_s) {
  const std::vector<double> goal = delayed_goal(signals, delay_s);
  const std::vector<double> change = changes(goal, signals.angle_rad);
  const double fastest = quantile(change, 0.5);
  ErrorGainSums sums;
  for (std::size_t n = 0; n < goal.size(); ++n) {
    const bool is_on = signals.enabled_1.empty() || signals.enabled_1[n] != 0.0;
    const double duty = signals.duty_1[n];
    if (!is_on || std::abs(duty) > 0.95 * max_duty_1 || change[n] > fastest) continue;
    const double error = signals.gain * (goal[n] - signals.angle_rad[n]);
    sums.product += error * duty;
    sums.square += error * error;
    sums.duty_square += duty * duty;
    ++sums.samples;
  }
  return sums;
}

ErrorGainSums total(const std::vector<ErrorGainSums>& parts) {
  ErrorGainSums sum;
  for (const ErrorGainSums& part : parts) {
    sum.product += part.product;
    sum.square += part.square;
    sum.duty_square += part.duty_square;
    sum.samples += part.samples;
  }
  return sum;
}

double residual(const ErrorGainSums& sums) {
  if (sums.samples == 0 || sums.square <= 0.0) return HUGE_VAL;
  const double rest = sums.duty_square - sums.product * sums.product / sums.square;
  return std::sqrt(std::max(rest, 0.0) / static_cast<double>(sums.samples));
}

/// Delete-one-recording jackknife; NaN for one recording.
double standard_error(const std::vector<ErrorGainSums>& parts) {
  const ErrorGainSums all = total(parts);
  std::vector<double> gains;
  for (const ErrorGainSums& part : parts)
    if (all.square > part.square)
      gains.push_back((all.product - part.product) / (all.square - part.square));
  if (gains.size() < 2) return kNotMeasured;
  return std::sqrt(jackknife_variance(gains));
}

double gain_of(const ErrorGainSums& sums) {
  return sums.square > 0.0 ? sums.product / sums.square : kNotMeasured;
}

void check_residual(const ErrorGainSums& sums, DriveFindings& findings) {
  constexpr double kLargest = 0.05;
  if (residual(sums) <= kLargest) return;
  findings.warn(
      "error gain",
      fmt::format("The duty differs from gain error_gain (goal - angle) by {:.2g} (RMS): "
                  "the law is another one, or goal, angle and duty do not belong together. "
                  "Check the gain and the columns, or state another law.",
                  residual(sums)));
}

/// A recording whose gain is stated wrongly has another error gain than the rest.
void check_gains(const std::vector<LawSignals>& signals, const std::vector<ErrorGainSums>& parts,
                 DriveFindings& findings) {
  constexpr double kDiffers = 1.2;
  std::vector<double> gains;
  for (const ErrorGainSums& part : parts)
    if (part.samples >= kFewestDriveSamples && gain_of(part) > 0.0) gains.push_back(gain_of(part));
  if (gains.size() < 3) return;
  const double middle = quantile(gains, 0.5);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const double ratio = gain_of(parts[k]) / middle;
    if (parts[k].samples < kFewestDriveSamples || !(ratio > 0.0) ||
        (ratio < kDiffers && ratio > 1.0 / kDiffers))
      continue;
    findings.warn(
        "error gain",
        fmt::format("The duty of {} follows the error {:.2f} times as strongly as that of "
                    "the other recordings: its gain, {:.4g}, is not the one that it was "
                    "recorded with.",
                    signals[k].recording, ratio, signals[k].gain));
  }
}

/// A limit shows as a largest value that the duty has again and again.
void check_limit_of_duty(const std::vector<LawSignals>& signals, double max_duty_1,
                         DriveFindings& findings) {
  double largest = 0.0;
  for (const LawSignals& each : signals)
    for (const double duty : each.duty_1) largest = std::max(largest, std::abs(duty));
  constexpr double kNear = 0.999;
  constexpr std::size_t kRepeated = 20;
  std::size_t at_limit = 0;
  for (const LawSignals& each : signals)
    at_limit += static_cast<std::size_t>(std::ranges::count_if(
        each.duty_1, [&](double duty) { return std::abs(duty) >= kNear * largest; }));
  constexpr double kBelow = 0.98;
  if (largest <= 0.0 || largest >= kBelow * max_duty_1 || at_limit < kRepeated) return;
  findings.warn(
      "duty limit",
      fmt::format("The duty reaches {:.4g} in {} samples and never more, and the drive file "
                  "has the limit {:.4g}. If the drive limits it there, state 'max_duty: "
                  "{:.4g}'.",
                  largest, at_limit, max_duty_1, largest));
}

/// Why no gain can be measured, and what to do.
struct Unmeasurable {
  std::string found;
  std::string advice = "State 'error_gain' in the drive file (--drive).";
};

Unmeasurable why_not_measurable(const ErrorGainSums& sums, const std::vector<LawSignals>& signals) {
  const bool is_passive =
      !signals.empty() && std::ranges::all_of(signals, [](const LawSignals& each) {
        return std::ranges::all_of(each.duty_1, [](double duty) { return duty == 0.0; });
      });
  if (is_passive) return {"a duty of 0 in all recordings", "Give recordings with power as well."};
  if (sums.samples == 0) return {"no recording with duty_1 below its limit"};
  if (sums.product < 0.0)
    return {"a duty that pushes the angle away from the goal",
            "Goal, angle or duty has the other sign: 'sign: -1' of its channel in a mapping."};
  return {"a duty that does not follow the error"};
}

void require_measurable(const ErrorGainSums& sums, const std::vector<LawSignals>& signals,
                        const DriveSheet& sheet) {
  if (sums.samples >= kFewestDriveSamples && sums.square > 0.0 && sums.product > 0.0) return;
  const Unmeasurable why = why_not_measurable(sums, signals);
  throw Error({.place = sheet.file,
               .expected = "error_gain, the duty for an error of 1 rad at gain 1, or duty_1 in "
                           "the recordings to measure it from",
               .found = why.found,
               .advice = why.advice});
}

}  // namespace

MeasuredDrive measured_drive(const std::vector<Recording>& recordings, const DriveSheet& sheet) {
  MeasuredDrive measured{.sheet = sheet, .error_gain = {}};
  if (sheet.law != DriveLaw::position || sheet.error_gain_1_rad) return measured;
  const std::vector<LawSignals> signals = law_signals(recordings, sheet);
  constexpr int kDelays = 31;  // up to the longest delay of a fit
  constexpr double kDelayStep_s = 0.001;
  std::vector<ErrorGainSums> best(signals.size());
  double best_delay_s = 0.0;
  for (int k = 0; k < kDelays; ++k) {
    const double delay_s = kDelayStep_s * k;
    std::vector<ErrorGainSums> parts;
    parts.reserve(signals.size());
    for (const LawSignals& each : signals)
      parts.push_back(sums_at(each, sheet.max_duty_1, delay_s));
    if (k > 0 && !(residual(total(parts)) < residual(total(best)))) continue;
    best = std::move(parts);
    best_delay_s = delay_s;
  }
  const ErrorGainSums sums = total(best);
  require_measurable(sums, signals, sheet);
  const double gain = sums.product / sums.square;
  measured.sheet.error_gain_1_rad = gain;
  measured.error_gain = {.value_1_rad = gain,
                         .standard_error_1_rad = standard_error(best),
                         .delay_s = best_delay_s,
                         .residual_duty_1 = residual(sums),
                         .samples = sums.samples};
  DriveFindings findings;
  check_residual(sums, findings);
  check_gains(signals, best, findings);
  check_limit_of_duty(signals, sheet.max_duty_1, findings);
  measured.findings = findings.take();
  return measured;
}

}  // namespace torsio
