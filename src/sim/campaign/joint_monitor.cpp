#include "joint_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "safety/valid_source.hpp"
#include "sim/sensors/sensed_channels.hpp"

namespace torsio {

JointMonitor::JointMonitor(MonitoredTorque monitored, const DataSheet& sheet, bool is_electrical)
    : monitored_(std::move(monitored)), raw_(monitored_.raw_inputs().size()) {
  for (const SensedChannel& channel :
       sensed_inputs(sheet, monitored_.raw_inputs(), "monitor", is_electrical))
    inputs_.push_back({.value = channel.value,
                       .is_fresh = channel.is_fresh,
                       .scale = channel.scale,
                       .is_current = channel.value == &Measurement::motor_current_A});
}

Monitor::State JointMonitor::step(double t_s, const Measurement& measured,
                                  double current_factor) noexcept {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Input& input = inputs_[i];
    if (measured.*input.is_fresh) input.measured_s = t_s;
    raw_[i].value = (input.is_current ? current_factor : 1.0) * input.scale * measured.*input.value;
    raw_[i].age_s = t_s - input.measured_s;
  }
  monitored_.step(t_s, raw_);
  if (monitor().state() == Monitor::State::ready) monitored_.monitor().arm(t_s);
  return monitor().state();
}

namespace {

/// The largest difference of two sources. @param value_of (source) -> number
template <class Value>
double largest_difference(std::span<const Estimate> sources, bool only_valid,
                          const Value& value_of) noexcept {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (only_valid && !detail::is_valid(sources[i])) continue;
    lowest = std::min(lowest, value_of(i));
    highest = std::max(highest, value_of(i));
  }
  return highest > lowest ? highest - lowest : 0.0;
}

}  // namespace

double JointMonitor::changed_difference_Nm(const JointMonitor& sound,
                                           bool only_valid) const noexcept {
  const std::span<const Estimate> own = monitored_.estimates();
  const std::span<const Estimate> other = sound.monitored_.estimates();
  return largest_difference(own, only_valid,
                            [&](std::size_t i) { return own[i].value - other[i].value; });
}

double JointMonitor::difference_Nm() const noexcept {
  const std::span<const Estimate> own = monitored_.estimates();
  return largest_difference(own, true, [&](std::size_t i) { return own[i].value; });
}

bool uses(const MonitoredTorque& monitored, std::string_view channel) {
  return std::ranges::find(monitored.raw_inputs(), channel) != monitored.raw_inputs().end();
}

}  // namespace torsio
