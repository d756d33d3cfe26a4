// No function of the link that a loop calls uses the heap.
#include <gtest/gtest.h>

#include <array>

#include "link/can_datagram.hpp"
#include "link/can_node.hpp"
#include "link/recording_joint.hpp"
#include "support/allocation_counter.hpp"

namespace torsio {
namespace {

/// Discards its frames, without the heap.
class NoLine : public LinkSink {
 public:
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    sent += frame.size();
    return true;
  }
  std::size_t sent = 0;
};

TEST(LinkAllocation, IsCounted) {
  EXPECT_GT(test::heap_calls_during([] { test::LinkBytes bytes(100); }), 0U);
}

TEST(LinkAllocation, OfAJointThatIsDrivenIsNone) {
  test::RecordingJoint joint;
  joint.references.reserve(3000);
  double gain = 1.0;
  const std::array registers{
      variable_register({.name = "gain", .access = LinkAccess::write}, gain)};
  const RegisterTable table(registers);
  NoLine line;
  JointEndpoint endpoint({.id = 1}, joint, table, line);
  HostEndpoint host({.id = 200});
  std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
  std::array<std::uint8_t, kNdlcomMaxPayloadBytes> pong;
  std::uint64_t now_ns = 1'000'000'000;
  const auto send = [&](const auto& message) {
    endpoint.receive(std::span(frame).first(host.build(message, frame)), now_ns);
  };
  const auto calls = test::heap_calls_during([&] {
    for (std::uint32_t n = 0; n < 2000; ++n) {
      endpoint.tick(now_ns += 1'000'000);
      const std::size_t size = encode_payload(LinkPong{.clock_ns = now_ns}, {}, pong);
      const std::size_t bytes = encode_ndlcom(
          {.receiver = 200, .sender = 1, .payload = std::span(pong).first(size)}, frame);
      host.receive(std::span(frame).first(bytes), [](const auto&) {});
      if (n == 0) send(LinkStateChange{.command = LinkStateCommand::enable});
      if (n == 1) send(LinkSubscribe{.mask = 7, .rate_Hz = 1000.0F, .lifetime_s = 60.0F});
      send(LinkReference{.deadline_ns = now_ns + 10'000'000});
      send(LinkRegisterWrite{.index = 0, .value = LinkValue::of(0.5)});
      send(LinkRegisterRead{.index = 0});
      send(LinkRegisterDescribe{.index = 0});
      send(LinkInformationRequest{});
    }
  });
  EXPECT_EQ(calls, 0U);
  EXPECT_EQ(joint.references.size(), 2000U);
  EXPECT_GT(line.sent, 2000U * 100U);
}

/// A bus that packs and unpacks what is sent.
class PackingBus : public CanSink {
 public:
  bool send(const CanFrame& frame) noexcept override {
    std::array<std::uint8_t, detail::kLongestCanDatagram> bytes;
    CanFrame read;
    const std::size_t size = detail::encode_can_datagram(frame, bytes);
    sent += detail::decode_can_datagram(std::span(bytes).first(size), read) ? 1U : 0U;
    return true;
  }
  std::size_t sent = 0;
};

TEST(LinkAllocation, OfANodeOfACanBusIsNone) {
  test::CanJoint joint;
  joint.joint.references.reserve(5000);
  joint.joint.stops.reserve(100);
  PackingBus bus;
  CanSimpleNode node({.node = 5, .status_rate_Hz = 1000.0, .estimate_rate_Hz = 1000.0},
                     joint.endpoint, joint.joint, joint.table, bus);
  const auto send = [&](CanSimpleCommand command, auto... numbers) {
    node.receive(test::can_frame(can_simple_id(5, command), numbers...), joint.now_ns);
  };
  const auto calls = test::heap_calls_during([&] {
    for (std::uint32_t n = 0; n < 1000; ++n) {
      joint.endpoint.tick(joint.now_ns += 1'000'000);
      node.tick(joint.now_ns);
      if (n % 100 == 0) {
        send(CanSimpleCommand::clear_errors);
        send(CanSimpleCommand::set_limits, 0.5F, 3.0F);
        send(CanSimpleCommand::set_axis_state, 8U);
        send(CanSimpleCommand::set_controller_mode, 1U + n / 100U % 3U, 1U);
      }
      send(CanSimpleCommand::set_input_pos, 0.1F, std::int16_t{1}, std::int16_t{1});
      send(CanSimpleCommand::set_input_vel, 0.1F, 1.0F);
      send(CanSimpleCommand::set_input_torque, 1.0F);
      for (std::uint8_t command = 0; command < 32; ++command)
        if (command != 2)
          node.receive({.id = 5U << 5U | command, .is_remote = true, .size = 8}, joint.now_ns);
      if (n % 100 == 99) send(CanSimpleCommand::estop);
    }
  });
  EXPECT_EQ(calls, 0U);
  EXPECT_EQ(joint.joint.references.size(), 3000U);
  EXPECT_GT(bus.sent, 10'000U);
}

}  // namespace
}  // namespace torsio
