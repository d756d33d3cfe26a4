#include "torsio/identify/drive/drive_sheet.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <utility>

#include "core/quantity.hpp"
#include "data/channel_names.hpp"
#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "joint_load/load_fact.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::array<std::pair<std::string_view, DriveLaw>, 5> kLaws{
    {{"position", DriveLaw::position},
     {"pd", DriveLaw::pd},
     {"voltage", DriveLaw::voltage},
     {"current", DriveLaw::current},
     {"torque", DriveLaw::torque}}};

constexpr double kHighestSupply_V = 1e5;
constexpr double kHighestGain_Nm_rad = 1e7;

DriveLaw law_of(const YamlValue& value) {
  const std::string text = value.text();
  for (const auto& [law_name, law] : kLaws)
    if (law_name == text) return law;
  value.refuse("one of the laws position, pd, voltage, current, torque");
}

/// Keys of one law in addition to those of all.
void require_keys(const YamlValue& drive, DriveLaw law) {
  std::vector<std::string> keys{"law", "command", "between_samples", "angle", "gear_ratio"};
  const auto with = [&](std::initializer_list<const char*> more) {
    keys.insert(keys.end(), more.begin(), more.end());
  };
  if (law == DriveLaw::position) with({"gain", "error_gain", "supply", "max_duty", "off"});
  if (law == DriveLaw::voltage) with({"supply", "off"});
  if (law == DriveLaw::pd) with({"kp", "kd", "torque_limit", "filter"});
  drive.allow_only(keys);
}

/// The name of a channel in one of these units.
std::string channel_in(const YamlValue& value, std::initializer_list<std::string_view> si_units) {
  std::string text = value.text();
  const auto channel = split_channel_name(text);
  if (!channel || std::ranges::find(si_units, channel->unit->si_suffix) == si_units.end())
    value.refuse(fmt::format("a channel whose name ends in _{}", fmt::join(si_units, " or _")));
  return text;
}

std::string command_of(const YamlValue& value, DriveLaw law) {
  switch (law) {
    case DriveLaw::position:
    case DriveLaw::pd: return channel_in(value, {"rad"});
    case DriveLaw::voltage: return channel_in(value, {"V", "1"});
    case DriveLaw::current: return channel_in(value, {"A"});
    case DriveLaw::torque: break;
  }
  return channel_in(value, {"Nm"});
}

double positive(const YamlValue& value, std::string_view si_unit) {
  const double number = quantity_with_unit(value.text(), si_unit, value.place());
  if (!(number > 0.0)) value.refuse("a number above 0");
  return number;
}

void read_position(const YamlValue& drive, DriveSheet& sheet) {
  if (const auto gain = drive.find("gain")) sheet.gain = load_fact(*gain, "1");
  const auto error_gain = drive.find("error_gain");
  if (error_gain && error_gain->text() != "measured") {
    const double value = error_gain->plain_number(1e6);
    if (!(value > 0.0))
      error_gain->refuse("the duty for an error of 1 rad at gain 1, above 0, or 'measured'");
    sheet.error_gain_1_rad = value;
  }
  if (const auto limit = drive.find("max_duty")) {
    sheet.max_duty_1 = limit->plain_number(1.0);
    if (!(sheet.max_duty_1 > 0.0)) limit->refuse("a duty above 0, at most 1");
  }
}

void read_winding(const YamlValue& drive, DriveSheet& sheet) {
  sheet.supply_V = load_fact(drive.at("supply"), "V");
  if (sheet.supply_V.condition.empty() &&
      !(sheet.supply_V.value > 0.0 && sheet.supply_V.value <= kHighestSupply_V))
    drive.at("supply").refuse(fmt::format("a voltage above 0V, at most {:g}V", kHighestSupply_V));
  if (const auto off = drive.find("off")) {
    const std::string text = off->text();
    if (text != "open_circuit" && text != "short")
      off->refuse("open_circuit or short: the winding while enabled_1 is 0");
    sheet.brakes_when_off = text == "short";
  }
}

void read_pd(const YamlValue& drive, DriveSheet& sheet) {
  sheet.kp_Nm_rad = load_fact(drive.at("kp"), "Nm_rad");
  if (sheet.kp_Nm_rad.condition.empty() &&
      !(sheet.kp_Nm_rad.value > 0.0 && sheet.kp_Nm_rad.value <= kHighestGain_Nm_rad))
    drive.at("kp").refuse(
        fmt::format("a gain above 0Nm/rad, at most {:g}Nm/rad", kHighestGain_Nm_rad));
  if (const auto kd = drive.find("kd")) sheet.kd_Nms_rad = load_fact(*kd, "Nms_rad");
  if (const auto limit = drive.find("torque_limit"))
    sheet.torque_limit_Nm = load_fact(*limit, "Nm");
  if (const auto filter = drive.find("filter")) sheet.speed_filter_Hz = positive(*filter, "Hz");
}

DriveSheet sheet_from(const YamlValue& root, const std::string& name) {
  if (!root.is_map()) root.refuse("a map with the key drive");
  const YamlValue drive = root.find("drive").value_or(root);
  if (root.find("drive")) root.allow_only({"drive"});
  if (!drive.is_map()) drive.refuse("a map with the key law");
  DriveSheet sheet;
  sheet.file = name;
  sheet.law = law_of(drive.at("law"));
  require_keys(drive, sheet.law);
  if (const auto command = drive.find("command")) sheet.command = command_of(*command, sheet.law);
  if (const auto between = drive.find("between_samples")) {
    const std::string text = between->text();
    if (text != "held" && text != "linear")
      between->refuse("held or linear: the command between two samples");
    sheet.is_command_held = text == "held";
  }
  if (const auto angle = drive.find("angle")) sheet.angle = channel_in(*angle, {"rad"});
  if (const auto ratio = drive.find("gear_ratio")) {
    const double value = ratio->plain_number(1e5);
    if (!(value > 0.0)) ratio->refuse("a ratio above 0");
    sheet.gear_ratio = value;
  }
  if (sheet.law == DriveLaw::position) read_position(drive, sheet);
  if (sheet.law == DriveLaw::position || sheet.law == DriveLaw::voltage) read_winding(drive, sheet);
  if (sheet.law == DriveLaw::pd) read_pd(drive, sheet);
  return sheet;
}

/// @param has_two whether the goal is a command, and the torque or current another one
[[noreturn]] void refuse_to_assume(const Recording& recording, bool has_two) {
  const std::string found = "the channels " + joined(channel_names(recording.channels()));
  if (has_two)
    throw Error({.place = recording.name(),
                 .expected =
                     "a goal with what states its law (duty_1 and the condition supply_V, or "
                     "the condition kp_Nm_rad), or one command alone",
                 .found = found,
                 .advice = "State which one drives the motor in a drive file (--drive), "
                           "for example 'drive: {law: current}' (docs/use/identify.md)."});
  throw Error({.place = recording.name(),
               .expected =
                   "channels that state the drive's law: goal_angle_rad, duty_1 and the condition "
                   "supply_V; goal_angle_rad and the conditions kp_Nm_rad, kd_Nms_rad; "
                   "motor_current_A; or command_torque_Nm",
               .found = found,
               .advice = "State the law in a drive file (--drive, docs/use/identify.md)."});
}

}  // namespace

std::string_view name(DriveLaw law) { return kLaws[static_cast<std::size_t>(law)].first; }

std::vector<std::string> command_channels(DriveLaw law) {
  switch (law) {
    case DriveLaw::position:
    case DriveLaw::pd: return {"goal_angle_rad"};
    case DriveLaw::voltage: return {"drive_V", "duty_1"};
    case DriveLaw::current: return {"motor_current_A"};
    case DriveLaw::torque: return {"command_torque_Nm"};
  }
  return {};
}

DriveSheet parse_drive_sheet(std::string_view text, const std::string& name) {
  return sheet_from(YamlValue::parse(text, name), name);
}

DriveSheet read_drive_sheet(const std::string& path) {
  return sheet_from(YamlValue::read(path), path);
}

DriveSheet assumed_drive_sheet(const Recording& recording) {
  const auto has = [&](std::string_view channel) { return recording.has(channel); };
  DriveSheet sheet;
  sheet.file = "the drive assumed without a drive file";
  const bool has_goal = has("goal_angle_rad");
  const bool has_torque = has("motor_current_A") || has("command_torque_Nm");
  if (has_goal && has("kp_Nm_rad")) {
    sheet.law = DriveLaw::pd;
    sheet.kp_Nm_rad.condition = "kp_Nm_rad";
    if (has("kd_Nms_rad")) sheet.kd_Nms_rad.condition = "kd_Nms_rad";
    if (has("torque_limit_Nm")) sheet.torque_limit_Nm.condition = "torque_limit_Nm";
  } else if (has_goal && has("supply_V") && has("duty_1")) {
    sheet.law = DriveLaw::position;
    if (has("kp_1")) sheet.gain.condition = "kp_1";
    sheet.supply_V.condition = "supply_V";
  } else if (has_torque && !has_goal) {
    sheet.law = has("motor_current_A") ? DriveLaw::current : DriveLaw::torque;
  } else {
    refuse_to_assume(recording, has_goal && has_torque);
  }
  return sheet;
}

}  // namespace torsio
