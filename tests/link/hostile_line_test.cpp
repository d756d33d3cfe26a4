// A joint and its host over a line that delays, reorders, drops, duplicates, damages, splits and joins.
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "link/recording_joint.hpp"
#include "torsio/link/hostile_wire.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using test::LinkedJoint;

constexpr std::uint64_t kWatchdog_ns = 50'000'000;

/// One joint, driven by one host, whose references carry their number: the line must not change, repeat or delay them.
class HostileRun {
 public:
  explicit HostileRun(std::uint64_t seed)
      : random_(seed), to_joint_({}, seed + 1000), to_host_({}, seed + 2000) {}

  void tick(bool host_is_alive) {
    joint_.tick();
    const std::uint64_t now_ns = joint_.now_ns;
    if (!joint_.sent.bytes.empty()) to_host_.send(joint_.sent.take(), now_ns);
    to_joint_.take(now_ns, [&](auto bytes) { joint_.endpoint.receive(bytes, now_ns); });
    check_references(now_ns);
    check_joint(now_ns);
    to_host_.take(now_ns, [&](auto bytes) { host_.receive(bytes, [](const auto&) {}); });
    if (host_is_alive) drive(now_ns);
  }

  LinkedJoint joint_;
  std::uint64_t executed_ = 0;
  std::uint64_t enabled_ticks_ = 0;

 private:
  struct Sent {
    std::uint64_t number = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t heard_ns = 0;
    std::uint64_t deadline_ns = 0;
    float torque_Nm = 0.0F;
  };
  /// More than can be sent while a reference is young.
  static constexpr std::uint64_t kKept = 4096;

  template <class Message>
  void send(const Message& message, std::uint64_t now_ns) {
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
    to_joint_.send(std::span(frame).first(host_.build(message, frame)), now_ns);
    sent_ns_ = now_ns;
  }
  void drive(std::uint64_t now_ns) {
    send(LinkPing{.token = ++token_}, now_ns);
    if (host_.clock_ns() == 0) return;
    if (token_ % 16 == 3) send(LinkStateChange{.command = LinkStateCommand::disable}, now_ns);
    if (token_ % 16 == 5) send(LinkStateChange{.command = LinkStateCommand::enable}, now_ns);
    if (token_ % 64 == 7)  // half of them are outside the limits
      send(LinkRegisterWrite{.index = 0, .value = LinkValue::of(random_.uniform(-9.0, 18.0))},
           now_ns);
    const Sent made{.number = number_++,
                    .heard_ns = host_.clock_ns(),
                    .deadline_ns = host_.clock_ns() + 30'000'000,
                    .torque_Nm = static_cast<float>(random_.uniform(-50.0, 60.0))};
    kept_[made.number % kKept] = made;
    send(LinkReference{.deadline_ns = made.deadline_ns,
                       .mode = JointMode::torque,
                       .position_rad = static_cast<float>(made.number / kKept),
                       .velocity_rad_s = static_cast<float>(made.number % kKept),
                       .torque_Nm = made.torque_Nm},
         now_ns);
  }
  void check_references(std::uint64_t now_ns) {
    for (const JointReference& each : joint_.joint.references) {
      const auto number = static_cast<std::uint64_t>(each.position_rad) * kKept +
                          static_cast<std::uint64_t>(each.velocity_rad_s);
      const Sent& sent = kept_[number % kKept];
      ASSERT_EQ(sent.number, number) << "never sent, or long ago";
      ASSERT_EQ(each.torque_Nm, double{sent.torque_Nm}) << "damaged";
      ASSERT_LE(each.torque_Nm, 50.0) << "outside the limits";
      ASSERT_GE(number, next_) << "twice or out of order";
      ASSERT_LT(now_ns, sent.deadline_ns) << "late";
      ASSERT_LT(now_ns - sent.heard_ns, kWatchdog_ns) << "old";
      next_ = number + 1;
      ++executed_;
    }
    joint_.joint.references.clear();
    joint_.joint.stops.clear();
  }
  void check_joint(std::uint64_t now_ns) {
    ASSERT_TRUE(joint_.gain >= 0.0 && joint_.gain <= 9.0) << "a register outside its limits";
    if (!joint_.endpoint.drive().is_enabled()) return;
    ++enabled_ticks_;
    ASSERT_LT(now_ns - sent_ns_, kWatchdog_ns) << "enabled without a host";
  }

  Random random_;
  HostileWire to_joint_;
  HostileWire to_host_;
  HostEndpoint host_ = HostEndpoint({.id = 200, .joint = 1});
  std::uint32_t token_ = 0;
  std::uint64_t number_ = 0;
  std::uint64_t next_ = 0;
  std::uint64_t sent_ns_ = 0;
  std::array<Sent, kKept> kept_ = {};
};

/// The host is silent for up to 0.3 s every 10 s. @param ticks of a millisecond
void drive_for(HostileRun& run, std::uint64_t seed, std::uint64_t ticks) {
  Random random(seed);
  std::uint64_t silent = 0;
  for (std::uint64_t n = 0; n < ticks && !testing::Test::HasFatalFailure(); ++n) {
    if (n % 10'000 == 9'000) silent = random.below(300);
    run.tick(silent == 0);
    if (silent > 0) --silent;
  }
}

TEST(HostileLine, NothingIsExecutedLateTwiceOrOutOfOrder) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    HostileRun run(seed);
    drive_for(run, seed, 30'000);
    ASSERT_FALSE(HasFatalFailure());
    EXPECT_GT(run.executed_, 2000U);
    EXPECT_GT(run.enabled_ticks_, 5000U);
    const auto& guard = run.joint_.endpoint.guard();
    EXPECT_GT(guard.refused(CommandGuard::Refusal::repeated), 10U);
    EXPECT_GT(guard.refused(CommandGuard::Refusal::too_old), 10U);
  }
}

TEST(HostileLine, ASilentHostStopsTheJointWithinTheTimeOfTheWatchdog) {
  for (std::uint64_t seed = 21; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    HostileRun run(seed);
    int ticks = 0;
    while (ticks++ < 500 || !run.joint_.endpoint.drive().is_enabled()) run.tick(true);
    for (int n = 0; n < 50; ++n) run.tick(false);
    EXPECT_FALSE(run.joint_.endpoint.drive().is_enabled());
    for (int n = 0; n < 300; ++n) run.tick(false);  // what is still on the line changes nothing
    EXPECT_FALSE(run.joint_.endpoint.drive().is_enabled());
  }
}

/// 24 simulated hours in eight parts.
class HostileHours : public testing::TestWithParam<std::uint64_t> {};

TEST_P(HostileHours, NothingIsExecutedLateTwiceOrOutOfLimits) {
  constexpr std::uint64_t kThreeHours = 3ULL * 3600 * 1000;
  HostileRun run(GetParam());
  drive_for(run, GetParam(), kThreeHours);
  ASSERT_FALSE(HasFatalFailure());
  EXPECT_GT(run.executed_, kThreeHours / 20);
  RecordProperty("executed", std::to_string(run.executed_));
}

INSTANTIATE_TEST_SUITE_P(Parts, HostileHours, testing::Range<std::uint64_t>(101, 109));

}  // namespace
}  // namespace torsio
