#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "link/descriptor.hpp"
#include "torsio/link/joint_connection.hpp"

namespace torsio {

/// Requests and replies of a `JointConnection`, with what arrives in between.
class JointConnection::Exchange {
 public:
  Exchange(std::shared_ptr<LinkTransport> line, const std::string& place, const Settings& settings);
  ~Exchange() { release(); }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  /// Sends a request until `take(reply)`, which is called with each message of its type, returns true.
  /// @param what for messages: "write of gain"
  /// @throws Error for a refusal, or if there is no reply
  template <class Message, class Take>
  void ask(const Message& message, std::string_view what, const Take& take) {
    refusal_ = LinkRefusal::none;
    was_silent_ = false;
    for (int attempt = 0; attempt < settings_.tries; ++attempt) {
      if constexpr (Message::kIsCommand)
        if (!refresh()) continue;
      bool is_done = false;
      std::optional<LinkRefused> refused;
      transmit(message);
      const std::uint64_t sequence = Message::kIsCommand ? host_.sequence() : 0;
      wait_until(
          timeout_ns_, [&] { return is_done || refused.has_value(); },
          [&](const auto& reply) {
            using Reply = std::remove_cvref_t<decltype(reply)>;
            if constexpr (std::is_same_v<Reply, LinkRefused>) {
              if (reply.message == Message::kId && reply.sequence == sequence) refused = reply;
            } else if constexpr (std::is_invocable_r_v<bool, const Take&, const Reply&>) {
              is_done = is_done || take(reply);
            }
          });
      if (is_done) return;
      if (!refused) {
        was_silent_ = true;
        continue;
      }
      refusal_ = refused->reason;
      if (!depends_on_the_line(refusal_)) throw_refusal(what, *refused);
      wait_until(
          timeout_ns_ / 2, [] { return false; }, [](const auto&) {});
    }
    throw_silence(what, Message::kIsCommand);
  }
  /// `ask` for a command whose reply is `LinkDone`.
  template <class Message>
  void command(const Message& message, std::string_view what) {
    ask(message, what, [this](const LinkDone& done) {
      return done.message == Message::kId && done.sequence == host_.sequence();
    });
  }
  /// Without waiting for a reply.
  template <class Message>
  void transmit(const Message& message) {
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
    const std::size_t size = host_.build(message, frame);
    static_cast<void>(line_->send(std::span(frame).first(size)));
    // Also a command that is refused may have given control to this host.
    has_control_ = has_control_ || Message::kIsCommand;
  }

  void send(LinkReference reference, double valid_s);
  void heartbeat();
  void renew(const LinkSubscribe& subscription);
  std::size_t poll(const VisitTelemetry& visit, double wait_s);

  /// Receives until `is_done()` or for this time. @param visit is called with each message but telemetry
  template <class IsDone, class Visit>
  void wait_until(std::int64_t longest_ns, const IsDone& is_done, const Visit& visit) {
    const std::int64_t end_ns = detail::monotonic_ns() + longest_ns;
    receive(visit);
    for (std::int64_t left_ns = 0; !is_done() && (left_ns = end_ns - detail::monotonic_ns()) > 0;) {
      static_cast<void>(line_->wait(std::min(left_ns, ping_period_ns_)));
      receive(visit);
      keep_young();
    }
  }
  [[noreturn]] void throw_refusal(std::string_view what, const LinkRefused& refused) const;

  /// Whether the last request was refused after a try that got no reply.
  [[nodiscard]] bool was_refused_when_repeated() const noexcept {
    return was_silent_ && refusal_ != LinkRefusal::none;
  }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  void forget_change() noexcept { state_.reset(); }
  [[nodiscard]] const std::optional<LinkState>& last_change() const noexcept { return state_; }
  [[nodiscard]] const std::string& place() const noexcept { return place_; }

 private:
  template <class Visit>
  void receive(const Visit& visit) {
    std::array<std::uint8_t, 2048> buffer;
    for (std::size_t size = 0; (size = line_->receive(buffer)) > 0;)
      host_.receive(std::span(buffer).first(size), [&](const auto& message) {
        hear(message);
        visit(message);
      });
  }
  template <class Message>
  void hear(const Message& message) {
    using Heard = std::remove_cvref_t<Message>;
    has_heard_ = true;
    if constexpr (std::is_same_v<Heard, LinkTelemetry>) store(message);
    if constexpr (std::is_same_v<Heard, LinkState>) state_ = message;
    if constexpr (std::is_same_v<Heard, LinkRefused>) {
      if (message.message == LinkReference::kId)
        ++counts_.refused[static_cast<std::size_t>(message.reason)];
      // Also of a ping, without which no command is sent.
      if (message.reason == LinkRefusal::wrong_version ||
          message.reason == LinkRefusal::wrong_length)
        refusal_ = message.reason;
    }
    if constexpr (std::is_same_v<Heard, LinkPong> || std::is_same_v<Heard, LinkTelemetry>)
      heard_ns_ = detail::monotonic_ns();
  }
  void release() noexcept;
  void store(const LinkTelemetry& telemetry);
  [[nodiscard]] bool refresh();
  void keep_young();
  void ping();
  [[nodiscard]] static bool depends_on_the_line(LinkRefusal reason) noexcept;
  [[noreturn]] void throw_silence(std::string_view what, bool is_command) const;

  Settings settings_;
  std::shared_ptr<LinkTransport> line_;
  std::string place_;
  std::int64_t timeout_ns_;
  std::int64_t ping_period_ns_;
  HostEndpoint host_;
  bool was_silent_ = false;  ///< a try of the last request
  LinkRefusal refusal_ = LinkRefusal::none;
  bool has_heard_ = false;
  bool has_control_ = false;
  std::int64_t heard_ns_ = 0;  ///< when the clock of the joint was heard
  std::int64_t pinged_ns_ = 0;
  std::uint32_t token_ = 0;
  LinkSubscribe subscription_ = {};
  std::int64_t renewed_ns_ = 0;
  std::deque<LinkTelemetry> telemetry_ = {};
  std::uint32_t next_sequence_ = 0;  ///< the next one of the telemetry
  bool has_sequence_ = false;
  std::uint64_t latest_ns_ = 0;  ///< time of the telemetry, by the joint's clock
  Counts counts_ = {};
  std::optional<LinkState> state_ = {};
};

}  // namespace torsio
