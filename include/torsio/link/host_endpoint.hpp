#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "torsio/core/realtime.hpp"
#include "torsio/link/frame_counters.hpp"
#include "torsio/link/link_messages.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {

/// The host's side of the link to one joint: messages to frames, bytes to messages, the joint's clock as last heard and the
/// sequence of the commands. No heap, thread, file or clock of its own.
///
///     bytes = host.build(LinkPing{.token = 1}, out);                          // and send out[0, bytes)
///     host.receive(received, [](const auto& message) { ... });                // an overload per message
///     bytes = host.build(LinkStateChange{.command = LinkStateCommand::enable}, out);
///     bytes = host.build(LinkReference{.deadline_ns = host.clock_ns() + 20'000'000, ...}, out);
///
/// A command is accepted only while the clock that it carries is younger than the watchdog's time of the joint: subscribe to
/// telemetry, or ping, more often than that.
class HostEndpoint {
 public:
  struct Settings {
    std::uint8_t id = 254;   ///< 1 to 254, another one than those of the joints
    std::uint8_t joint = 1;  ///< 1 to 254
    NdlcomRules rules = NdlcomRules::strict;
  };
  struct Counts {
    std::uint64_t to_others = 0;  ///< frames of another joint or for another host
    std::uint64_t refused =
        0;  ///< payloads that are not a message to a host, or do not have its layout
  };

  /// @throws Error if an id is not possible, or both are the same.
  explicit HostEndpoint(const Settings& settings);

  /// Encodes a message as a frame for the joint. A command gets the next sequence, the joint's clock and a CRC-32.
  /// @returns the number of bytes in `out`; 0 if they do not fit: `kNdlcomMaxEncodedBytes` are sufficient
  template <class Message>
  [[nodiscard]] std::size_t build(Message message,
                                  std::span<std::uint8_t> out) noexcept TORSIO_REALTIME {
    if constexpr (Message::kIsCommand)
      message.seal = {.sequence = ++sequence_, .clock_ns = clock_ns_};
    if constexpr (std::is_same_v<Message, LinkPing>) token_ = message.token;
    const LinkRoute route{.receiver = settings_.joint, .sender = settings_.id};
    std::array<std::uint8_t, kNdlcomMaxPayloadBytes> payload;
    return frame_of(std::span(payload).first(encode_payload(message, route, payload)),
                    settings_.joint, out);
  }
  /// A stop for every joint of the line. @returns as `build`
  [[nodiscard]] std::size_t build_stop_of_all(std::uint8_t category,
                                              std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;

  /// Calls `visit(message)` for each message of the joint. Texts in it are valid during the call.
  template <class Visit>
  void receive(std::span<const std::uint8_t> bytes, Visit&& visit) {
    while (const auto frame = decoder_.next(bytes))
      if (is_for_this_host(*frame)) receive_payload(frame->payload, visit);
  }

  /// The latest time of the joint's clock that was heard; 0: none yet. A pong to the last ping sets it in any case, also back:
  /// the joint may have been started again.
  [[nodiscard]] std::uint64_t clock_ns() const noexcept { return clock_ns_; }
  /// The sequence of the last command.
  [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_; }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] const NdlcomDecoder::Counts& frames() const noexcept { return decoder_.counts(); }
  [[nodiscard]] const ReceivedFrames& received() const noexcept { return received_; }

 private:
  [[nodiscard]] std::size_t frame_of(std::span<const std::uint8_t> payload, std::uint8_t receiver,
                                     std::span<std::uint8_t> out) noexcept;
  [[nodiscard]] bool is_for_this_host(const NdlcomFrame& frame) noexcept;

  template <class Visit>
  void receive_payload(std::span<const std::uint8_t> payload, Visit& visit) {
    const bool is_known =
        !payload.empty() &&
        visit_type_to_host(payload[0], [&]<class Message>(std::type_identity<Message>) {
          Message message;
          if (decode_payload(payload, message) != LinkRefusal::none) {
            ++counts_.refused;
            return;
          }
          hear(message);
          visit(std::as_const(message));
        });
    if (!is_known) ++counts_.refused;
  }
  template <class Message>
  void hear(const Message& message) noexcept {
    if constexpr (requires { message.clock_ns; }) clock_ns_ = std::max(clock_ns_, message.clock_ns);
    if constexpr (requires { message.time_ns; }) clock_ns_ = std::max(clock_ns_, message.time_ns);
    if constexpr (std::is_same_v<Message, LinkPong>)
      if (message.token == token_) clock_ns_ = message.clock_ns;
  }

  Settings settings_;
  NdlcomDecoder decoder_;
  SentFrames sent_;
  ReceivedFrames received_;
  std::uint64_t clock_ns_ = 0;
  std::uint64_t sequence_ = 0;
  std::uint32_t token_ = 0;
  Counts counts_ = {};
};

}  // namespace torsio
