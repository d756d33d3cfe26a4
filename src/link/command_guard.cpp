#include "torsio/link/command_guard.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/checks.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {
namespace {

constexpr double kShortestWatchdog_s = 1e-3;
constexpr double kLongestWatchdog_s = 10.0;
constexpr std::size_t kChecksumBytes = 4;

}  // namespace

std::uint32_t command_checksum(LinkRoute route, std::span<const std::uint8_t> before) noexcept {
  const std::array<std::uint8_t, 3> header{
      route.receiver, route.sender, static_cast<std::uint8_t>(before.size() + kChecksumBytes)};
  const uLong crc = crc32_z(0, header.data(), header.size());
  return static_cast<std::uint32_t>(crc32_z(crc, before.data(), before.size()));
}

bool is_intact_command(LinkRoute route, std::span<const std::uint8_t> payload) noexcept {
  if (payload.size() < kCommandBytes) return false;
  const auto before = payload.first(payload.size() - kChecksumBytes);
  std::uint32_t checksum = 0;
  std::memcpy(&checksum, before.data() + before.size(), sizeof(checksum));
  return checksum == command_checksum(route, before);
}

CommandGuard::CommandGuard(const Settings& settings) {
  require(settings.watchdog_s >= kShortestWatchdog_s && settings.watchdog_s <= kLongestWatchdog_s,
          "command guard: watchdog_s",
          fmt::format("{} to {}", kShortestWatchdog_s, kLongestWatchdog_s), settings.watchdog_s);
  watchdog_ns_ = static_cast<std::uint64_t>(std::llround(settings.watchdog_s * 1e9));
}

CommandGuard::Refusal CommandGuard::refusal_of(const Command& command,
                                               std::uint64_t now_ns) const noexcept {
  if (!command.is_intact) return Refusal::checksum;
  if (command.route.receiver == kNdlcomBroadcast) return Refusal::broadcast;
  if (command.clock_ns > now_ns) return Refusal::from_future;
  if (now_ns - command.clock_ns >= watchdog_ns_) return Refusal::too_old;
  if (host_ != kNdlcomReserved && host_ != command.route.sender) return Refusal::other_host;
  if (host_ == kNdlcomReserved && command.clock_ns < ended_ns_) return Refusal::too_old;
  if (command.sequence <= last_sequence_) return Refusal::repeated;
  if (command.deadline_ns <= now_ns) return Refusal::deadline;
  return Refusal::none;
}

CommandGuard::Refusal CommandGuard::accept(const Command& command, std::uint64_t now_ns) noexcept {
  const Refusal refusal = refusal_of(command, now_ns);
  if (refusal != Refusal::none) {
    ++refused_[static_cast<std::size_t>(refusal)];
    return refusal;
  }
  ++accepted_;
  host_ = command.route.sender;
  last_sequence_ = command.sequence;
  // A host may have heard nothing new since its last command.
  control_until_ns_ = std::max(control_until_ns_, command.clock_ns + watchdog_ns_);
  return Refusal::none;
}

// The deadline of the last reference holds, also where it is shorter than that of the one before.
void CommandGuard::extend(const Command& command) noexcept {
  motion_until_ns_ = std::min(command.clock_ns + watchdog_ns_, command.deadline_ns);
}

bool CommandGuard::step(std::uint64_t now_ns) noexcept {
  const bool is_backwards = now_ns < last_now_ns_;
  last_now_ns_ = now_ns;
  const bool has_lost_motion = is_watching_ && (is_backwards || now_ns >= motion_until_ns_);
  if (has_lost_motion) is_watching_ = false;
  if (host_ != kNdlcomReserved && (is_backwards || now_ns >= control_until_ns_)) release(now_ns);
  return has_lost_motion;
}

void CommandGuard::release(std::uint64_t now_ns) noexcept {
  host_ = kNdlcomReserved;
  last_sequence_ = 0;
  control_until_ns_ = 0;
  motion_until_ns_ = 0;
  ended_ns_ = now_ns;
}

std::string_view name(CommandGuard::Refusal refusal) noexcept {
  constexpr std::array<std::string_view, CommandGuard::kRefusals> kNames{
      "none",    "checksum",   "broadcast", "from_future",
      "too_old", "other_host", "repeated",  "deadline"};
  return kNames[static_cast<std::size_t>(refusal)];
}

}  // namespace torsio
