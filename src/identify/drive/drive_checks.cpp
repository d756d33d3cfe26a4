#include "identify/drive/drive_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <span>

#include "core/aligned_vector.hpp"
#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_rollout.hpp"

namespace torsio {
namespace {

bool is_on(const DriveLog& log, std::size_t n) {
  return log.enabled.empty() || log.enabled[n] != 0.0;
}

/// Speed over 25 ms around a sample.
double speed_at(const DriveLog& log, std::size_t n) {
  const auto reach =
      std::max<std::size_t>(static_cast<std::size_t>(std::lround(0.0125 / log.sample_period_s)), 1);
  const std::size_t before = n > reach ? n - reach : 0;
  const std::size_t after = std::min(n + reach, log.size() - 1);
  return (log.angle_rad[after] - log.angle_rad[before]) /
         (static_cast<double>(after - before) * log.sample_period_s);
}

/// What of a log the checks look at.
struct Course {
  double largest_speed_rad_s = 0.0;
  double saturated_share = 0.0;  ///< share of the moving samples with power
  bool has_passive_motion = false;
  double lowest_load_Nm = HUGE_VAL;  ///< lowest torque of the load
  double highest_load_Nm = -HUGE_VAL;
  double command_range = 0.0;
  double angle_range_rad = 0.0;
};

Course course_of(const DriveLog& log) {
  Course course;
  constexpr double kMoving_rad_s = 0.02;
  std::size_t moving = 0;
  std::size_t saturated = 0;
  std::size_t passive = 0;
  for (std::size_t n = 0; n < log.size(); ++n) {
    const double speed = speed_at(log, n);
    course.largest_speed_rad_s = std::max(course.largest_speed_rad_s, std::abs(speed));
    const JointLoad& load = log.load.load;
    const std::size_t next = std::min(n + 1, log.size() - 1);
    const double acceleration = (speed_at(log, next) - speed) / log.sample_period_s;
    const double torque = load.gravity_Nm * std::sin(log.angle_rad[n] + load.zero_rad) +
                          (load.gravity_Nm > 0.0 ? 0.0 : load.inertia_kg_m2 * acceleration);
    course.lowest_load_Nm = std::min(course.lowest_load_Nm, torque);
    course.highest_load_Nm = std::max(course.highest_load_Nm, torque);
    if (std::abs(speed) < kMoving_rad_s) continue;
    if (!is_on(log, n)) {
      ++passive;
      continue;
    }
    ++moving;
    double output = log.command[n];
    if (log.kind == CommandKind::goal_to_duty || log.kind == CommandKind::goal_to_torque)
      output = log.gain * (log.command[n] - log.angle_rad[n]);
    if (log.limit > 0.0 && std::abs(output) >= log.limit) ++saturated;
  }
  course.saturated_share =
      moving > 0 ? static_cast<double>(saturated) / static_cast<double>(moving) : 0.0;
  course.has_passive_motion = static_cast<double>(passive) * log.sample_period_s > 0.1;
  const auto [low, high] = std::ranges::minmax(log.command);
  course.command_range = high - low;
  const auto [left, right] = std::ranges::minmax(log.angle_rad);
  course.angle_range_rad = right - left;
  return course;
}

class Findings {
 public:
  void fail(std::string subject, std::string text) {
    all_.push_back({true, std::move(subject), std::move(text)});
  }
  void warn(std::string subject, std::string text) {
    all_.push_back({false, std::move(subject), std::move(text)});
  }
  [[nodiscard]] std::vector<DriveFinding> take() { return std::move(all_); }

 private:
  std::vector<DriveFinding> all_;
};

void check_load(const std::vector<DriveLog>& logs, const std::vector<Course>& courses,
                Findings& findings) {
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
void check_turns(const std::vector<DriveLog>& logs, const std::vector<Course>& courses,
                 Findings& findings) {
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
void check_motors(const std::vector<Recording>& recordings, Findings& findings) {
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

void check_saturation(const std::vector<DriveLog>& logs, const std::vector<Course>& courses,
                      Findings& findings) {
  double sum = 0.0;
  for (std::size_t k = 0; k < logs.size(); ++k)
    sum += courses[k].saturated_share / static_cast<double>(logs.size());
  constexpr double kMost = 0.9;
  if (sum > kMost)
    findings.fail(
        "saturation",
        fmt::format("The drive's output is at its limit in {:.0f} % of the moving samples: the "
                    "command does not determine the torque. Record smaller or slower motions.",
                    100.0 * sum));
}

void check_command(const std::vector<DriveLog>& logs, const std::vector<Course>& courses,
                   Findings& findings) {
  for (std::size_t k = 0; k < logs.size(); ++k)
    if (courses[k].command_range > 0.0) return;
  findings.fail("command",
                "The command is constant in every recording: a free run has no input. Record a "
                "motion that is "
                "commanded, or name the command's channel in the drive file.");
}

void check_passive(const std::vector<DriveLog>& logs, const std::vector<Course>& courses,
                   Findings& findings) {
  if (!has_winding(logs.front().kind)) return;
  if (std::ranges::none_of(courses, [](const Course& course) { return course.has_passive_motion; }))
    findings.warn(
        "passive run",
        "No recording has a motion without power (enabled_1 = 0), so that the motor's back-EMF and "
        "viscous friction are hardly separable. Record the mass released with the power off.");
}

void check_number(const std::vector<DriveLog>& logs, Findings& findings) {
  if (logs.size() >= 3) return;
  findings.warn(
      "recordings",
      fmt::format(
          "{} {}: standard errors follow from leaving out one recording at a time, and need "
          "at least three.",
          logs.size(), logs.size() == 1 ? "recording" : "recordings"));
}

/// Two recordings of one command and one law.
bool is_repeat(const DriveLog& a, const DriveLog& b) {
  if (a.gain != b.gain) return false;
  const std::size_t count = std::min(a.size(), b.size());
  if (static_cast<double>(count) < 0.9 * static_cast<double>(std::max(a.size(), b.size())))
    return false;
  double difference = 0.0;
  double size = 0.0;
  for (std::size_t n = 0; n < count; ++n) {
    difference += (a.command[n] - b.command[n]) * (a.command[n] - b.command[n]);
    size += a.command[n] * a.command[n];
  }
  return difference <= 1e-4 * size;
}

void check_repeats(const std::vector<DriveLog>& logs, Findings& findings) {
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
                       Findings& findings) {
  std::map<double, std::pair<double, double>> range;  // by gain: lowest and highest mean
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    const auto channel = std::ranges::find_if(recordings[k].channels(), [](const Channel& c) {
      return c.name.starts_with("temperature") || c.name.ends_with("temperature_degC") ||
             c.name.ends_with("temperature_K");
    });
    if (channel == recordings[k].channels().end() || channel->values.empty()) return;
    double mean = 0.0;
    for (const double value : channel->values)
      mean += value / static_cast<double>(channel->values.size());
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
  findings.warn(
      "temperature",
      fmt::format(
          "The temperature changes in the order of the gains, by {:.0f} K: what the gain does "
          "and what the temperature does cannot be separated. Record the gains in another "
          "order.",
          std::abs(middles.back() - middles.front())));
}

/// Share of the supply that the back-EMF of the fitted motor takes.
void check_speeds(const std::vector<DriveLog>& logs, const DriveIdentification& identified,
                  Findings& findings) {
  if (!has_winding(logs.front().kind)) return;
  double speed = 0.0;
  for (const DriveLog& log : logs) speed = std::max(speed, course_of(log).largest_speed_rad_s);
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
double amplitude(std::span<const double> values, std::size_t stride, double phase_step) {
  const std::size_t count = values.size() / stride;
  double mean = 0.0;
  for (std::size_t n = 0; n < count; ++n) mean += values[n * stride] / static_cast<double>(count);
  std::complex<double> sum;
  for (std::size_t n = 0; n < count; ++n) {
    const auto at = static_cast<double>(n);
    const double window =
        0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * at / static_cast<double>(count));
    sum += std::polar(window * (values[n * stride] - mean), -phase_step * at);
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
  DriveLanes lanes = DriveLanes::all(identified.values);
  detail::AlignedVector<double> angles(log.size() * kDriveLanes);
  roll_out(log, run_from(log, 0, log.size()), lanes, {identified.terms, identified.step_s},
           {.angle_rad = angles.data()});
  constexpr int kFrequencies = 40;
  std::array<double, kFrequencies> command{};
  const auto phase = [&](int k) {
    const double frequency_Hz = 0.5 * std::pow(40.0, static_cast<double>(k) / (kFrequencies - 1));
    return 2.0 * std::numbers::pi * frequency_Hz * log.sample_period_s;
  };
  for (int k = 0; k < kFrequencies; ++k) command[k] = amplitude(log.command, 1, phase(k));
  // A frequency that the command hardly has shows nothing.
  const double least = 0.3 * *std::ranges::max_element(command);
  for (int k = 0; k < kFrequencies && phase(k) < 1.0; ++k) {
    if (command[k] < least || least <= 0.0) continue;
    const double measured = amplitude(log.angle_rad, 1, phase(k)) / command[k];
    const double modelled = amplitude(angles, kDriveLanes, phase(k)) / command[k];
    if (measured > 1.2 && measured - modelled > worst.measured - worst.modelled)
      worst = {phase(k) / (2.0 * std::numbers::pi * log.sample_period_s), measured, modelled};
  }
}

void check_peak(const std::vector<DriveLog>& logs, const DriveIdentification& identified,
                Findings& findings) {
  if (has(identified.terms, DriveTerm::spring)) return;
  const CommandKind kind = logs.front().kind;
  if (kind != CommandKind::goal_to_duty && kind != CommandKind::goal_to_torque) return;
  MissedPeak worst;
  for (const DriveLog& log : logs)
    if (std::ranges::all_of(log.enabled, [](double on) { return on != 0.0; }))
      find_peak(log, identified, worst);
  constexpr double kMissed = 0.25;
  if (worst.measured - worst.modelled <= kMissed * worst.measured || worst.measured == 0.0) return;
  findings.warn(
      "spring",
      fmt::format(
          "At {:.2g} Hz the angle is {:.2f} times the goal, in the model {:.2f} times: one mass "
          "cannot do that. Try a spring between motor and load: --spring.",
          worst.frequency_Hz, worst.measured, worst.modelled));
}

}  // namespace

std::vector<DriveFinding> check_drive_logs(const std::vector<Recording>& recordings,
                                           const std::vector<DriveLog>& logs) {
  Findings findings;
  std::vector<Course> courses;
  courses.reserve(logs.size());
  for (const DriveLog& log : logs) courses.push_back(course_of(log));
  check_motors(recordings, findings);
  check_turns(logs, courses, findings);
  check_command(logs, courses, findings);
  check_load(logs, courses, findings);
  check_saturation(logs, courses, findings);
  check_passive(logs, courses, findings);
  check_number(logs, findings);
  check_temperature(recordings, logs, findings);
  check_repeats(logs, findings);
  return findings.take();
}

std::vector<DriveFinding> check_identified(const std::vector<DriveLog>& logs,
                                           const DriveIdentification& identified) {
  Findings findings;
  for (const IdentifiedDriveParameter& parameter : identified.parameters) {
    const DriveParameterInfo& info = drive_parameter_info(parameter.parameter);
    if (parameter.is_at_bound)
      findings.warn(
          "bound",
          fmt::format(
              "{} is at the bound of its range, {:.3g}: the recordings do not determine it, or the "
              "load or the drive file is wrong.",
              info.name, parameter.value));
    else if (!parameter.is_determined)
      findings.warn(
          "not determined",
          fmt::format("{} is not determined by these recordings: {:.3g} to {:.3g} with 95 %.",
                      info.name, parameter.lowest, parameter.highest));
  }
  check_speeds(logs, identified, findings);
  check_peak(logs, identified, findings);
  return findings.take();
}

}  // namespace torsio
