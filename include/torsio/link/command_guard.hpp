#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// Who sends a payload to whom: the header of its frame.
struct LinkRoute {
  std::uint8_t receiver = 0;
  std::uint8_t sender = 0;

  bool operator==(const LinkRoute&) const = default;
};

/// CRC-32 (that of zlib and Ethernet: 0xEDB88320 reflected, start and final inversion 0xFFFFFFFF) over receiver, sender,
/// number of bytes of the whole payload with its four bytes of CRC, and `before`, the payload in front of the CRC. In
/// addition to the CRC-16 of the frame, of which one damaged frame in 65536 has the right one.
[[nodiscard]] std::uint32_t command_checksum(
    LinkRoute route, std::span<const std::uint8_t> before) noexcept TORSIO_REALTIME;

/// What every command carries against repetition and delay.
struct CommandSeal {
  std::uint64_t sequence = 0;  ///< from 1 on, rising with each command of a host
  std::uint64_t clock_ns = 0;  ///< the joint's clock as the host last heard it
};

/// Bytes of a command without fields: id, version, seal and CRC-32.
inline constexpr std::size_t kCommandBytes = 2 + 16 + 4;

/// Whether a payload is long enough for a command, and its last four bytes are the `command_checksum` of the others.
[[nodiscard]] bool is_intact_command(
    LinkRoute route, std::span<const std::uint8_t> payload) noexcept TORSIO_REALTIME;

/// Decides which commands a joint executes: each once, in order, young, and from one host.
///
///     accepted if   checksum, own address, t_heard <= now < t_heard + T, t_heard >= end of the last control,
///                   sequence > last accepted, host = controlling host or there is none, now < deadline
///
/// with t_heard the joint's clock as the host last heard it, which the command carries, and T the time of the watchdog.
/// Hosts need no clock of their own: what a command is late by the clock of the joint contains the way in both
/// directions. A host takes control with its first accepted command. It loses control by `release`, or when its youngest
/// t_heard is T ago.
///
/// The joint's clock must be monotonic and must not repeat after a restart of the joint: use the machine's (`MonotonicClock`),
/// or let it begin at a random number of more than 40 bits. Else a command from before the restart could be young again.
///
/// None of this is authentication: whoever can send a frame can build one that is accepted.
class CommandGuard {
 public:
  struct Settings {
    double watchdog_s = 0.05;  ///< T: 1 ms to 10 s
  };
  /// Why a command is not executed. All but `none` are counted.
  enum class Refusal : std::uint8_t {
    none,
    checksum,     ///< the CRC-32 is wrong
    broadcast,    ///< to every joint, which only a stop may be
    from_future,  ///< it carries a time that the joint's clock has not reached
    too_old,      ///< older than the watchdog's time, or than the end of the last control
    other_host,   ///< another host is in control
    repeated,     ///< the sequence is not above that of the last accepted command
    deadline,     ///< it arrived after its own deadline
  };
  static constexpr std::size_t kRefusals = 8;

  struct Command {
    LinkRoute route = {};
    std::uint64_t sequence = 0;  ///< from 1 on
    std::uint64_t clock_ns = 0;  ///< t_heard
    bool is_intact = false;      ///< its checksum is that of `command_checksum`
    std::uint64_t deadline_ns =
        std::numeric_limits<std::uint64_t>::max();  ///< by the joint's clock
  };

  /// @throws Error if the watchdog's time is out of its range.
  explicit CommandGuard(const Settings& settings);

  /// @returns `none`: execute it now
  [[nodiscard]] Refusal accept(const Command& command,
                               std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  /// The accepted command was a valid reference, an enable or a heartbeat: the joint may move until `clock_ns` + T, or until
  /// the command's deadline. No other command feeds the watchdog.
  void extend(const Command& command) noexcept TORSIO_REALTIME;

  /// Call before commands of this time are accepted. Ends the control of a host that is silent. @returns whether the
  /// motion commands have run out since the last call, or the clock has run backwards: stop.
  [[nodiscard]] bool step(std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  /// The joint moves from now on, or no longer: only then does silence mean a stop.
  void watch(bool is_moving) noexcept TORSIO_REALTIME { is_watching_ = is_moving; }
  /// The controlling host gives up control, or is deprived of it.
  void release(std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  /// 0: none
  [[nodiscard]] std::uint8_t controlling_host() const noexcept { return host_; }
  [[nodiscard]] std::uint64_t refused(Refusal refusal) const noexcept {
    return refused_[static_cast<std::size_t>(refusal)];
  }
  [[nodiscard]] std::uint64_t accepted() const noexcept { return accepted_; }
  /// Until when the last motion command lets the joint move [ns of its clock].
  [[nodiscard]] std::uint64_t valid_until_ns() const noexcept { return motion_until_ns_; }
  [[nodiscard]] std::uint64_t watchdog_ns() const noexcept { return watchdog_ns_; }

 private:
  [[nodiscard]] Refusal refusal_of(const Command& command, std::uint64_t now_ns) const noexcept;

  std::uint64_t watchdog_ns_;
  std::uint8_t host_ = 0;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t control_until_ns_ = 0;
  std::uint64_t motion_until_ns_ = 0;
  std::uint64_t ended_ns_ = 0;  ///< the last control
  std::uint64_t last_now_ns_ = 0;
  bool is_watching_ = false;
  std::uint64_t accepted_ = 0;
  std::array<std::uint64_t, kRefusals> refused_ = {};
};

/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(CommandGuard::Refusal refusal) noexcept;

}  // namespace torsio
