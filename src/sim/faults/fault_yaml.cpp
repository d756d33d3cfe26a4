#include <fmt/format.h>

#include <algorithm>

#include "actuator/second_stage.hpp"
#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "sim/faults/fault_injector.hpp"
#include "sim/faults/fault_rules.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// One of the names, or a complaint that lists them.
std::string chosen(const YamlValue& yaml, const std::vector<std::string>& known) {
  std::string text = yaml.text();
  if (std::ranges::find(known, text) == known.end())
    yaml.refuse("one of " + joined(known), did_you_mean(text, known));
  return text;
}

double amount_from(const YamlValue& yaml, const FaultRule& rule, const std::string& what) {
  if (!rule.amount_unit.empty()) return yaml.number(rule.amount_unit);
  return yaml.number(split_channel_name(what)->unit->suffix);
}

double stop_stiffness(const YamlValue& yaml, const DataSheet& sheet) {
  const auto stiffness = yaml.find("stiffness");
  const auto times = yaml.find("times");
  if (stiffness.has_value() == times.has_value())
    yaml.refuse("either 'stiffness: 5000Nm_rad' of the stop or 'times: 10' the spring's");
  return stiffness ? stiffness->number("Nm_rad") : times->number() * second_stage_stiffness(sheet);
}

/// Reads the keys of one rule.
void read_amounts(const YamlValue& yaml, const FaultRule& rule, const DataSheet& sheet,
                  ScheduledFault& fault) {
  const std::string_view who = rule.part.empty() ? "sensor" : "part";
  const std::string_view key = rule.amount_key;
  if (rule.kind == FaultKind::bottom) {
    yaml.allow_only({who, "fault", "at", "for", key, "stiffness", "times"});
    fault.stop_stiffness_Nm_rad = stop_stiffness(yaml, sheet);
  } else if (rule.kind == FaultKind::drift && !rule.part.empty()) {
    yaml.allow_only({who, "fault", "at", "for", key, "over"});
    fault.over_s = yaml.at("over").number("s");
  } else if (rule.kind == FaultKind::spike) {
    yaml.allow_only({who, "fault", "at", "for", key, "every"});
    if (const auto every = yaml.find("every")) fault.every_s = every->number("s");
  } else if (!key.empty()) {
    yaml.allow_only({who, "fault", "at", "for", key});
  } else {
    yaml.allow_only({who, "fault", "at", "for"});
  }
  if (key.empty()) return;
  // All of it breaks; one turn.
  const bool may_miss = rule.kind == FaultKind::broken || rule.kind == FaultKind::wrap;
  if (rule.kind == FaultKind::wrap) fault.amount = 1.0;
  if (const auto amount = may_miss ? yaml.find(key) : yaml.at(key))
    fault.amount = amount_from(*amount, rule, fault.what);
}

ScheduledFault fault_from(const YamlValue& yaml, const DataSheet& sheet) {
  const auto sensor = yaml.find("sensor");
  const auto part = yaml.find("part");
  if (sensor.has_value() == part.has_value()) yaml.refuse("either a sensor or a part");
  ScheduledFault fault;
  fault.place = yaml.place();
  fault.what = sensor ? chosen(*sensor, fault_sensors(sheet)) : chosen(*part, fault_parts(sheet));
  const std::string_view common_name = common_part_name(fault.what, sheet);
  const std::string kind = chosen(yaml.at("fault"), fault_names(common_name));
  const FaultRule& rule = *find_fault_rule(kind, common_name);
  fault.kind = rule.kind;
  read_amounts(yaml, rule, sheet, fault);
  fault.start_s = yaml.at("at").number("s");
  if (const auto duration = yaml.find("for")) fault.duration_s = duration->number("s");
  return fault;
}

FaultSchedule schedule_from(const YamlValue& yaml, const DataSheet& sheet) {
  yaml.allow_only({"faults"});
  const YamlValue list = yaml.at("faults");
  if (!list.is_list()) list.refuse("a list of faults, '- {sensor: ...}'");
  const std::vector<YamlValue> items = list.items();
  if (items.empty() || items.size() > FaultInjector::kMaxFaults)
    list.refuse(fmt::format("1 to {} faults", FaultInjector::kMaxFaults));
  FaultSchedule schedule;
  for (const YamlValue& item : items) schedule.faults.push_back(fault_from(item, sheet));
  // What is out of range is refused here, too, without a run.
  static_cast<void>(FaultInjector(schedule, sheet));
  return schedule;
}

/// A schedule is a part of the call: all that is wrong with it is a UsageError.
template <class Read>
FaultSchedule as_usage(const DataSheet& sheet, const Read& read) {
  try {
    return schedule_from(read(), sheet);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw UsageError(error.report());
  }
}

}  // namespace

FaultSchedule read_fault_schedule(const std::string& path, const DataSheet& sheet,
                                  const Progress& progress) {
  return as_usage(sheet, [&] { return YamlValue::read(path, progress); });
}

FaultSchedule parse_fault_schedule(std::string_view text, const std::string& name,
                                   const DataSheet& sheet) {
  return as_usage(sheet, [&] { return YamlValue::parse(text, name); });
}

}  // namespace torsio
