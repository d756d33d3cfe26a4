#include "identify/drive/drive_logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "data/channel_names.hpp"
#include "data/names.hpp"
#include "joint_load/load_fact.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// The ratio of the drive file, else the condition of the recording, else 1.
double gear_ratio(const Recording& recording, const DriveSheet& drive) {
  if (drive.gear_ratio || !recording.has("gear_ratio_1")) return drive.gear_ratio.value_or(1.0);
  const double ratio = fact_in({.condition = "gear_ratio_1"}, recording, drive.file, "gear_ratio");
  if (ratio > 0.0) return ratio;
  throw Error({.place = recording.name() + ": gear_ratio_1",
               .expected = "a ratio above 0",
               .found = fmt::format("{:.6g}", ratio)});
}

double error_gain_of(const DriveSheet& drive) {
  if (drive.error_gain_1_rad) return *drive.error_gain_1_rad;
  throw Error({.place = drive.file,
               .expected = "error_gain, the duty for an error of 1 rad at gain 1",
               .found = "none",
               .advice = "Identify the drive from recordings with duty_1, or state it."});
}

void set_law(const Recording& recording, const DriveSheet& drive, DriveLog& log) {
  const auto fact = [&](const LoadFact& stated, std::string_view name) {
    return fact_in(stated, recording, drive.file, name);
  };
  const auto positive = [&](const LoadFact& stated, std::string_view name) {
    const double value = fact(stated, name);
    if (value > 0.0) return value;
    throw Error({.place = recording.name(),
                 .expected = fmt::format("a {} above 0", name),
                 .found = fmt::format("{:.6g}", value)});
  };
  const std::string channel = command_channel(recording, drive);
  log.command = finite_channel(recording, channel);
  log.brakes_when_off = drive.brakes_when_off;
  switch (drive.law) {
    case DriveLaw::position:
      log.kind = CommandKind::goal_to_duty;
      log.supply_V = positive(drive.supply_V, "supply");
      log.gain = positive(drive.gain, "gain") * error_gain_of(drive);
      log.limit = drive.max_duty_1;
      return;
    case DriveLaw::pd:
      log.kind = CommandKind::goal_to_torque;
      log.gain = positive(drive.kp_Nm_rad, "kp");
      log.speed_gain = fact(drive.kd_Nms_rad, "kd");
      log.limit = positive(drive.torque_limit_Nm, "torque_limit");
      log.speed_filter_rad_s = 2.0 * std::numbers::pi * drive.speed_filter_Hz;
      return;
    case DriveLaw::voltage:
      log.kind = CommandKind::duty;
      log.supply_V = positive(drive.supply_V, "supply");
      if (channel.ends_with("_V"))
        for (double& value : log.command) value /= log.supply_V;
      return;
    case DriveLaw::current: log.kind = CommandKind::current; return;
    case DriveLaw::torque: log.kind = CommandKind::torque; return;
  }
}

/// A command that jumps between two samples keeps its value until the second one; others change linearly.
std::vector<double> ends_of_commands(const std::vector<double>& command) {
  constexpr double kOfRange = 0.02;
  constexpr double kOfNeighbours = 5.0;
  const auto [low, high] = std::ranges::minmax(command);
  const auto change = [&](std::size_t n) {
    return n + 1 < command.size() ? std::abs(command[n + 1] - command[n]) : 0.0;
  };
  std::vector<double> ends(command);
  for (std::size_t n = 0; n + 1 < command.size(); ++n) {
    const double neighbours = std::max(n > 0 ? change(n - 1) : 0.0, change(n + 1));
    const bool jumps = change(n) > std::max(kOfRange * (high - low), kOfNeighbours * neighbours);
    if (!jumps) ends[n] = command[n + 1];
  }
  return ends;
}

}  // namespace

const std::vector<double>& finite_channel(const Recording& recording, const std::string& name) {
  const std::vector<double>& values = recording.channel(name).values;
  const auto wrong =
      std::ranges::find_if(values, [](double value) { return !std::isfinite(value); });
  if (wrong == values.end()) return values;
  const auto sample = static_cast<std::size_t>(wrong - values.begin());
  throw Error({.place = fmt::format("{}, {}, t = {:.4g} s", recording.name(), name,
                                    recording.time_s(sample)),
               .expected = "a finite value, as a free run passes through every sample",
               .found = fmt::format("{}", *wrong),
               .advice = "Cut the recording there (from, to or split_at_gaps in a mapping)."});
}

std::string command_channel(const Recording& recording, const DriveSheet& drive) {
  const std::vector<std::string> wanted =
      drive.command.empty() ? command_channels(drive.law) : std::vector<std::string>{drive.command};
  for (const std::string& channel : wanted)
    if (recording.has(channel)) return channel;
  throw Error(
      {.place = recording.name(),
       .expected = fmt::format("the command of the law '{}': {}", name(drive.law), joined(wanted)),
       .found = "the channels " + joined(channel_names(recording.channels())),
       .advice = "Name its channel as 'command' in the drive file, or map the column to it."});
}

std::string angle_channel(const Recording& recording, const DriveSheet& drive) {
  constexpr std::array<std::string_view, 3> kAngles{"motor_angle_rad", "gear_angle_rad",
                                                    "joint_angle_rad"};
  if (!drive.angle.empty()) return recording.channel(drive.angle).name;
  for (const std::string_view angle : kAngles)
    if (recording.has(angle)) return std::string(angle);
  throw Error(
      {.place = recording.name(),
       .expected = "the angle of the motor or of the joint: motor_angle_rad, gear_angle_rad or "
                   "joint_angle_rad",
       .found = "the channels " + joined(channel_names(recording.channels())),
       .advice = "Name its channel as 'angle' in the drive file, or map the column to it."});
}

std::vector<double> angle_after_gear(const Recording& recording, const DriveSheet& drive) {
  const std::string name = angle_channel(recording, drive);
  std::vector<double> angle_rad = finite_channel(recording, name);
  if (name != "motor_angle_rad") return angle_rad;
  const double ratio = gear_ratio(recording, drive);
  for (double& value : angle_rad) value /= ratio;
  return angle_rad;
}

DriveLog drive_log(const Recording& recording, const LoadSheet& load, const DriveSheet& drive) {
  DriveLog log;
  log.name = recording.name();
  log.sample_period_s = 1.0 / recording.sample_rate_Hz();
  if (recording.size() < kFewestDriveSamples)
    throw Error({.place = recording.name(),
                 .expected = fmt::format("at least {} samples", kFewestDriveSamples),
                 .found = fmt::format("{}", recording.size())});
  log.angle_rad = angle_after_gear(recording, drive);
  set_law(recording, drive, log);
  log.command_end = drive.is_command_held ? log.command : ends_of_commands(log.command);
  if (recording.has("enabled_1")) log.enabled = finite_channel(recording, "enabled_1");
  log.load = known_load(load, recording);
  return log;
}

std::vector<DriveLog> drive_logs(const std::vector<Recording>& recordings, const LoadSheet& load,
                                 const DriveSheet& drive) {
  std::vector<DriveLog> logs;
  logs.reserve(recordings.size());
  for (const Recording& recording : recordings) logs.push_back(drive_log(recording, load, drive));
  return logs;
}

namespace {

std::string text_of(double value) { return fmt::format("{:.6g}", value); }

/// Texts of a label by recording, nothing if one lacks it.
std::vector<std::string> label_of(const std::vector<Recording>& recordings,
                                  const std::string& label) {
  std::vector<std::string> texts;
  for (const Recording& recording : recordings) {
    const auto found =
        std::ranges::find(recording.labels, label, &std::pair<std::string, std::string>::first);
    if (found == recording.labels.end()) return {};
    texts.push_back(found->second);
  }
  return texts;
}

/// Values of a condition by recording, nothing if one lacks it.
std::vector<std::string> values_of(const std::vector<Recording>& recordings,
                                   const std::string& condition) {
  std::vector<std::string> values;
  for (const Recording& recording : recordings) {
    if (!recording.has(condition)) return {};
    values.push_back(
        fmt::format("{} {}", condition, text_of(recording.channel(condition).values.front())));
  }
  return values;
}

/// What recordings could be grouped by.
std::string names_of_groups(const std::vector<Recording>& recordings) {
  std::vector<std::string> names;
  for (const std::string& condition : recordings.front().conditions())
    if (!values_of(recordings, condition).empty()) names.push_back(condition);
  for (const auto& [label, text] : recordings.front().labels)
    if (!label_of(recordings, label).empty()) names.push_back(label);
  return names.empty() ? "recordings without conditions and labels"
                       : "recordings with " + joined(names);
}

}  // namespace

std::vector<std::string> drive_groups(const std::vector<Recording>& recordings,
                                      const std::string& group_by) {
  std::vector<std::string> own;
  own.reserve(recordings.size());
  for (const Recording& recording : recordings) own.push_back(recording.name());
  if (!group_by.empty() && group_by != "recording") {
    std::vector<std::string> values = values_of(recordings, group_by);
    if (values.empty()) values = label_of(recordings, group_by);
    if (!values.empty()) return values;
    throw UsageError({.place = fmt::format("the groups by '{}' (--group-by)", group_by),
                      .expected = "a condition or a label that all recordings have, or 'recording'",
                      .found = names_of_groups(recordings)});
  }
  constexpr std::size_t kManyRecordings = 6;
  if (group_by == "recording" || recordings.size() <= kManyRecordings) return own;
  std::vector<std::string> best = own;
  std::size_t fewest = recordings.size();
  for (const std::string& condition : recordings.front().conditions()) {
    std::vector<std::string> values = values_of(recordings, condition);
    const std::size_t count = std::set<std::string>(values.begin(), values.end()).size();
    if (values.empty() || count < 3 || count >= fewest) continue;
    fewest = count;
    best = std::move(values);
  }
  return best;
}

}  // namespace torsio
