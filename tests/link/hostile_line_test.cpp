// A joint and its host over a line that delays, reorders, drops, doubles, damages, splits and joins.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "link/recording_joint.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using test::LinkedJoint;

/// Each direction of the line has one.
class HostileLine {
 public:
  explicit HostileLine(std::uint64_t seed) : random_(seed) {}

  void send(LinkBytes bytes, std::uint64_t now_ns) {
    if (random_.uniform() < 0.1) return;
    if (random_.uniform() < 0.05)
      bytes[random_.below(bytes.size())] ^= static_cast<std::uint8_t>(1U << random_.below(8));
    if (random_.uniform() < 0.02) bytes.resize(random_.below(bytes.size()) + 1);
    if (random_.uniform() < 0.02)
      bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(random_.below(bytes.size())),
                   bytes[0]);
    for (std::size_t copies = random_.uniform() < 0.15 ? 2 : 1; copies > 0; --copies) {
      const double delay_ms =
          random_.uniform() < 0.1 ? random_.uniform(0.0, 200.0) : random_.uniform(0.0, 3.0);
      arriving_.emplace(now_ns + static_cast<std::uint64_t>(1e6 * delay_ms), bytes);
    }
  }
  /// What has arrived, joined, and cut in two at a random place.
  std::pair<LinkBytes, LinkBytes> take(std::uint64_t now_ns) {
    LinkBytes all = std::exchange(rest_, {});
    for (; !arriving_.empty() && arriving_.begin()->first <= now_ns;
         arriving_.erase(arriving_.begin()))
      all.insert(all.end(), arriving_.begin()->second.begin(), arriving_.begin()->second.end());
    const auto cut = all.begin() + static_cast<std::ptrdiff_t>(random_.below(all.size() + 1));
    if (random_.uniform() < 0.3) {
      rest_.assign(cut, all.end());
      return {LinkBytes(all.begin(), cut), {}};
    }
    return {LinkBytes(all.begin(), cut), LinkBytes(cut, all.end())};
  }

 private:
  Random random_;
  std::multimap<std::uint64_t, LinkBytes> arriving_ = {};
  LinkBytes rest_ = {};
};

struct SentReference {
  std::uint64_t heard_ns = 0;
  std::uint64_t deadline_ns = 0;
};

/// One joint, driven by one host, whose references are numbers that rise.
class HostileRun {
 public:
  explicit HostileRun(std::uint64_t seed) : to_joint_(seed), to_host_(seed + 1000) {}

  void tick(bool host_is_alive) {
    joint_.tick();
    const std::uint64_t now_ns = joint_.now_ns;
    if (!joint_.sent.bytes.empty()) to_host_.send(joint_.sent.take(), now_ns);
    const auto [first, second] = to_joint_.take(now_ns);
    joint_.endpoint.receive(first, now_ns);
    joint_.endpoint.receive(second, now_ns);
    check(now_ns);
    const auto heard = to_host_.take(now_ns);
    host_.receive(heard.first, [](const auto&) {});
    host_.receive(heard.second, [](const auto&) {});
    if (host_is_alive) drive(now_ns);
  }

  LinkedJoint joint_;
  std::size_t executed_ = 0;
  std::vector<SentReference> sent_ = {};

 private:
  template <class Message>
  void send(const Message& message, std::uint64_t now_ns) {
    LinkBytes frame(kNdlcomMaxEncodedBytes);
    frame.resize(host_.build(message, frame));
    to_joint_.send(std::move(frame), now_ns);
  }
  void drive(std::uint64_t now_ns) {
    send(LinkPing{.token = ++token_}, now_ns);
    if (host_.clock_ns() == 0) return;
    if (token_ % 16 == 3) send(LinkStateChange{.command = LinkStateCommand::disable}, now_ns);
    if (token_ % 16 == 5) send(LinkStateChange{.command = LinkStateCommand::enable}, now_ns);
    const std::uint64_t deadline_ns = host_.clock_ns() + 30'000'000;
    send(LinkReference{.deadline_ns = deadline_ns,
                       .mode = JointMode::torque,
                       .velocity_rad_s = static_cast<float>(sent_.size()),
                       .torque_Nm = 1.0F},
         now_ns);
    sent_.push_back({host_.clock_ns(), deadline_ns});
  }
  void check(std::uint64_t now_ns) {
    const auto& references = joint_.joint.references;
    for (; executed_ < references.size(); ++executed_) {
      const auto number = static_cast<std::size_t>(references[executed_].velocity_rad_s);
      ASSERT_LT(number, sent_.size()) << "never sent";
      ASSERT_EQ(references[executed_].torque_Nm, 1.0) << "damaged";
      ASSERT_GE(number, next_) << "twice or out of order";
      ASSERT_LT(now_ns, sent_[number].deadline_ns) << "late";
      ASSERT_LT(now_ns - sent_[number].heard_ns, 50'000'000U) << "old";
      next_ = number + 1;
    }
  }

  HostileLine to_joint_;
  HostileLine to_host_;
  HostEndpoint host_ = HostEndpoint({.id = 200, .joint = 1});
  std::uint32_t token_ = 0;
  std::size_t next_ = 0;
};

TEST(HostileLine, NothingIsExecutedLateTwiceOrOutOfOrder) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    HostileRun run(seed);
    for (int n = 0; n < 8000; ++n) {
      run.tick(true);
      if (testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(run.executed_, 500U);
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

}  // namespace
}  // namespace torsio
