#include "torsio/safety/command_watchdog.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"
#include "torsio/core/time_distance.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 3600.0;

std::int64_t checked_ns(double timeout_s) {
  require(timeout_s > 0.0 && timeout_s <= kLongest_s, "command watchdog: timeout_s",
          fmt::format("above 0, at most {}", kLongest_s), timeout_s);
  return std::llround(timeout_s * 1e9);
}

std::int64_t checked_ahead_ns(double longest_ahead_s) {
  require(longest_ahead_s >= 0.0 && longest_ahead_s <= kLongest_s,
          "command watchdog: longest_ahead_s", fmt::format("0 to {}", kLongest_s), longest_ahead_s);
  return std::llround(longest_ahead_s * 1e9);
}

double checked_s(double longest_fault_s) {
  require(longest_fault_s > 0.0, "command watchdog: longest_fault_s", "above 0", longest_fault_s);
  return longest_fault_s;
}

}  // namespace

CommandWatchdog::CommandWatchdog(const Settings& settings)
    : timeout_ns_(checked_ns(settings.timeout_s)),
      longest_ahead_ns_(checked_ahead_ns(settings.longest_ahead_s)),
      longest_fault_s_(checked_s(settings.longest_fault_s)) {}

void CommandWatchdog::arm(std::int64_t now_ns) noexcept {
  if (state_ == State::running) return;
  state_ = State::waiting;
  armed_ns_ = now_ns;
  last_ns_ = now_ns;
}

void CommandWatchdog::stop() noexcept { stop_because(Reason::requested); }

void CommandWatchdog::stop_because(Reason reason) noexcept {
  if (state_ == State::stopped || state_ == State::disarmed) return;
  state_ = State::stopped;
  reason_ = reason;
}

CommandWatchdog::State CommandWatchdog::step(std::int64_t now_ns, const Command& command,
                                             Fault fault) noexcept {
  if (now_ns < last_ns_) stop_because(Reason::clock);
  last_ns_ = now_ns;
  const std::int64_t distance_ns = detail::distance_ns(now_ns, command.written_ns);
  const bool is_fresh =
      command.is_valid &&
      (command.written_ns > now_ns ? distance_ns <= longest_ahead_ns_ : distance_ns < timeout_ns_);
  // One from the future would remain valid for too long.
  const std::int64_t written_ns = std::min(command.written_ns, now_ns);
  if (state_ == State::waiting && is_fresh && command.written_ns > armed_ns_) {
    state_ = State::running;
    reason_ = Reason::none;
    fed_ns_ = written_ns;
    fault = Fault::none;  // faults before the start do not count
  } else if (state_ == State::running && is_fresh) {
    fed_ns_ = std::max(fed_ns_, written_ns);
  }
  if (state_ == State::running) run(now_ns, fault);
  return state_;
}

void CommandWatchdog::run(std::int64_t now_ns, Fault fault) noexcept {
  if (fault == Fault::none) well_ns_ = now_ns;
  if (now_ns - fed_ns_ >= timeout_ns_)
    stop_because(Reason::command_lost);
  else if (1e-9 * static_cast<double>(now_ns - well_ns_) >= longest_fault_s_)
    stop_because(Reason::fault);
}

std::string_view name(CommandWatchdog::State state) noexcept {
  switch (state) {
    case CommandWatchdog::State::disarmed: return "disarmed";
    case CommandWatchdog::State::waiting: return "waiting";
    case CommandWatchdog::State::running: return "running";
    case CommandWatchdog::State::stopped: break;
  }
  return "stopped";
}

std::string_view name(CommandWatchdog::Reason reason) noexcept {
  switch (reason) {
    case CommandWatchdog::Reason::none: return "none";
    case CommandWatchdog::Reason::command_lost: return "command_lost";
    case CommandWatchdog::Reason::fault: return "fault";
    case CommandWatchdog::Reason::clock: return "clock";
    case CommandWatchdog::Reason::requested: break;
  }
  return "requested";
}

}  // namespace torsio
