#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Decides whether a loop may drive its joint with the commands that it receives.
///
///     disarmed  --arm-->  waiting  --a command written since-->  running
///     running   --no command, a fault, the clock, stop-->  stopped  --arm-->  waiting
///
/// Only a valid motion command feeds it, with the time at which its source wrote it: no rejected
/// command, and no other traffic. A stop is latched: no command ends it, only `arm` followed by a
/// command that was written after that. In every state but `running` the motor gets no current,
/// which takes no energy into the joint: reset the controllers and command 0.
///
/// All times are of one monotonic clock (`MonotonicClock`, `Tick::due_ns`); one that runs backwards
/// stops the loop. Form: ours.
class CommandWatchdog {
 public:
  struct Settings {
    /// How long a command is valid. At 1 kHz, a late tick included, it expires within 20 ms.
    double timeout_s = 0.018;
    /// By how much its time may be ahead of the clock of the loop: two periods at 1 kHz, for a
    /// command that is written while a tick begins. One that is further ahead is refused, and none
    /// counts for longer than `timeout_s` from now.
    double longest_ahead_s = 0.002;
    /// How long the loop may continue with a fault, such as that of an inverse.
    double longest_fault_s = std::numeric_limits<double>::infinity();
  };
  /// The latest command, as in `Mailbox::Letter`.
  struct Command {
    std::int64_t written_ns = 0;
    bool is_valid = false;  ///< there is one, and it was accepted
  };
  enum class State : std::uint8_t { disarmed, waiting, running, stopped };
  /// The reason of the last stop.
  enum class Reason : std::uint8_t { none, command_lost, fault, clock, requested };

  /// @throws Error if a time is not positive, or `longest_ahead_s` negative.
  explicit CommandWatchdog(const Settings& settings);

  /// The operator confirms that the joint may move. Without effect while it is running.
  void arm(std::int64_t now_ns) noexcept TORSIO_REALTIME;
  void stop() noexcept TORSIO_REALTIME;

  /// Call in every tick, before the controllers.
  /// @param fault in the loop's last output
  State step(std::int64_t now_ns, const Command& command,
             Fault fault = Fault::none) noexcept TORSIO_REALTIME;

  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] Reason reason() const noexcept { return reason_; }

 private:
  void stop_because(Reason reason) noexcept;
  void run(std::int64_t now_ns, Fault fault) noexcept;

  std::int64_t timeout_ns_;
  std::int64_t longest_ahead_ns_;
  double longest_fault_s_;
  State state_ = State::disarmed;
  Reason reason_ = Reason::none;
  std::int64_t armed_ns_ = 0;
  std::int64_t fed_ns_ = 0;   ///< when the last valid command was written
  std::int64_t well_ns_ = 0;  ///< time of the last tick without a fault
  std::int64_t last_ns_ = std::numeric_limits<std::int64_t>::min();
};

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(CommandWatchdog::State state) noexcept;
[[nodiscard]] std::string_view name(CommandWatchdog::Reason reason) noexcept;

}  // namespace torsio
