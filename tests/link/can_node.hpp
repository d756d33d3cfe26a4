#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include "link/recording_joint.hpp"
#include "torsio/link/can_simple.hpp"

namespace torsio {

inline void PrintTo(const CanFrame& frame, std::ostream* out) {
  *out << std::hex << frame.id << (frame.is_remote ? " remote" : "") << " [" << int{frame.size}
       << "]";
  for (const std::uint8_t each : frame.bytes()) *out << ' ' << int{each};
  *out << std::dec;
}

}  // namespace torsio

namespace torsio::test {

/// A frame whose data are these numbers one after the other.
template <class... Numbers>
CanFrame can_frame(std::uint32_t id, Numbers... numbers) {
  CanFrame frame{.id = id};
  [[maybe_unused]] const auto add = [&](auto number) {
    std::memcpy(frame.data.data() + frame.size, &number, sizeof(number));
    frame.size = static_cast<std::uint8_t>(frame.size + sizeof(number));
  };
  (add(numbers), ...);
  return frame;
}

template <class Number>
Number number_in(const CanFrame& frame, std::size_t offset) {
  Number value{};
  std::memcpy(&value, frame.data.data() + offset, sizeof(value));
  return value;
}

/// Keeps the frames that are sent.
class StoredCan : public CanSink {
 public:
  bool send(const CanFrame& frame) noexcept override {
    if (!takes) return false;
    frames.push_back(frame);
    return true;
  }
  std::vector<CanFrame> take() { return std::exchange(frames, {}); }

  bool takes = true;
  std::vector<CanFrame> frames = {};
};

/// A joint with the channels of a CAN node, whose values a test sets.
class CanRecordingJoint : public RecordingJoint {
 public:
  static constexpr std::size_t kChannels = 6;
  std::span<const std::string_view> channels() const noexcept override { return channel_names; }
  void measure(std::span<float> out) const noexcept override {
    std::copy_n(values.begin(), out.size(), out.begin());
  }
  std::array<std::string_view, kChannels> channel_names = {"motor_angle_rad",   "motor_current_A",
                                                           "command_current_A", "torque_Nm",
                                                           "wanted_torque_Nm",  "is_ready_1"};
  std::array<float, kChannels> values = {0.0F, 2.0F, 2.5F, 11.0F, 12.0F, 1.0F};
};

/// Joint 5 on an NDLCom line and as node 5 of a CAN bus.
class CanJoint {
 public:
  static constexpr std::uint8_t kNode = 5;
  static constexpr std::uint8_t kBusHost = 253;
  static constexpr std::uint64_t kTick_ns = 1'000'000;

  /// @param rate_Hz of all cyclic frames; 0: none
  explicit CanJoint(double rate_Hz = 0.0, bool is_initialised = true) : line(nodes(rate_Hz)) {
    joint.initialised = is_initialised;
    tick();
  }

  void tick(int ticks = 1) {
    for (; ticks > 0; --ticks) {
      endpoint.tick(now_ns += kTick_ns);
      line.tick(now_ns);
    }
  }
  template <class... Numbers>
  void send(CanSimpleCommand command, Numbers... numbers) {
    line.receive(can_frame(can_simple_id(kNode, command), numbers...), now_ns);
  }
  /// The reply to a remote frame; none: there was not exactly one.
  std::optional<CanFrame> ask(CanSimpleCommand command) {
    bus.take();
    line.receive({.id = can_simple_id(kNode, command), .is_remote = true, .size = 8}, now_ns);
    const std::vector<CanFrame> replies = bus.take();
    if (replies.size() != 1) return std::nullopt;
    return replies[0];
  }
  void set_state(std::uint32_t state) { send(CanSimpleCommand::set_axis_state, state); }
  void set_mode(std::uint32_t mode, std::uint32_t input = 1) {
    send(CanSimpleCommand::set_controller_mode, mode, input);
  }
  LinkDriveState state() const { return endpoint.drive().state(); }
  std::uint64_t refused(LinkRefusal reason) const {
    return endpoint.counts().refused[static_cast<std::size_t>(reason)];
  }
  std::uint64_t all_refused() const { return endpoint.counts().all_refused(); }
  std::uint32_t heartbeat_error() {
    const auto frame = ask(CanSimpleCommand::heartbeat);
    return frame ? number_in<std::uint32_t>(*frame, 0) : ~0U;
  }
  int heartbeat_state() { return ask(CanSimpleCommand::heartbeat)->data[4]; }
  int heartbeat_result() { return ask(CanSimpleCommand::heartbeat)->data[5]; }

  double ratio = 100.0;
  double supply_V = 48.0;
  double torque_constant_Nm_A = 0.1;
  double largest_speed_rad_s = 4.0;
  double largest_torque_Nm = 50.0;
  std::string_view stop_cause = "none";
  std::array<LinkRegister, 6> registers = {
      variable_register({.name = "gear_ratio"}, ratio),
      variable_register({.name = "supply_V"}, supply_V),
      variable_register({.name = "torque_constant_Nm_A"}, torque_constant_Nm_A),
      variable_register({.name = "largest_speed_rad_s",
                         .access = LinkAccess::write_when_disabled,
                         .lowest = 0.0,
                         .highest = 4.0},
                        largest_speed_rad_s),
      variable_register({.name = "largest_torque_Nm",
                         .access = LinkAccess::write_when_disabled,
                         .lowest = 0.0,
                         .highest = 50.0},
                        largest_torque_Nm),
      LinkRegister{.name = "stop_cause",
                   .type = LinkValueType::text,
                   .get =
                       [](const void* context) noexcept {
                         return LinkValue::of(*static_cast<const std::string_view*>(context));
                       },
                   .context = &stop_cause}};
  RegisterTable table = RegisterTable(registers);
  CanRecordingJoint joint = {};
  StoredFrames sent = {};  ///< on the NDLCom line
  StoredCan bus = {};
  std::uint64_t now_ns = 5'000'000'000;
  JointEndpoint endpoint = JointEndpoint({.id = kNode, .bus_host = kBusHost}, joint, table, sent);
  CanSimpleLine line;

 private:
  std::vector<std::unique_ptr<CanSimpleNode>> nodes(double rate_Hz) {
    std::vector<std::unique_ptr<CanSimpleNode>> all;
    all.push_back(std::make_unique<CanSimpleNode>(
        CanSimpleNode::Settings{
            .node = kNode, .status_rate_Hz = rate_Hz, .estimate_rate_Hz = rate_Hz},
        endpoint, joint, table, bus));
    return all;
  }
};

}  // namespace torsio::test
