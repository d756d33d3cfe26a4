#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>

#include "torsio/core/units.hpp"
#include "torsio/safety/monitor.hpp"

namespace torsio {
namespace {

/// Value and limit with as many digits as it takes for them to differ.
std::pair<std::string, std::string> apart(double value, double limit, int digits = 3) {
  constexpr int kMaxDigits = 9;
  std::pair<std::string, std::string> text;
  do {
    text = {fmt::format("{:.{}g}", value, digits), fmt::format("{:.{}g}", limit, digits)};
  } while (text.first == text.second && ++digits <= kMaxDigits);
  return text;
}

/// " rad" of a channel; empty for an expression, whose unit is not known.
std::string unit_after(std::string_view signal) {
  if (signal.find_first_of(" +-*/(),") != std::string_view::npos) return "";
  const std::string unit = unit_label(signal);
  return unit.empty() ? "" : " " + unit;
}

}  // namespace

std::string describe(const MonitorEvent& event, const MonitorSettings& settings) {
  const auto source = [&](std::uint8_t i) -> std::string {
    return i < settings.sources.size() ? settings.sources[i] : "?";
  };
  const auto signal = [&](std::uint8_t i) -> std::string {
    return i < settings.signals.size() ? settings.signals[i].name : "?";
  };
  const double value = event.value;
  const double limit = event.limit;
  const auto larger = apart(std::abs(value), limit);
  const auto range = apart(value, limit, 4);
  const std::string unit = unit_after(signal(event.first));
  switch (event.check) {
    case MonitorCheck::disagreement:
      return fmt::format("the torques of {} and {} differ by {} Nm, more than {} Nm",
                         source(event.first), source(event.second), larger.first, larger.second);
    case MonitorCheck::drift:
      return fmt::format(
          "a small difference between the torques of {} and {} lasts: difference over threshold "
          "less the allowance, summed over time, is {} s, limit {} s",
          source(event.first), source(event.second), larger.first, larger.second);
    case MonitorCheck::sign:
      return fmt::format("the torques of {} and {} have opposite signs and differ by {:.3g} Nm",
                         source(event.first), source(event.second), std::abs(value));
    case MonitorCheck::source_lost:
      return fmt::format("an input of the torque of {} has not been measured for {:.3g} s",
                         source(event.first), value);
    case MonitorCheck::source_fault:
      return fmt::format(
          "the torque of {} has been without a valid model or error bar for {:.3g} s, limit {:.3g} "
          "s",
          source(event.first), value, limit);
    case MonitorCheck::redundancy_lost:
      return fmt::format("{:.0f} valid {} left, at least {:.0f} are needed", value,
                         value == 1.0 ? "torque is" : "torques are", limit);
    case MonitorCheck::novelty:
      return fmt::format("the inputs of the torque of {} have a novelty of {:.3g}, limit {:.3g}",
                         source(event.first), value, limit);
    case MonitorCheck::not_finite:
      if (std::isfinite(value))
        return fmt::format("the monitor was given {:.0f} sources and signals, expected {:.0f}",
                           value, limit);
      return fmt::format("{} is not a finite number", signal(event.first));
    case MonitorCheck::stale:
      return fmt::format("{} is {:.3g} s old, limit {:.3g} s", signal(event.first), value, limit);
    case MonitorCheck::range:
      return fmt::format("{} is {}{unit}, beyond {}{unit}", signal(event.first), range.first,
                         range.second, fmt::arg("unit", unit));
    case MonitorCheck::rate:
      return fmt::format("{} changes by {}{unit} per second, limit {}{unit} per second",
                         signal(event.first), larger.first, larger.second, fmt::arg("unit", unit));
    case MonitorCheck::wrap:
      return fmt::format("{} changed by {:.4g}{}, a turn of its encoder", signal(event.first),
                         value, unit);
    case MonitorCheck::frozen:
      return fmt::format("{} did not change while {} moved by {:.3g}, limit {:.3g}",
                         signal(event.first), signal(event.second), value, limit);
    case MonitorCheck::period:
      return fmt::format("the loop was called after {:.3g} s, limit {:.3g} s", value, limit);
    case MonitorCheck::requested: return "a stop was requested";
  }
  return {};
}

std::string_view name(MonitorCheck check) noexcept {
  switch (check) {
    case MonitorCheck::disagreement: return "disagreement";
    case MonitorCheck::drift: return "drift";
    case MonitorCheck::sign: return "sign";
    case MonitorCheck::source_lost: return "source_lost";
    case MonitorCheck::source_fault: return "source_fault";
    case MonitorCheck::redundancy_lost: return "redundancy_lost";
    case MonitorCheck::novelty: return "novelty";
    case MonitorCheck::not_finite: return "not_finite";
    case MonitorCheck::stale: return "stale";
    case MonitorCheck::range: return "range";
    case MonitorCheck::rate: return "rate";
    case MonitorCheck::wrap: return "wrap";
    case MonitorCheck::frozen: return "frozen";
    case MonitorCheck::period: return "period";
    case MonitorCheck::requested: return "requested";
  }
  return "unknown";
}

std::string_view name(MonitorAction action) noexcept {
  switch (action) {
    case MonitorAction::off: return "off";
    case MonitorAction::warn: return "warn";
    case MonitorAction::stop: return "stop";
  }
  return "unknown";
}

std::string_view name(Monitor::State state) noexcept {
  switch (state) {
    case Monitor::State::unproven: return "unproven";
    case Monitor::State::ready: return "ready";
    case Monitor::State::watching: return "watching";
    case Monitor::State::stopped: return "stopped";
  }
  return "unknown";
}

}  // namespace torsio
