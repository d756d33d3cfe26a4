#include "sim/joints/joint_faults.hpp"

#include <cmath>

#include "sim/faults/fault_rules.hpp"

namespace torsio {
namespace {

constexpr double kUnitScale =
    1.0;  // the channels of the telemetry have the units of the measurement

/// As `common_part_name`; empty for a fault of a sensor.
std::string_view part_of(std::string_view fault) noexcept {
  if (fault == "break" || fault == "bottom") return "spring";
  return fault == "friction" || fault == "torque-constant" ? fault : std::string_view{};
}

bool is_possible(const FaultRule& rule, double magnitude) noexcept {
  if (rule.amount_key.empty()) return true;
  const double size = limited_amount(rule, magnitude);
  if (!(size >= rule.lowest && size <= rule.highest)) return false;
  return rule.kind != FaultKind::wrap || magnitude == std::round(magnitude);
}

}  // namespace

JointFaults::JointFaults(std::span<const Sensor> sensors, double stop_Nm_rad)
    : sensors_(sensors.begin(), sensors.end()), stop_Nm_rad_(stop_Nm_rad) {}

void JointFaults::prepare(FaultInjector& injector) const {
  std::vector<FaultInjector::Injection> all;
  for (const Sensor& sensor : sensors_)
    if (sensor.value != nullptr)
      all.push_back({.value = sensor.value, .is_fresh = sensor.is_fresh});
  injector.prepare(all, kPerSensor);
}

LinkRefusal JointFaults::inject(FaultInjector& injector, const LinkInjectFault& fault,
                                double time_s) const noexcept {
  if (fault.fault.empty()) {
    injector.end_injections();
    return LinkRefusal::none;
  }
  const std::string_view part = part_of(fault.fault);
  const bool is_factor = !part.empty() && part == fault.fault;
  const FaultRule* const rule =
      is_factor ? find_fault_rule(FaultKind::drift, part) : find_fault_rule(fault.fault, part);
  if (rule == nullptr) return LinkRefusal::unknown_value;
  if (!is_possible(*rule, fault.magnitude) || !(fault.duration_s >= 0.0F))
    return LinkRefusal::out_of_range;
  FaultInjector::Injection injection{.kind = rule->kind,
                                     .factor = rule->factor,
                                     .start_s = time_s,
                                     .amount = fault.magnitude,
                                     .stop_stiffness_Nm_rad = stop_Nm_rad_};
  if (fault.duration_s > 0.0F) injection.end_s = time_s + double{fault.duration_s};
  if (part.empty()) {
    if (fault.channel >= sensors_.size()) return LinkRefusal::out_of_range;
    const Sensor& sensor = sensors_[fault.channel];
    if (sensor.value == nullptr || (rule->kind == FaultKind::wrap && !sensor.is_angle))
      return LinkRefusal::out_of_range;
    injection.value = sensor.value;
    injection.is_fresh = sensor.is_fresh;
    injection.amount = measured_amount(rule->kind, fault.magnitude, kUnitScale);
  }
  return injector.inject(injection) ? LinkRefusal::none : LinkRefusal::not_in_this_state;
}

}  // namespace torsio
