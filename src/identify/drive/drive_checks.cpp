#include "identify/drive/drive_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "identify/drive/drive_course.hpp"
#include "identify/drive/drive_findings.hpp"

namespace torsio {
namespace {

void check_load(const std::vector<DriveLog>& logs, const std::vector<DriveCourse>& courses,
                DriveFindings& findings) {
  double lowest = HUGE_VAL;
  double highest = -HUGE_VAL;
  double scale = 0.0;
  double angle_range = 0.0;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    lowest = std::min(lowest, courses[k].lowest_load_Nm);
    highest = std::max(highest, courses[k].highest_load_Nm);
    scale = std::max(scale, logs[k].load.load.gravity_Nm);
    angle_range = std::max(angle_range, courses[k].angle_range_rad);
  }
  constexpr double kStill_rad = 0.02;
  constexpr double kConstantShare = 0.02;
  if (angle_range < kStill_rad)
    return findings.fail(
        "motion",
        fmt::format("The joint turns by {:.2g} rad at most, so that nothing is determined. "
                    "Record a motion over at least 1 rad.",
                    angle_range));
  if (highest - lowest <= kConstantShare * scale || highest - lowest <= 0.0)
    return findings.fail(
        "load",
        fmt::format(
            "The load's torque stays within {:.3g} Nm, so that the scale of the torque is not "
            "determined. Lift the mass: a motion in which its torque changes.",
            std::max(highest - lowest, 0.0)));
  const double largest = std::max(std::abs(lowest), std::abs(highest));
  const double least = std::min(std::abs(lowest), std::abs(highest));
  if (lowest * highest > 0.0 && largest < 2.0 * least)
    findings.warn(
        "load range",
        fmt::format("The load's torque lies between {:.3g} and {:.3g} Nm, within a factor of 2: "
                    "friction that grows with the load is hardly separable from dry friction. "
                    "Record a second mass, or a motion through the hanging position.",
                    least, largest));
}

/// Angles of a load that hangs, whose numbers are rather degrees.
void check_turns(const std::vector<DriveLog>& logs, const std::vector<DriveCourse>& courses,
                 DriveFindings& findings) {
  constexpr double kManyTurns_rad = 8.0 * std::numbers::pi;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    if (courses[k].angle_range_rad < kManyTurns_rad || logs[k].load.load.gravity_Nm <= 0.0)
      continue;
    return findings.warn(
        "angle", fmt::format("The joint turns by {:.3g} rad, {:.0f} turns of a load that hangs. If "
                             "the log is in degrees, its column is joint_angle_deg, or "
                             "'unit: deg' in a mapping.",
                             courses[k].angle_range_rad,
                             courses[k].angle_range_rad / (2.0 * std::numbers::pi)));
  }
}

/// One drive is identified at a time; a log of BAM names its motor.
void check_motors(const std::vector<Recording>& recordings, DriveFindings& findings) {
  std::map<std::string, std::string> first_recording;  // by motor
  for (const Recording& recording : recordings)
    for (const auto& [label, text] : recording.labels)
      if (label == "motor") first_recording.try_emplace(text, recording.name());
  if (first_recording.size() < 2) return;
  std::string motors;
  for (const auto& [motor, recording] : first_recording)
    motors += fmt::format("{}{} in {}", motors.empty() ? "" : ", ", motor, recording);
  findings.fail("motor", "The recordings are of different motors: " + motors +
                             ". Identify each drive from its own recordings.");
}

/// A free run begins with the goal and the angle on the same side of the gear.
/// @returns whether they are not
bool check_gear(const std::vector<DriveLog>& logs, const std::vector<DriveCourse>& courses,
                DriveFindings& findings) {
  constexpr double kLeastRatio = 2.0;  // A swing at a resonance is not in phase with its goal.
  constexpr double kTogether = 0.9;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    const DriveCourse& course = courses[k];
    if (course.angle_per_goal < kLeastRatio || course.angle_with_goal < kTogether) continue;
    findings.fail(
        "gear ratio",
        fmt::format("In {} the angle turns {:.3g} times as far as its goal. If it is that of the "
                    "motor before the gear, state gear_ratio in the drive file, or the condition "
                    "gear_ratio_1 of the recordings, by which motor_angle_rad is divided.",
                    logs[k].name, course.angle_per_goal));
    return true;
  }
  return false;
}

/// The share is that of all moving samples with power, so that recordings without power do not count.
void check_saturation(const std::vector<DriveCourse>& courses, DriveFindings& findings) {
  std::size_t driven = 0;
  std::size_t saturated = 0;
  for (const DriveCourse& course : courses) {
    driven += course.driven;
    saturated += course.saturated;
  }
  constexpr double kMost = 0.9;
  const double share = static_cast<double>(saturated) / static_cast<double>(driven);
  if (driven > 0 && share > kMost)
    findings.fail(
        "saturation",
        fmt::format(
            "The drive's output is at its limit in {:.0f} % of the moving samples with power: the "
            "command does not determine the torque. Record smaller or slower motions.",
            100.0 * share));
}

void check_command(const std::vector<DriveLog>& logs, const std::vector<DriveCourse>& courses,
                   DriveFindings& findings) {
  for (std::size_t k = 0; k < logs.size(); ++k)
    if (courses[k].command_range > 0.0) return;
  findings.fail("command",
                "The command is constant in every recording: a free run has no input. Record a "
                "motion that is "
                "commanded, or name the command's channel in the drive file.");
}

void check_passive(const std::vector<DriveLog>& logs, const std::vector<DriveCourse>& courses,
                   DriveFindings& findings) {
  if (!has_winding(logs.front().kind)) return;
  if (std::ranges::none_of(courses,
                           [](const DriveCourse& course) { return course.has_passive_motion; }))
    findings.warn(
        "passive run",
        "No recording has a motion without power (enabled_1 = 0), so that the motor's back-EMF and "
        "viscous friction are hardly separable. Record the mass released with the power off.");
}

void check_number(const std::vector<DriveLog>& logs, DriveFindings& findings) {
  if (logs.size() >= 3) return;
  findings.warn(
      "recordings",
      fmt::format(
          "{} {}: standard errors follow from leaving out one recording at a time, and need "
          "at least three.",
          logs.size(), logs.size() == 1 ? "recording" : "recordings"));
}

bool are_near(double a, double b) {
  constexpr double kShare = 1e-3;
  return std::abs(a - b) <= kShare * std::max(std::abs(a), std::abs(b));
}

/// The same load on the same drive, with the same sampling.
bool is_same_setting(const DriveLog& a, const DriveLog& b) {
  const JointLoad& load_a = a.load.load;
  const JointLoad& load_b = b.load.load;
  constexpr double kSameZero_rad = 1e-3;
  return are_near(a.gain, b.gain) && are_near(a.speed_gain, b.speed_gain) &&
         are_near(a.limit, b.limit) && are_near(a.supply_V, b.supply_V) &&
         are_near(load_a.gravity_Nm, load_b.gravity_Nm) &&
         are_near(load_a.inertia_kg_m2, load_b.inertia_kg_m2) &&
         std::abs(load_a.zero_rad - load_b.zero_rad) <= kSameZero_rad &&
         are_near(a.sample_period_s, b.sample_period_s);
}

/// One motion twice: the same command and the same times without power, in the same setting.
bool is_repeat(const DriveLog& a, const DriveLog& b) {
  if (!is_same_setting(a, b)) return false;
  const std::size_t count = std::min(a.size(), b.size());
  if (static_cast<double>(count) < 0.9 * static_cast<double>(std::max(a.size(), b.size())))
    return false;
  double difference = 0.0;
  double size = 0.0;
  std::size_t switched = 0;
  for (std::size_t n = 0; n < count; ++n) {
    if (is_powered(a, n) != is_powered(b, n)) ++switched;
    difference += (a.command[n] - b.command[n]) * (a.command[n] - b.command[n]);
    size += a.command[n] * a.command[n];
  }
  constexpr double kSwitchedShare = 0.02;  // A switch by hand is not at the same sample twice.
  return difference <= 1e-4 * size &&
         static_cast<double>(switched) <= kSwitchedShare * static_cast<double>(count);
}

void check_repeats(const std::vector<DriveLog>& logs, DriveFindings& findings) {
  for (std::size_t i = 0; i < logs.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (is_repeat(logs[i], logs[j])) return;
  findings.warn(
      "repeat",
      "No command was recorded twice, so that it is not known how far two runs of one motion "
      "differ: "
      "no model can be better than that. Repeat one recording at the end of the session.");
}

void check_temperature(const std::vector<Recording>& recordings, const std::vector<DriveLog>& logs,
                       DriveFindings& findings) {
  std::map<double, std::pair<double, double>> range;  // by gain: lowest and highest mean
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    const auto channel = std::ranges::find_if(recordings[k].channels(), [](const Channel& c) {
      return c.name.starts_with("temperature") || c.name.ends_with("temperature_degC") ||
             c.name.ends_with("temperature_K");
    });
    if (channel == recordings[k].channels().end() || channel->values.empty()) return;
    double mean = 0.0;
    std::size_t finite = 0;
    for (const double value : channel->values) {
      if (!std::isfinite(value)) continue;
      mean += value;
      ++finite;
    }
    if (finite == 0) return;
    mean /= static_cast<double>(finite);
    const auto [at, is_new] = range.try_emplace(logs[k].gain, mean, mean);
    if (is_new) continue;
    at->second.first = std::min(at->second.first, mean);
    at->second.second = std::max(at->second.second, mean);
  }
  if (range.size() < 3) return;
  std::vector<double> middles;
  middles.reserve(range.size());
  for (const auto& [gain, ends] : range) middles.push_back(0.5 * (ends.first + ends.second));
  if (!std::ranges::is_sorted(middles) && !std::ranges::is_sorted(middles, std::greater<>()))
    return;
  constexpr double kLeast_K = 2.0;
  if (std::abs(middles.back() - middles.front()) < kLeast_K) return;
  findings.warn(
      "temperature",
      fmt::format(
          "The temperature changes in the order of the gains, by {:.0f} K: what the gain does "
          "and what the temperature does cannot be separated. Record the gains in another "
          "order.",
          std::abs(middles.back() - middles.front())));
}

}  // namespace

std::vector<DriveFinding> check_drive_logs(const std::vector<Recording>& recordings,
                                           const std::vector<DriveLog>& logs) {
  DriveFindings findings;
  std::vector<DriveCourse> courses;
  courses.reserve(logs.size());
  for (const DriveLog& log : logs) courses.push_back(drive_course(log));
  check_motors(recordings, findings);
  check_turns(logs, courses, findings);
  check_command(logs, courses, findings);
  check_load(logs, courses, findings);
  if (!check_gear(logs, courses, findings)) check_saturation(courses, findings);
  check_passive(logs, courses, findings);
  check_number(logs, findings);
  check_temperature(recordings, logs, findings);
  check_repeats(logs, findings);
  return findings.take();
}

}  // namespace torsio
