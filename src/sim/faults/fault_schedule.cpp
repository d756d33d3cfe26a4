#include "torsio/sim/faults/fault_schedule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/faults/fault_injector.hpp"
#include "sim/faults/fault_rules.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

// Ticks are multiples of a period that binary numbers do not hold: a fault of 2 s from 0.1 s on
// lasts 2000 ticks at 1 kHz, not 2001.
constexpr double kRounding_s = 1e-9;

}  // namespace

bool FaultInjector::Window::holds(double time_s) const noexcept {
  return time_s > start_s - kRounding_s && time_s < end_s - kRounding_s;
}

FaultInjector::FaultInjector(const FaultSchedule& schedule, const DataSheet& sheet, double run_s) {
  if (schedule.faults.size() > kMaxFaults)
    throw UsageError({.place = "fault schedule",
                      .expected = fmt::format("at most {} faults", kMaxFaults),
                      .found = fmt::format("{}", schedule.faults.size())});
  for (const ScheduledFault& fault : schedule.faults) {
    check_fault(fault, sheet, run_s);
    const std::string_view part = common_part_name(fault.what, sheet);
    const FaultRule& rule = *find_fault_rule(fault.kind, part);
    const Window window{fault.start_s, fault.duration_s ? fault.start_s + *fault.duration_s
                                                        : std::numeric_limits<double>::infinity()};
    if (part.empty()) {
      add_sensor_fault(fault, window, sheet);
    } else {
      parts_.push_back(
          {rule.factor, window, fault.amount, fault.over_s, fault.stop_stiffness_Nm_rad});
    }
  }
  scheduled_parts_ = parts_.size();
}

FaultInjector::Sensor& FaultInjector::sensor_of(double Measurement::*value,
                                                bool Measurement::*is_fresh) {
  const auto sensor = std::ranges::find(sensors_, value, &Sensor::value);
  if (sensor != sensors_.end()) return *sensor;
  return sensors_.emplace_back(Sensor{.value = value, .is_fresh = is_fresh});
}

void FaultInjector::prepare(std::span<const Injection> sensors, std::size_t faults) {
  for (const Injection& each : sensors) {
    Sensor& sensor = sensor_of(each.value, each.is_fresh);
    sensor.faults.reserve(sensor.scheduled + faults);
  }
  parts_.reserve(scheduled_parts_ + faults);
}

bool FaultInjector::inject(const Injection& injection) noexcept {
  const Window window{injection.start_s, injection.end_s};
  // What has ended frees its space.
  const auto has_ended = [&](const auto& fault) { return fault.window.end_s <= window.start_s; };
  const auto has_space = [&](auto& faults, std::size_t scheduled) {
    faults.erase(std::remove_if(faults.begin() + static_cast<std::ptrdiff_t>(scheduled),
                                faults.end(), has_ended),
                 faults.end());
    return faults.size() < faults.capacity();
  };
  if (injection.value == nullptr) {
    if (!has_space(parts_, scheduled_parts_)) return false;
    parts_.push_back({.factor = injection.factor,
                      .window = window,
                      .amount = injection.amount,
                      .stop_stiffness_Nm_rad = injection.stop_stiffness_Nm_rad});
    return true;
  }
  const auto sensor = std::ranges::find(sensors_, injection.value, &Sensor::value);
  if (sensor == sensors_.end() || !has_space(sensor->faults, sensor->scheduled)) return false;
  sensor->faults.push_back({.kind = injection.kind,
                            .window = window,
                            .amount = injection.amount,
                            .next_s = window.start_s});
  return true;
}

void FaultInjector::end_injections() noexcept {
  for (Sensor& sensor : sensors_)
    sensor.faults.erase(sensor.faults.begin() + static_cast<std::ptrdiff_t>(sensor.scheduled),
                        sensor.faults.end());
  parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(scheduled_parts_), parts_.end());
}

void FaultInjector::add_sensor_fault(const ScheduledFault& fault, const Window& window,
                                     const DataSheet& sheet) {
  const auto channels = sensed_channels(sheet);
  const SensedChannel& channel = *std::ranges::find(channels, fault.what, &SensedChannel::name);
  Sensor& sensor = sensor_of(channel.value, channel.is_fresh);
  ++sensor.scheduled;
  sensor.faults.push_back({.kind = fault.kind,
                           .window = window,
                           .amount = measured_amount(fault.kind, fault.amount, channel.scale),
                           .every_s = fault.every_s,
                           .next_s = window.start_s});
}

void FaultInjector::reset() noexcept {
  for (Sensor& sensor : sensors_) {
    sensor.delivered.reset();
    for (SensorFault& fault : sensor.faults) {
      fault.held.reset();
      fault.next_s = fault.window.start_s;
    }
  }
}

double FaultInjector::changed(SensorFault& fault, double value, double time_s) noexcept {
  const bool holds = fault.window.holds(time_s);
  if (!holds || !fault.held) fault.held = value;
  if (!holds) return value;
  switch (fault.kind) {
    case FaultKind::freeze: return *fault.held;
    case FaultKind::jump: return value + fault.amount;
    case FaultKind::drift: return value + fault.amount * (time_s - fault.window.start_s);
    case FaultKind::sign_flip: return -value;
    case FaultKind::quantised: return fault.amount * std::round(value / fault.amount);
    case FaultKind::nan: return kNotMeasured;
    case FaultKind::gain: return value * fault.amount;
    case FaultKind::wrap: return value + fault.amount;
    case FaultKind::zero: return 0.0;
    case FaultKind::spike:
      if (time_s < fault.next_s - kRounding_s) return value;
      fault.next_s = fault.every_s > 0.0 ? fault.next_s + fault.every_s
                                         : std::numeric_limits<double>::infinity();
      return value + fault.amount;
    case FaultKind::dropout:  // `apply` holds the value
    case FaultKind::broken:
    case FaultKind::bottom: break;
  }
  return value;
}

void FaultInjector::apply(Measurement& measured, double time_s) noexcept {
  for (Sensor& sensor : sensors_) {
    double& value = measured.*sensor.value;
    bool& is_fresh = measured.*sensor.is_fresh;
    for (const SensorFault& fault : sensor.faults)
      if (fault.kind == FaultKind::dropout && fault.window.holds(time_s)) is_fresh = false;
    if (is_fresh || !sensor.delivered) {
      for (SensorFault& fault : sensor.faults) value = changed(fault, value, time_s);
      sensor.delivered = value;
    }
    value = *sensor.delivered;
  }
}

PlantCondition FaultInjector::condition(double time_s, const PlantCondition& sound) const noexcept {
  PlantCondition condition = sound;
  for (const PartFault& fault : parts_) {
    if (!fault.window.holds(time_s)) continue;
    if (fault.factor == nullptr) {
      if (fault.amount >= condition.stop_twist_rad) continue;
      condition.stop_twist_rad = fault.amount;
      condition.stop_stiffness_Nm_rad = fault.stop_stiffness_Nm_rad;
    } else {
      const double since_s = std::max(time_s - fault.window.start_s, 0.0);
      const double done = since_s < fault.over_s ? since_s / fault.over_s : 1.0;
      double& factor = condition.*fault.factor;
      factor = std::min(factor * (1.0 + (fault.amount - 1.0) * done), kLargestFactor);
    }
  }
  return condition;
}

}  // namespace torsio
