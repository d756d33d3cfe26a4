// Bytes without a meaning, damaged frames, and commands that are damaged so that the CRC-16 of their frame is right.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "link/recording_joint.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using test::LinkedJoint;

constexpr std::size_t kOrdinary = 200'000;
constexpr std::size_t kLong = 25'000'000;  // in four parts

std::span<const std::uint8_t> random_block(Random& random, std::array<std::uint8_t, 80>& block) {
  const std::size_t size = 1 + random.below(block.size());
  for (std::uint8_t& byte : block) byte = static_cast<std::uint8_t>(random.bits());
  // Flags and escapes are rare among random bytes, and begin all that is interesting.
  for (std::size_t k = 0; k < 4; ++k)
    block[random.below(block.size())] = random.uniform() < 0.6 ? 0x7E : 0x7D;
  return std::span(block).first(size);
}

void take_random_blocks(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  LinkedJoint joint;
  HostEndpoint host({.id = 200, .joint = 1});
  std::array<std::uint8_t, 80> block{};
  for (std::size_t n = 0; n < count; ++n) {
    const auto bytes = random_block(random, block);
    joint.endpoint.receive(bytes, joint.now_ns);
    host.receive(bytes, [](const auto&) {});
    if (n % 1000 == 0) joint.tick();
    joint.sent.bytes.clear();
  }
  EXPECT_EQ(joint.joint.enables, 0);
  EXPECT_TRUE(joint.joint.references.empty());
  EXPECT_GT(joint.endpoint.frames().malformed, count / 4);
}

/// A command of which one to eight bytes are changed after its CRC-32, with a CRC-16 that is right.
class DamagedCommands {
 public:
  explicit DamagedCommands(std::uint64_t seed) : random_(seed) {
    static_cast<void>(joint_.change(host_, LinkStateCommand::enable));
  }

  void send() {
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> encoded;
    const std::size_t size =
        random_.uniform() < 0.9
            ? host_.build(joint_.reference(1.0F), encoded)
            : host_.build(LinkRegisterWrite{.index = 0, .value = LinkValue::of(5.0)}, encoded);
    std::span<const std::uint8_t> bytes(encoded.data(), size);
    const auto frame = decoder_.next(bytes);
    std::array<std::uint8_t, kNdlcomMaxPayloadBytes> payload{};
    std::ranges::copy(frame->payload, payload.begin());
    const auto damaged = std::span(payload).first(frame->payload.size());
    damage(damaged, frame->payload);
    const std::size_t again =
        encode_ndlcom({.receiver = 1, .sender = 200, .counter = 0, .payload = damaged}, encoded);
    joint_.endpoint.receive(std::span(encoded).first(again), joint_.now_ns);
    joint_.sent.bytes.clear();
  }
  void expect_no_effect() {
    EXPECT_EQ(joint_.endpoint.counts().executed, 1U);  // the enable
    EXPECT_TRUE(joint_.joint.references.empty());
    EXPECT_EQ(joint_.gain, 2.0);
  }
  [[nodiscard]] std::uint64_t refused() {
    return joint_.endpoint.guard().refused(CommandGuard::Refusal::checksum);
  }

 private:
  /// The id stays: a stop has no CRC-32, and is what a damaged command may become.
  void damage(std::span<std::uint8_t> payload, std::span<const std::uint8_t> before) {
    do {
      for (std::size_t left = 1 + random_.below(8); left > 0; --left)
        payload[1 + random_.below(payload.size() - 1)] ^=
            static_cast<std::uint8_t>(1 + random_.below(255));
    } while (std::ranges::equal(payload, before));
  }

  Random random_;
  LinkedJoint joint_;
  HostEndpoint host_ = HostEndpoint({.id = 200, .joint = 1});
  NdlcomDecoder decoder_;
};

void send_damaged_commands(std::uint64_t seed, std::size_t count) {
  DamagedCommands commands(seed);
  for (std::size_t n = 0; n < count; ++n) commands.send();
  commands.expect_no_effect();
  EXPECT_EQ(commands.refused(), count);
}

/// Frames of every kind of command with wrong, missing and additional bytes, as a line makes them.
void take_mutated_frames(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  LinkedJoint joint;
  HostEndpoint host({.id = 200, .joint = 1});
  static_cast<void>(joint.change(host, LinkStateCommand::enable));
  LinkBytes frame(kNdlcomMaxEncodedBytes);
  for (std::size_t n = 0; n < count; ++n) {
    frame.resize(kNdlcomMaxEncodedBytes);
    frame.resize(n % 3 == 0   ? host.build(LinkPing{.token = 7}, frame)
                 : n % 3 == 1 ? host.build(joint.reference(1.0F), frame)
                              : host.build(LinkZero{.channel = 1, .value = 0.5}, frame));
    for (std::size_t left = 1 + random.below(3); left > 0; --left) {
      const std::size_t at = random.below(frame.size());
      const double kind = random.uniform();
      if (kind < 0.6)
        frame[at] ^= static_cast<std::uint8_t>(1 + random.below(255));
      else if (kind < 0.8)
        frame.erase(frame.begin() + static_cast<std::ptrdiff_t>(at));
      else
        frame.insert(frame.begin() + static_cast<std::ptrdiff_t>(at),
                     static_cast<std::uint8_t>(random.bits()));
    }
    joint.endpoint.receive(frame, joint.now_ns);
    host.receive(frame, [](const auto&) {});
    joint.sent.bytes.clear();
    // A byte before the first flag leaves the frame as it is: then the reference is executed, unchanged.
    for (const JointReference& each : joint.joint.references)
      ASSERT_TRUE(each.torque_Nm == 1.0 && each.position_rad == 0.0 && each.velocity_rad_s == 0.0 &&
                  each.current_A == 0.0 && each.mode == JointMode::torque);
    joint.joint.references.clear();
  }
  EXPECT_GT(joint.endpoint.frames().crc_errors, count / 10);
}

TEST(HostileBytes, RandomBlocksHaveNoEffect) { take_random_blocks(1, kOrdinary); }
TEST(HostileBytes, MutatedFramesAreRefusedOrUnchanged) { take_mutated_frames(2, kOrdinary); }
TEST(HostileBytes, DamagedCommandsReachNoController) { send_damaged_commands(3, kOrdinary); }

/// 1e8 of each, in four parts.
class ManyHostileBytes : public testing::TestWithParam<std::uint64_t> {};

TEST_P(ManyHostileBytes, RandomBlocksHaveNoEffect) { take_random_blocks(GetParam(), kLong); }
TEST_P(ManyHostileBytes, MutatedFramesAreRefusedOrUnchanged) {
  take_mutated_frames(GetParam(), kLong);
}
TEST_P(ManyHostileBytes, DamagedCommandsReachNoController) {
  send_damaged_commands(GetParam(), kLong);
}

INSTANTIATE_TEST_SUITE_P(Parts, ManyHostileBytes, testing::Range<std::uint64_t>(11, 15));

}  // namespace
}  // namespace torsio
