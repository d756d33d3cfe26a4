#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>

#include "torsio/control/joint_stop.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/link/command_guard.hpp"
#include "torsio/link/drive_state.hpp"
#include "torsio/link/frame_counters.hpp"
#include "torsio/link/line_budget.hpp"
#include "torsio/link/link_messages.hpp"
#include "torsio/link/ndlcom_frame.hpp"
#include "torsio/link/register_table.hpp"

namespace torsio {

/// Where encoded frames go: a transport, or a test. One call per frame.
class LinkSink {
 public:
  virtual ~LinkSink() = default;
  /// @returns false if the frame could not be sent, as when the other side does not read; it is then lost, and counted
  virtual bool send(std::span<const std::uint8_t> frame) noexcept = 0;
};

/// What a joint has to provide. Each function is called by the thread of the endpoint, between two ticks of the joint, and
/// only for what the guard has accepted. None may use the heap, lock or wait if the loop of the joint is real-time.
class LinkJoint {
 public:
  struct Identity {
    std::string_view name = {};
    std::string_view version = {};
    std::string_view serial = {};
    std::string_view actuator = {};
  };
  virtual ~LinkJoint() = default;

  [[nodiscard]] virtual Identity identity() const noexcept = 0;
  [[nodiscard]] virtual bool is_initialised() const noexcept = 0;
  [[nodiscard]] virtual bool is_at_rest() const noexcept = 0;
  [[nodiscard]] virtual bool has_fault() const noexcept = 0;
  /// Why an enabled joint stops without a message to it, as after the stop of another joint of its arm; `none`: it does not.
  [[nodiscard]] virtual LinkStateReason own_stop() const noexcept { return LinkStateReason::none; }

  /// From now on current may flow; until the first reference the joint holds its present position. @returns `none` or why not
  virtual LinkRefusal enable() noexcept = 0;
  /// From now on no current flows, and the brake closes.
  virtual void disable() noexcept = 0;
  /// Is called again for a lower category.
  virtual void stop(StopCategory category) noexcept = 0;
  /// Every number is finite. @returns `none`, or why the reference is refused as a whole
  virtual LinkRefusal apply(const JointReference& reference) noexcept = 0;
  virtual LinkRefusal change_mode(JointMode mode) noexcept = 0;

  /// Names of the telemetry's channels, at most `kLinkChannels`, constant.
  [[nodiscard]] virtual std::span<const std::string_view> channels() const noexcept = 0;
  /// Their values in the present tick, in the same order.
  virtual void measure(std::span<float> values) const noexcept = 0;

  virtual LinkRefusal zero(std::uint8_t /*channel*/, double /*value*/) noexcept {
    return LinkRefusal::not_supported;
  }
  virtual LinkRefusal inject_fault(const LinkInjectFault& /*fault*/) noexcept {
    return LinkRefusal::not_supported;
  }

  /// @returns space for a file of that size, for an actuator of that type; empty: `upload_rejected`
  virtual std::span<std::uint8_t> begin_upload(std::size_t /*size*/,
                                               std::string_view /*actuator*/) noexcept {
    return {};
  }
  /// Every byte is in the space, and its CRC-32 is right. @returns `none`: the result is that of `poll_upload`
  virtual LinkRefusal commit_upload(std::span<const std::uint8_t> /*file*/) noexcept {
    return LinkRefusal::not_supported;
  }
  /// Is called after a commit, then in every tick, until there is a result. @returns nothing while the joint checks the file;
  /// `none`: the joint uses it from now on; else why not
  virtual std::optional<LinkRefusal> poll_upload() noexcept { return LinkRefusal::none; }
};

/// The joint's side of the link: bytes in, calls of a `LinkJoint`, frames out. No heap, thread, file or clock of its own; the
/// transports are in `link_transport.hpp`.
///
/// A request is replied to. A command is executed if the `CommandGuard` accepts it, and what the controlling host, or one
/// that would be it, is refused is replied to with the reason. All else that arrives is counted, and nothing is sent.
class JointEndpoint {
 public:
  struct Settings {
    std::uint8_t id = 1;       ///< 1 to 254
    double watchdog_s = 0.05;  ///< 1 ms to 10 s
    double tick_rate_Hz = 1000.0;
    /// The stop after the loss of the host, a release and a clock that runs backwards.
    StopCategory lost_category = StopCategory::ramp_and_brake;
    NdlcomRules rules = NdlcomRules::strict;
    double line_B_s =
        std::numeric_limits<double>::infinity();  ///< bytes per second that the line carries
    /// Id of a host that commands by `execute_for_bus`, and that no frame may have as its sender; 0: there is none.
    std::uint8_t bus_host = 0;
  };
  struct Counts {
    std::uint64_t to_others = 0;       ///< frames for another receiver
    std::uint64_t without_sender = 0;  ///< from id 0, 255, the joint's own or the `bus_host`
    std::uint64_t broadcasts = 0;      ///< that are not a stop
    std::uint64_t unknown = 0;         ///< messages without a known id, or that only hosts receive
    std::uint64_t executed = 0;        ///< commands, references included
    std::uint64_t stops = 0;           ///< messages that request one
    std::uint64_t not_sent = 0;        ///< frames that the sink did not take
    std::array<std::uint64_t, kLinkRefusals> refused = {};  ///< by reason, replied to or not

    [[nodiscard]] std::uint64_t all_refused() const noexcept {
      return std::accumulate(refused.begin(), refused.end(), std::uint64_t{0});
    }
  };
  static constexpr std::size_t kSubscribers = 4;
  static constexpr double kLongestLifetime_s = 60.0;

  /// @param joint, registers and sink outlive the endpoint
  /// @throws Error if the id, a time or a rate is out of its range, or there are too many channels.
  JointEndpoint(const Settings& settings, LinkJoint& joint, const RegisterTable& registers,
                LinkSink& sink);

  /// Bytes from the line; frames may be split or joined.
  /// @param now_ns clock of the joint: monotonic, and as `CommandGuard` requires
  void receive(std::span<const std::uint8_t> bytes, std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// A frame of a line that several joints share, decoded once for all of them.
  void receive(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept TORSIO_REALTIME {
    take(frame, now_ns);
  }
  /// Once per tick of the joint, after its measurements: watchdog, faults, telemetry.
  void tick(std::uint64_t now_ns) noexcept TORSIO_REALTIME;

  // A line whose frames are not those of NDLCom, as a CAN bus: what it receives becomes these commands of the `bus_host`. Guard,
  // states, limits and counters are those of every other host; nothing is sent to it. A frame without clock and sequence is as
  // old as its arrival, and is executed once.

  /// @param arrived_ns when the frame arrived, by the clock of the joint: a command that has waited is too old after T
  /// @returns `none`, or why it was not executed: `count_refused`
  [[nodiscard]] LinkRefusal execute_for_bus(const LinkStateChange& message,
                                            std::uint64_t arrived_ns,
                                            std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  [[nodiscard]] LinkRefusal execute_for_bus(const LinkReference& message, std::uint64_t arrived_ns,
                                            std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  [[nodiscard]] LinkRefusal execute_for_bus(const LinkModeChange& message, std::uint64_t arrived_ns,
                                            std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  [[nodiscard]] LinkRefusal execute_for_bus(const LinkRegisterWrite& message,
                                            std::uint64_t arrived_ns,
                                            std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// A stop needs no control.
  void stop_for_bus(StopCategory category, std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// A message of that line that was not executed.
  void count_refused(LinkRefusal reason) noexcept TORSIO_REALTIME {
    counts_.refused[static_cast<std::size_t>(reason)] += reason == LinkRefusal::none ? 0U : 1U;
  }
  [[nodiscard]] std::uint8_t bus_host() const noexcept { return settings_.bus_host; }

  [[nodiscard]] const DriveState& drive() const noexcept { return drive_; }
  [[nodiscard]] const CommandGuard& guard() const noexcept { return guard_; }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] const NdlcomDecoder::Counts& frames() const noexcept { return decoder_.counts(); }
  [[nodiscard]] const ReceivedFrames& received() const noexcept { return received_; }

 private:
  struct Subscriber {
    std::uint8_t host = 0;  ///< 0: not in use
    std::uint32_t mask = 0;
    std::uint32_t period_ticks = 1;
    std::uint32_t left_ticks = 0;
    std::uint32_t sequence = 0;
    std::uint64_t until_ns = 0;
    double line_B_s = 0.0;
  };
  struct Upload {
    LinkUploadState state = LinkUploadState::idle;
    std::span<std::uint8_t> space = {};
    std::uint32_t received = 0;
    std::uint32_t crc = 0;           ///< that was announced
    std::uint32_t received_crc = 0;  ///< CRC-32 of what has been received
    std::uint8_t host = 0;           ///< that has committed it
    bool is_checked = false;         ///< the joint checks it: `poll_upload`
  };
  /// A message that is being executed.
  struct Context {
    LinkRoute route = {};
    std::uint64_t now_ns = 0;
    bool has_replied = false;
  };

  void take(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept;
  template <class Message>
  void take_message(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept;
  template <class Message>
  LinkRefusal guarded(const Message& message, Context& context) noexcept;
  template <class Message>
  LinkRefusal guarded_for_bus(Message message, std::uint64_t arrived_ns,
                              std::uint64_t now_ns) noexcept;
  template <class Message>
  void finish(const Message& message, const Context& context, LinkRefusal refusal) noexcept;
  void refuse_to(std::uint8_t host, std::uint8_t message, std::uint64_t sequence,
                 LinkRefusal reason, double lowest = 0.0, double highest = 0.0) noexcept;
  template <class Message>
  void send(std::uint8_t host, const Message& message) noexcept {
    std::array<std::uint8_t, kNdlcomMaxPayloadBytes> payload;
    const LinkRoute route{.receiver = host, .sender = settings_.id};
    send_payload(host, std::span(payload).first(encode_payload(message, route, payload)));
  }
  void send_payload(std::uint8_t host, std::span<const std::uint8_t> payload) noexcept;
  void send_state(std::uint8_t host, std::uint64_t now_ns) noexcept;
  void stop(LinkStateReason reason, StopCategory category, std::uint64_t now_ns) noexcept;
  [[nodiscard]] bool may_control(std::uint8_t host) const noexcept;

  LinkRefusal execute(const LinkPing& message, Context& context) noexcept;
  LinkRefusal execute(const LinkInformationRequest& message, Context& context) noexcept;
  LinkRefusal execute(const LinkRegisterRead& message, Context& context) noexcept;
  LinkRefusal execute(const LinkRegisterDescribe& message, Context& context) noexcept;
  LinkRefusal execute(const LinkRegisterWrite& message, Context& context) noexcept;
  LinkRefusal execute(const LinkStateChange& message, Context& context) noexcept;
  LinkRefusal execute(const LinkReference& message, Context& context) noexcept;
  LinkRefusal execute(const LinkModeChange& message, Context& context) noexcept;
  LinkRefusal execute(const LinkStop& message, Context& context) noexcept;
  LinkRefusal execute(const LinkSubscribe& message, Context& context) noexcept;
  LinkRefusal execute(const LinkChannelDescribe& message, Context& context) noexcept;
  LinkRefusal execute(const LinkUploadBegin& message, Context& context) noexcept;
  LinkRefusal execute(const LinkUploadChunk& message, Context& context) noexcept;
  LinkRefusal execute(const LinkUploadCommit& message, Context& context) noexcept;
  LinkRefusal execute(const LinkUploadAbort& message, Context& context) noexcept;
  LinkRefusal execute(const LinkZero& message, Context& context) noexcept;
  LinkRefusal execute(const LinkInjectFault& message, Context& context) noexcept;
  LinkRefusal reply_upload(Context& context, LinkRefusal refusal) noexcept;
  LinkRefusal subscribe(const LinkSubscribe& message, Context& context,
                        LinkSubscription& reply) noexcept;
  void end_upload(LinkRefusal result) noexcept;
  void poll_upload() noexcept;
  void send_telemetry(std::uint64_t now_ns) noexcept;

  Settings settings_;
  LinkJoint& joint_;
  const RegisterTable& registers_;
  LinkSink& sink_;
  NdlcomDecoder decoder_;
  SentFrames sent_;
  ReceivedFrames received_;
  CommandGuard guard_;
  DriveState drive_;
  LineBudget line_;
  std::array<Subscriber, kSubscribers> subscribers_ = {};
  Upload upload_ = {};
  std::uint8_t last_host_ = 0;  ///< the last that was in control
  std::uint64_t last_tick_ns_ = 0;
  std::uint64_t bus_sequence_ = 0;
  Counts counts_ = {};
};

}  // namespace torsio
