#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/joints/linked_joint.hpp"
#include "torsio/link/host_endpoint.hpp"
#include "torsio/sim/joints/joint_server.hpp"
#include "torsio/sim/joints/single_joint.hpp"

namespace torsio::test {

/// A line in memory, without delay. Uses no heap once its buffers have their size.
class MemoryLine : public LinkTransport {
 public:
  MemoryLine() {
    to_joints.reserve(1U << 20U);
    to_hosts.reserve(1U << 20U);
  }
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    const std::size_t size = std::min(out.size(), to_joints.size() - taken_);
    std::copy_n(to_joints.begin() + static_cast<std::ptrdiff_t>(taken_), size, out.begin());
    taken_ += size;
    if (taken_ == to_joints.size()) {
      to_joints.clear();
      taken_ = 0;
    }
    return size;
  }
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    if (!is_read || to_hosts.size() + frame.size() > to_hosts.capacity()) {
      ++count().not_sent;
      return false;
    }
    to_hosts.insert(to_hosts.end(), frame.begin(), frame.end());
    return true;
  }
  int descriptor() const noexcept override { return -1; }
  std::string place() const override { return "memory"; }

  std::vector<std::uint8_t> to_joints = {};
  std::vector<std::uint8_t> to_hosts = {};
  bool is_read = true;  ///< by the hosts

 private:
  std::size_t taken_ = 0;
};

/// A host's view of one joint.
struct HostedJoint {
  HostEndpoint host;
  std::array<float, kJointChannels> values = {};
  std::optional<LinkRefusal> reply = {};  ///< `none`: done
  std::optional<LinkState> state = {};
  std::optional<LinkUpload> upload = {};
  std::optional<LinkValue> value = {};

  explicit HostedJoint(std::uint8_t id, std::uint8_t host_id)
      : host({.id = host_id, .joint = id}) {}

  void receive(std::span<const std::uint8_t> bytes) {
    host.receive(bytes, [this]<class Message>(const Message& message) {
      if constexpr (std::is_same_v<Message, LinkDone>) reply = LinkRefusal::none;
      if constexpr (std::is_same_v<Message, LinkRefused>) reply = message.reason;
      if constexpr (std::is_same_v<Message, LinkState>) state = message;
      if constexpr (std::is_same_v<Message, LinkUpload>) {
        upload = message;
        reply = message.refusal;
      }
      if constexpr (std::is_same_v<Message, LinkRegisterValue>) value = message.value;
      if constexpr (std::is_same_v<Message, LinkTelemetry>)
        if (message.values.count == kJointChannels)
          std::copy_n(message.values.values.begin(), kJointChannels, values.begin());
    });
  }
  [[nodiscard]] double operator[](JointChannel channel) const {
    return double{values[static_cast<std::size_t>(channel)]};
  }
};

/// Simulated joints, and a host that drives them in the same thread.
class HostedJoints {
 public:
  static constexpr std::uint64_t kTick_ns = 1'000'000;
  static constexpr std::uint8_t kHost = 254;

  explicit HostedJoints(std::vector<ServedArm> arms, const JointServer::Settings& settings = {})
      : server(std::move(arms), settings, line) {
    for (const JointServer::JointStatus& joint : server.joints())
      joints.emplace_back(joint.id, kHost);
    tick(100);
    for (HostedJoint& joint : joints) subscribe(joint);
    tick(2);
  }
  static std::vector<ServedArm> single(const std::string& actuator) {
    std::vector<ServedArm> arms;
    arms.push_back({.setup = single_joint_setup(data_sheet(actuator))});
    return arms;
  }

  template <class Message>
  void send(HostedJoint& joint, const Message& message) {
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
    const std::size_t size = joint.host.build(message, frame);
    line.to_joints.insert(line.to_joints.end(), frame.begin(),
                          frame.begin() + static_cast<std::ptrdiff_t>(size));
  }
  void subscribe(HostedJoint& joint) {
    send(joint, LinkSubscribe{
                    .mask = (1U << kJointChannels) - 1U, .rate_Hz = 1000.0F, .lifetime_s = 60.0F});
  }
  void tick(int ticks = 1) {
    for (; ticks > 0; --ticks) {
      server.cycle(now_ns += kTick_ns);
      for (HostedJoint& joint : joints) joint.receive(line.to_hosts);
      line.to_hosts.clear();
    }
  }
  /// @returns what the joint replies: done, or why not; none without a reply
  template <class Message>
  std::optional<LinkRefusal> command(HostedJoint& joint, const Message& message) {
    joint.reply.reset();
    send(joint, message);
    tick();
    return joint.reply;
  }
  std::optional<LinkRefusal> change(HostedJoint& joint, LinkStateCommand wanted) {
    return command(joint, LinkStateChange{.command = wanted});
  }
  /// Heartbeats to all joints.
  void hold(int ticks) {
    for (; ticks > 0; --ticks) {
      for (HostedJoint& joint : joints)
        send(joint, LinkStateChange{.command = LinkStateCommand::heartbeat});
      tick();
    }
  }
  /// Enables all, and waits until the brakes are open. @returns whether they are
  bool start() {
    for (HostedJoint& joint : joints)
      if (change(joint, LinkStateCommand::enable) != LinkRefusal::none) return false;
    for (int n = 0; n < 2000 && joints[0][JointChannel::is_ready] == 0.0; ++n) hold(1);
    return joints[0][JointChannel::is_ready] == 1.0;
  }
  /// The reference for the next 40 ms.
  void follow(HostedJoint& joint, LinkReference reference) {
    reference.deadline_ns = now_ns + 40 * kTick_ns;
    send(joint, reference);
  }
  /// The same reference for some ticks.
  void follow(HostedJoint& joint, const LinkReference& reference, int ticks) {
    for (; ticks > 0; --ticks) {
      follow(joint, reference);
      tick();
    }
  }
  LinkDriveState state(std::size_t joint = 0) const { return server.joints()[joint].state; }

  MemoryLine line;
  JointServer server;
  std::uint64_t now_ns = 1'000'000'000'000;
  std::deque<HostedJoint> joints;
};

}  // namespace torsio::test
