#include "sim/faults/fault_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <variant>

#include "core/checks.hpp"
#include "data/names.hpp"
#include "sim/plant/stages.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLargest = 1e6;    // largest amount in its unit: everything remains finite
constexpr double kSmallest = 1e-9;  // smallest amount with an effect
constexpr double kLatestFault_s = 1e6;
constexpr std::string_view kSpring = "spring";
constexpr std::string_view kFriction = "friction";
constexpr std::string_view kTorqueConstant = "torque-constant";

constexpr auto kRules = std::to_array<FaultRule>({
    {.name = "freeze", .kind = FaultKind::freeze},
    {.name = "jump",
     .kind = FaultKind::jump,
     .amount_key = "by",
     .lowest = kSmallest,
     .highest = kLargest},
    {.name = "drift",
     .kind = FaultKind::drift,
     .amount_key = "per_second",
     .lowest = kSmallest,
     .highest = kLargest},
    {.name = "sign_flip", .kind = FaultKind::sign_flip},
    {.name = "quantised",
     .kind = FaultKind::quantised,
     .amount_key = "to",
     .lowest = kSmallest,
     .highest = kLargest},
    {.name = "dropout", .kind = FaultKind::dropout},
    {.name = "nan", .kind = FaultKind::nan},
    {.name = "gain",
     .kind = FaultKind::gain,
     .amount_key = "to",
     .amount_unit = "1",
     .highest = kLargest},
    {.name = "spike",
     .kind = FaultKind::spike,
     .amount_key = "by",
     .lowest = kSmallest,
     .highest = kLargest},
    {.name = "wrap",
     .kind = FaultKind::wrap,
     .amount_key = "by",
     .amount_unit = "1",
     .lowest = 1.0,
     .highest = 1e3},
    {.name = "zero", .kind = FaultKind::zero},
    {.name = "break",
     .kind = FaultKind::broken,
     .part = kSpring,
     .amount_key = "to",
     .amount_unit = "1",
     .highest = 1.0,
     .factor = &PlantCondition::second_stage_factor},
    {.name = "bottom",
     .kind = FaultKind::bottom,
     .part = kSpring,
     .amount_key = "beyond",
     .amount_unit = "rad",
     .lowest = 1e-4,
     .highest = 3.2},
    {.name = "drift",
     .kind = FaultKind::drift,
     .part = kFriction,
     .amount_key = "to",
     .amount_unit = "1",
     .highest = kLargestFactor,
     .factor = &PlantCondition::friction_factor},
    {.name = "drift",
     .kind = FaultKind::drift,
     .part = kTorqueConstant,
     .amount_key = "to",
     .amount_unit = "1",
     .highest = kLargestFactor,
     .factor = &PlantCondition::torque_constant_factor},
});

/// A harmonic drive's second stage is its gear.
std::string_view second_stage_name(const DataSheet& sheet) {
  return sheet.family == ActuatorFamily::harmonic_drive ? "gear" : kSpring;
}

std::string text(double value, std::string_view unit) {
  return fmt::format("{:g}{}{}", value, unit.empty() ? "" : " ", unit);
}

[[noreturn]] void refuse_fault(const ScheduledFault& fault, std::string_view what,
                               std::string_view expected, std::string_view found,
                               std::string_view advice = {}) {
  const std::string place =
      fault.place.empty() ? fmt::format("fault of {}", printable(fault.what)) : fault.place;
  refuse<UsageError>({place, what}, expected, found, advice);
}

void require_within(const ScheduledFault& fault, std::string_view what, double value, double lowest,
                    double highest, std::string_view unit) {
  if (value >= lowest && value <= highest) return;
  refuse_fault(fault, what, fmt::format("{} to {}", text(lowest, unit), text(highest, unit)),
               text(value, unit));
}

void check_times(const ScheduledFault& fault, double run_s) {
  require_within(fault, "at", fault.start_s, 0.0, kLatestFault_s, "s");
  if (!(fault.start_s < run_s))
    refuse_fault(fault, "at", fmt::format("a time within the run, before {}", text(run_s, "s")),
                 text(fault.start_s, "s"),
                 "Begin the fault earlier, or let the run last longer (--duration).");
  if (fault.duration_s) require_within(fault, "for", *fault.duration_s, 1e-6, kLatestFault_s, "s");
}

std::string_view channel_unit(std::string_view channel) {
  const auto parts = split_channel_name(channel);
  return parts ? parts->unit->suffix : std::string_view{};
}

/// Only an encoder has turns.
void check_turns(const ScheduledFault& fault) {
  if (channel_unit(fault.what) != "rad")
    refuse_fault(fault, "", "an angle, whose encoder has turns", fault.what);
  if (fault.amount != std::round(fault.amount))
    refuse_fault(fault, "by", "a whole number of turns", text(fault.amount, ""));
}

void check_amount(const ScheduledFault& fault, const FaultRule& rule) {
  if (rule.amount_key.empty()) return;
  std::string_view unit = rule.amount_unit == "1" ? std::string_view{} : rule.amount_unit;
  if (rule.part.empty() && rule.amount_unit.empty()) unit = channel_unit(fault.what);
  require_within(fault, rule.amount_key, limited_amount(rule, fault.amount), rule.lowest,
                 rule.highest, unit);
}

}  // namespace

std::string_view common_part_name(std::string_view part, const DataSheet& sheet) {
  if (part == kFriction || part == kTorqueConstant) return part;
  return part == second_stage_name(sheet) ? kSpring : std::string_view{};
}

double stiffest_stop(const DataSheet& sheet) {
  const PlantParameters plant = plant_parameters(sheet);
  return Plant::stiffest_stop(plant, std::min(Plant::step_limit(plant), Plant::kDefaultStep_s));
}

std::vector<std::string> fault_sensors(const DataSheet& sheet) {
  std::vector<std::string> names;
  for (const SensedChannel& channel : sensed_channels(sheet)) names.emplace_back(channel.name);
  return names;
}

std::vector<std::string> fault_parts(const DataSheet& sheet) {
  return {std::string(second_stage_name(sheet)), std::string(kFriction),
          std::string(kTorqueConstant)};
}

const FaultRule* find_fault_rule(std::string_view name, std::string_view part) noexcept {
  for (const FaultRule& rule : kRules)
    if (rule.name == name && rule.part == part) return &rule;
  return nullptr;
}

const FaultRule* find_fault_rule(FaultKind kind, std::string_view part) noexcept {
  for (const FaultRule& rule : kRules)
    if (rule.kind == kind && rule.part == part) return &rule;
  return nullptr;
}

double limited_amount(const FaultRule& rule, double amount) noexcept {
  const bool has_sign = rule.part.empty() && rule.kind != FaultKind::quantised;
  return has_sign ? std::abs(amount) : amount;
}

double measured_amount(FaultKind kind, double amount, double scale) noexcept {
  if (kind == FaultKind::gain) return amount;
  if (kind == FaultKind::wrap) return 2.0 * std::numbers::pi * amount;
  return amount / scale;
}

std::vector<std::string> fault_names(std::string_view part) {
  std::vector<std::string> names;
  for (const FaultRule& rule : kRules)
    if (rule.part == part) names.emplace_back(rule.name);
  return names;
}

void check_fault(const ScheduledFault& fault, const DataSheet& sheet, double run_s) {
  const std::vector<std::string> sensors = fault_sensors(sheet);
  const std::string_view part = common_part_name(fault.what, sheet);
  if (part.empty() && std::ranges::find(sensors, fault.what) == sensors.end()) {
    std::vector<std::string> known = sensors;
    std::ranges::move(fault_parts(sheet), std::back_inserter(known));
    refuse_fault(fault, "", fmt::format("a sensor or part of {}: {}", sheet.name, joined(known)),
                 fmt::format("'{}'", printable(fault.what)), did_you_mean(fault.what, known));
  }
  const FaultRule* const rule = find_fault_rule(fault.kind, part);
  if (rule == nullptr)
    refuse_fault(fault, fault.what, "one of " + joined(fault_names(part)),
                 std::string(std::ranges::find(kRules, fault.kind, &FaultRule::kind)->name));
  check_times(fault, run_s);
  check_amount(fault, *rule);
  if (rule->kind == FaultKind::bottom)
    require_within(fault, "stiffness", fault.stop_stiffness_Nm_rad, 1e-3, stiffest_stop(sheet),
                   "Nm/rad");
  if (rule->kind == FaultKind::wrap) check_turns(fault);
  if (rule->kind == FaultKind::spike)
    require_within(fault, "every", fault.every_s, 0.0, kLatestFault_s, "s");
  if (rule->kind == FaultKind::drift && !rule->part.empty())
    require_within(fault, "over", fault.over_s, 0.0, kLatestFault_s, "s");
}

}  // namespace torsio
