// No function of the link that a loop calls uses the heap.
#include <gtest/gtest.h>

#include <array>

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

}  // namespace
}  // namespace torsio
