#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "identify/drive/drive_checks.hpp"
#include "identify/drive/drive_course.hpp"
#include "identify/drive/drive_findings.hpp"
#include "identify/drive/drive_logs.hpp"
#include "identify/drive/free_run.hpp"

namespace torsio {
namespace {

/// Share of the supply that the back-EMF of the fitted motor takes.
void check_speeds(const std::vector<DriveLog>& logs, const DriveIdentification& identified,
                  DriveFindings& findings) {
  if (!has_winding(logs.front().kind)) return;
  double speed = 0.0;
  for (const DriveLog& log : logs) speed = std::max(speed, drive_course(log).largest_speed_rad_s);
  const double share =
      at(identified.values, DriveParameter::torque_constant) * speed / logs.front().supply_V;
  constexpr double kSlow = 0.1;
  if (share < kSlow)
    findings.warn(
        "speed",
        fmt::format(
            "All motions are slow: the back-EMF reaches {:.1f} % of the supply, so that torque "
            "constant and resistance are hardly separable. Record a fast motion.",
            100.0 * share));
}

/// One frequency of a signal, its mean and ends taken out by a Hann window.
double amplitude(std::span<const double> values, double phase_step) {
  const std::size_t count = values.size();
  double mean = 0.0;
  for (std::size_t n = 0; n < count; ++n) mean += values[n] / static_cast<double>(count);
  std::complex<double> sum;
  for (std::size_t n = 0; n < count; ++n) {
    const auto at = static_cast<double>(n);
    const double window =
        0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * at / static_cast<double>(count));
    sum += std::polar(window * (values[n] - mean), -phase_step * at);
  }
  return std::abs(sum);
}

/// Where the measured angle is larger than the command and the fitted model's is not.
struct MissedPeak {
  double frequency_Hz = 0.0;
  double measured = 0.0;  ///< angle over goal
  double modelled = 0.0;
};

void find_peak(const DriveLog& log, const DriveIdentification& identified, MissedPeak& worst) {
  const std::vector<double> angles = free_run(log, identified).angle_rad;
  constexpr std::size_t kFrequencies = 40;
  std::array<double, kFrequencies> command{};
  const auto phase = [&](std::size_t k) {
    const double frequency_Hz = 0.5 * std::pow(40.0, static_cast<double>(k) / (kFrequencies - 1));
    return 2.0 * std::numbers::pi * frequency_Hz * log.sample_period_s;
  };
  for (std::size_t k = 0; k < kFrequencies; ++k) command[k] = amplitude(log.command, phase(k));
  // A frequency that the command hardly has shows nothing.
  const double least = 0.3 * *std::ranges::max_element(command);
  for (std::size_t k = 0; k < kFrequencies && phase(k) < 1.0; ++k) {
    if (command[k] < least || least <= 0.0) continue;
    const double measured = amplitude(log.angle_rad, phase(k)) / command[k];
    const double modelled = amplitude(angles, phase(k)) / command[k];
    if (measured > 1.2 && measured - modelled > worst.measured - worst.modelled)
      worst = {phase(k) / (2.0 * std::numbers::pi * log.sample_period_s), measured, modelled};
  }
}

/// The angles on both sides of a spring, without their means; empty: a recording does not have both.
struct BothAngles {
  std::vector<double> motor_rad;  ///< after the gear
  std::vector<double> joint_rad;
};

std::vector<double> without_mean(std::vector<double> values) {
  double mean = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (double& value : values) value -= mean;
  return values;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

BothAngles both_angles(const Recording& recording, const DriveSheet& drive) {
  const auto is_measured = [&](const char* channel) {
    return recording.has(channel) &&
           std::ranges::all_of(recording.channel(channel).values,
                               [](double value) { return std::isfinite(value); });
  };
  DriveSheet motor = drive;
  motor.angle = is_measured("motor_angle_rad") ? "motor_angle_rad" : "gear_angle_rad";
  if (!is_measured("joint_angle_rad") || !is_measured(motor.angle.c_str())) return {};
  return {.motor_rad = without_mean(angle_after_gear(recording, motor)),
          .joint_rad = without_mean(recording.channel("joint_angle_rad").values)};
}

/// What the motor's and the joint's angle show of a spring between them.
std::string shown_by_both_angles(const std::vector<Recording>& recordings,
                                 const DriveSheet& drive) {
  constexpr double kShare = 0.01;       // share of the joint's motion
  constexpr double kSameRatio_1 = 0.2;  // Otherwise the gear ratio is not that of the angles.
  double square = 0.0;
  double joint = 0.0;
  double samples = 0.0;
  for (const Recording& recording : recordings) {
    const BothAngles angles = both_angles(recording, drive);
    const double own = product(angles.joint_rad, angles.joint_rad);
    const double slope = product(angles.motor_rad, angles.joint_rad) / own;
    if (!(own > 0.0) || !(std::abs(slope - 1.0) < kSameRatio_1)) continue;
    for (std::size_t n = 0; n < angles.joint_rad.size(); ++n)
      square += std::pow(angles.motor_rad[n] - angles.joint_rad[n], 2);
    joint += own;
    samples += static_cast<double>(angles.joint_rad.size());
  }
  if (!(square > kShare * kShare * joint)) return {};
  return fmt::format(
      "The angles of the motor after the gear and of the joint differ by {:.2g} rad (RMS), {:.2g} "
      "% of the joint's motion.",
      std::sqrt(square / samples), 100.0 * std::sqrt(square / joint));
}

/// What the gain of the law shows.
std::string shown_by_peak(const std::vector<DriveLog>& logs,
                          const DriveIdentification& identified) {
  if (!follows_goal(logs.front().kind)) return {};
  MissedPeak worst;
  for (const DriveLog& log : logs)
    if (is_always_powered(log)) find_peak(log, identified, worst);
  constexpr double kMissed = 0.25;
  if (worst.measured - worst.modelled <= kMissed * worst.measured || worst.measured == 0.0)
    return {};
  return fmt::format(
      "At {:.2g} Hz the angle is {:.2f} times the goal, in the model {:.2f} times: one mass cannot "
      "do that.",
      worst.frequency_Hz, worst.measured, worst.modelled);
}

/// Changes of the side of zero, of a signal without its mean, by more than half of its RMS.
std::size_t crossings(const std::vector<double>& values) {
  const double least =
      0.5 * std::sqrt(product(values, values) / static_cast<double>(values.size()));
  std::size_t count = 0;
  double side = 0.0;
  for (const double value : values) {
    if (std::abs(value) <= least) continue;
    const double now = value > 0.0 ? 1.0 : -1.0;
    if (side * now < 0.0) ++count;
    side = now;
  }
  return count;
}

/// Whether the error of the free runs swings faster than the motion.
bool is_error_oscillating(const std::vector<DriveLog>& logs,
                          const DriveIdentification& identified) {
  constexpr std::size_t kFewest = 10;
  constexpr double kFaster = 1.3;
  std::size_t of_errors = 0;
  std::size_t of_motions = 0;
  for (const DriveLog& log : logs) {
    std::vector<double> error = free_run(log, identified).angle_rad;
    for (std::size_t n = 0; n < error.size(); ++n) error[n] -= log.angle_rad[n];
    of_errors += crossings(without_mean(std::move(error)));
    of_motions += crossings(without_mean(log.angle_rad));
  }
  return of_errors >= kFewest &&
         static_cast<double>(of_errors) > kFaster * static_cast<double>(of_motions);
}

/// A delay or a direction at its bound may replace a spring that the model lacks.
std::string shown_by_bounds(const std::vector<DriveLog>& logs,
                            const DriveIdentification& identified) {
  const auto found =
      std::ranges::find_if(identified.parameters, [](const IdentifiedDriveParameter& parameter) {
        return parameter.is_at_bound && (parameter.parameter == DriveParameter::delay ||
                                         parameter.parameter == DriveParameter::direction);
      });
  if (found == identified.parameters.end() || !is_error_oscillating(logs, identified)) return {};
  return fmt::format(
      "{} is at the bound of its range, and the error of the free runs swings faster than the "
      "motion.",
      drive_parameter_info(found->parameter).name);
}

void check_spring(const std::vector<Recording>& recordings, const std::vector<DriveLog>& logs,
                  const DriveIdentification& identified, DriveFindings& findings) {
  if (has(identified.terms, DriveTerm::spring)) return;
  std::string shown = shown_by_both_angles(recordings, identified.drive);
  if (shown.empty()) shown = shown_by_peak(logs, identified);
  if (shown.empty()) shown = shown_by_bounds(logs, identified);
  if (!shown.empty())
    findings.warn("spring", shown +
                                " Try a spring between motor and load: --spring, in Python "
                                "spring=True.");
}

std::string text_of_bound(const IdentifiedDriveParameter& parameter) {
  const DriveParameterInfo& info = drive_parameter_info(parameter.parameter);
  if (parameter.parameter == DriveParameter::direction)
    return fmt::format(
        "{} is {:g}, the end of its range: only {} counts as load of the friction. That can be so, "
        "or the recordings do not determine it.",
        info.name, parameter.value,
        parameter.value < 0.0 ? "the torque of gravity" : "the torque of the motor");
  return fmt::format(
      "{} is at the bound of its range, {:.3g}: the recordings do not determine it, or the "
      "load or the drive file is wrong.",
      info.name, parameter.value);
}

}  // namespace

std::vector<DriveFinding> check_identified(const std::vector<Recording>& recordings,
                                           const std::vector<DriveLog>& logs,
                                           const DriveIdentification& identified) {
  DriveFindings findings;
  for (const IdentifiedDriveParameter& parameter : identified.parameters) {
    if (parameter.is_at_bound)
      findings.warn("bound", text_of_bound(parameter));
    else if (parameter.is_determined == false)
      findings.warn(
          "not determined",
          fmt::format("{} is not determined by these recordings: {:.3g} to {:.3g} with 95 %.",
                      drive_parameter_info(parameter.parameter).name, parameter.lowest,
                      parameter.highest));
  }
  check_speeds(logs, identified, findings);
  check_spring(recordings, logs, identified, findings);
  return findings.take();
}

}  // namespace torsio
