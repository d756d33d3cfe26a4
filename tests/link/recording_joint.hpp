#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "link/link_bytes.hpp"
#include "torsio/core/random.hpp"
#include "torsio/link/host_endpoint.hpp"
#include "torsio/link/joint_endpoint.hpp"

namespace torsio::test {

/// A joint that writes down what it is made to do.
class RecordingJoint : public LinkJoint {
 public:
  Identity identity() const noexcept override { return {"elbow", "0.2.0", "17", "dfki-50"}; }
  bool is_initialised() const noexcept override { return initialised; }
  bool is_at_rest() const noexcept override { return at_rest; }
  bool has_fault() const noexcept override { return fault; }
  LinkStateReason own_stop() const noexcept override { return stopped_by; }
  LinkRefusal enable() noexcept override {
    enables += 1;
    return enable_objection;
  }
  void disable() noexcept override { disables += 1; }
  void stop(StopCategory category) noexcept override { stops.push_back(category); }
  LinkRefusal apply(const JointReference& reference) noexcept override {
    if (reference.torque_Nm > 50.0) return LinkRefusal::out_of_range;
    references.push_back(reference);
    return LinkRefusal::none;
  }
  LinkRefusal change_mode(JointMode wanted) noexcept override {
    mode = wanted;
    return LinkRefusal::none;
  }
  std::span<const std::string_view> channels() const noexcept override { return names; }
  void measure(std::span<float> values) const noexcept override {
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = 0.5F + static_cast<float>(k);
  }
  LinkRefusal zero(std::uint8_t channel, double value) noexcept override {
    zeros[channel] = value;
    return LinkRefusal::none;
  }
  std::span<std::uint8_t> begin_upload(std::size_t size,
                                       std::string_view actuator) noexcept override {
    if (actuator != "dfki-50" || size > space.size()) return {};
    return space;
  }
  LinkRefusal commit_upload(std::span<const std::uint8_t> file) noexcept override {
    if (file[0] == 'X') return LinkRefusal::upload_rejected;
    model.assign(file.begin(), file.end());
    return LinkRefusal::none;
  }
  std::optional<LinkRefusal> poll_upload() noexcept override { return upload_result; }

  bool initialised = true;
  bool at_rest = true;
  bool fault = false;
  LinkStateReason stopped_by = LinkStateReason::none;
  std::optional<LinkRefusal> upload_result = LinkRefusal::none;
  LinkRefusal enable_objection = LinkRefusal::none;
  int enables = 0;
  int disables = 0;
  JointMode mode = JointMode::current;
  std::vector<StopCategory> stops = {};
  std::vector<JointReference> references = {};
  std::array<std::string_view, 3> names = {"angle_rad", "torque_Nm", "current_A"};
  std::map<int, double> zeros = {};
  std::array<std::uint8_t, 1000> space = {};
  std::string model = {};
};

/// Keeps the frames that are sent.
class StoredFrames : public LinkSink {
 public:
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    if (!takes) return false;
    bytes.insert(bytes.end(), frame.begin(), frame.end());
    return true;
  }
  LinkBytes take() { return std::exchange(bytes, {}); }

  bool takes = true;
  LinkBytes bytes = {};
};

/// A joint on a line without delay, and hosts at its other end.
class LinkedJoint {
 public:
  static constexpr std::uint64_t kStart_ns = 5'000'000'000;
  static constexpr std::uint64_t kTick_ns = 1'000'000;

  explicit LinkedJoint(JointEndpoint::Settings settings = {})
      : endpoint(settings, joint, table, sent) {
    tick();
  }

  void tick(std::uint64_t ticks = 1) {
    for (; ticks > 0; --ticks) endpoint.tick(now_ns += kTick_ns);
  }
  /// Sends a message, and returns the first reply of that type; none: its default.
  template <class Reply, class Message>
  std::optional<Reply> ask(HostEndpoint& host, const Message& message) {
    LinkBytes frame(kNdlcomMaxEncodedBytes);
    frame.resize(host.build(message, frame));
    return deliver<Reply>(host, frame);
  }
  template <class Reply>
  std::optional<Reply> deliver(HostEndpoint& host, const LinkBytes& frame) {
    endpoint.receive(frame, now_ns);
    return received<Reply>(host);
  }
  template <class Reply>
  std::optional<Reply> received(HostEndpoint& host) {
    std::optional<Reply> reply;
    host.receive(sent.take(), [&]<class Message>(const Message& message) {
      if constexpr (std::is_same_v<Message, Reply>)
        if (!reply) reply = message;
    });
    return reply;
  }
  void ping(HostEndpoint& host) {
    static_cast<void>(ask<LinkPong>(host, LinkPing{.token = ++token}));
  }
  /// With the clock of now. @returns what the joint replies: done, or why not; none without a reply
  template <class Message>
  std::optional<LinkRefusal> command(HostEndpoint& host, const Message& message) {
    ping(host);
    LinkBytes frame(kNdlcomMaxEncodedBytes);
    frame.resize(host.build(message, frame));
    endpoint.receive(frame, now_ns);
    std::optional<LinkRefusal> reply;
    host.receive(sent.take(), [&]<class Reply>(const Reply& received) {
      if constexpr (std::is_same_v<Reply, LinkDone>) reply = LinkRefusal::none;
      if constexpr (std::is_same_v<Reply, LinkRefused>) reply = received.reason;
    });
    return reply;
  }
  std::optional<LinkRefusal> change(HostEndpoint& host, LinkStateCommand wanted) {
    return command(host, LinkStateChange{.command = wanted});
  }
  LinkReference reference(float torque_Nm, std::uint64_t lasts_ns = 40'000'000) const {
    return {.deadline_ns = now_ns + lasts_ns, .mode = JointMode::torque, .torque_Nm = torque_Nm};
  }

  double gain = 2.0;
  std::array<LinkRegister, 2> registers = {
      variable_register({.name = "gain",
                         .unit = "1/s",
                         .access = LinkAccess::write,
                         .lowest = 0.0,
                         .highest = 9.0},
                        gain),
      variable_register({.name = "ratio", .access = LinkAccess::write_when_disabled}, ratio)};
  std::int32_t ratio = 100;
  RegisterTable table = RegisterTable(registers);
  RecordingJoint joint = {};
  StoredFrames sent = {};
  std::uint64_t now_ns = kStart_ns;
  std::uint32_t token = 0;
  JointEndpoint endpoint;
};

}  // namespace torsio::test
