#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "link/can_datagram.hpp"
#include "link/can_node.hpp"

// Any datagram is a frame of CAN 2.0 or refused, and any frame is taken: no number that is not finite or beyond its limits reaches
// the joint. The data are datagrams of up to 255 bytes, each with its length before it. One that is refused is also taken for the
// command and the data of a frame.

namespace {

using namespace torsio;

class FuzzedCanJoint : public test::CanRecordingJoint {
 public:
  LinkRefusal apply(const JointReference& reference) noexcept override {
    if (!is_finite(reference)) std::abort();
    return LinkRefusal::none;
  }
  void stop(StopCategory /*category*/) noexcept override {}
};

class CheckedBus : public CanSink {
 public:
  bool send(const CanFrame& frame) noexcept override {
    if (frame.is_extended || frame.is_remote || frame.is_error || frame.id >> 5U != 5 ||
        frame.size != kCanDataBytes)
      std::abort();
    std::array<std::uint8_t, detail::kLongestCanDatagram> bytes;
    const std::size_t size = detail::encode_can_datagram(frame, bytes);
    CanFrame read;
    if (!detail::decode_can_datagram(std::span(bytes).first(size), read) || read != frame)
      std::abort();
    return true;
  }
};

CanFrame frame_of(std::span<const std::uint8_t> bytes) {
  CanFrame frame;
  if (detail::decode_can_datagram(bytes, frame)) {
    if (frame.size > kCanDataBytes ||
        frame.id > (frame.is_extended ? kCanHighestExtendedId : kCanHighestId))
      std::abort();
    return frame;
  }
  if (bytes.empty()) return frame;
  // Node 5, for which most of the commands are.
  frame.id = 5U << 5U | (bytes[0] & 0x1FU);
  frame.is_remote = (bytes[0] & 0x80U) != 0;
  const auto data = bytes.subspan(1, std::min(bytes.size() - 1, kCanDataBytes));
  frame.size = static_cast<std::uint8_t>(data.size());
  std::ranges::copy(data, frame.data.begin());
  return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  FuzzedCanJoint joint;
  double ratio = 100.0;
  double speed_rad_s = 4.0;
  double torque_Nm = 50.0;
  double constant_Nm_A = 0.1;
  const std::array registers{variable_register({.name = "gear_ratio"}, ratio),
                             variable_register({.name = "torque_constant_Nm_A"}, constant_Nm_A),
                             variable_register({.name = "largest_speed_rad_s",
                                                .access = LinkAccess::write_when_disabled,
                                                .lowest = 0.0,
                                                .highest = 4.0},
                                               speed_rad_s),
                             variable_register({.name = "largest_torque_Nm",
                                                .access = LinkAccess::write_when_disabled,
                                                .lowest = 0.0,
                                                .highest = 50.0},
                                               torque_Nm)};
  const RegisterTable table(registers);
  test::StoredFrames ndlcom;
  CheckedBus bus;
  JointEndpoint endpoint({.id = 5, .bus_host = 253}, joint, table, ndlcom);
  std::vector<std::unique_ptr<CanSimpleNode>> nodes;
  nodes.push_back(std::make_unique<CanSimpleNode>(CanSimpleNode::Settings{.node = 5}, endpoint,
                                                  joint, table, bus));
  CanSimpleLine line(std::move(nodes));
  std::uint64_t now_ns = 1'000'000'000;
  for (std::span<const std::uint8_t> left(data, size); !left.empty();) {
    const std::size_t length = std::min<std::size_t>(left[0], left.size() - 1);
    endpoint.tick(now_ns += 1'000'000);
    line.tick(now_ns);
    line.receive(frame_of(left.subspan(1, length)), now_ns);
    joint.values[5] = length % 2 == 0 ? 1.0F : 0.0F;
    joint.fault = length == 77;
    left = left.subspan(1 + length);
  }
  if (!(speed_rad_s >= 0.0 && speed_rad_s <= 4.0 && torque_Nm >= 0.0 && torque_Nm <= 50.0))
    std::abort();
  if (!ndlcom.bytes.empty()) std::abort();  // nothing is sent to the host of the bus
  return 0;
}
