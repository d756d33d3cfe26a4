#include "torsio/link/joint_group.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "link/served_joint.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::LinkedJoint;
using test::ServedJoint;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::size_t kJoints = 12;

/// Twelve joints, and one line of a host that reaches all of them, as a bus does.
class JointGroups : public testing::Test {
 protected:
  JointGroups() {
    // The host's port is that of a line which is closed again.
    const std::string own = open_udp({.listen = {.port = 0}})->place();
    host_port_ = static_cast<std::uint16_t>(std::stoi(own.substr(own.find(':') + 1)));
    UdpSettings bus{.listen = {.port = host_port_}, .peers = {}};
    for (std::size_t n = 0; n < kJoints; ++n) {
      auto line = open_udp({.listen = {.port = 0}, .peers = {{.port = host_port_}}});
      const std::string place = line->place();
      ports_.push_back(static_cast<std::uint16_t>(std::stoi(place.substr(place.find(':') + 1))));
      bus.peers.push_back({.port = ports_.back()});
      joints_.push_back(serve(n, std::move(line)));
      ids_.push_back(id_of(n));
    }
    line_ = open_udp(bus);
  }
  static std::uint8_t id_of(std::size_t n) { return static_cast<std::uint8_t>(n + 1); }
  static std::unique_ptr<ServedJoint> serve(std::size_t n, std::unique_ptr<LinkTransport> line) {
    return std::make_unique<ServedJoint>(std::move(line), JointEndpoint::Settings{.id = id_of(n)});
  }
  void start_again(std::size_t n) {
    joints_[n] =
        serve(n, open_udp({.listen = {.port = ports_[n]}, .peers = {{.port = host_port_}}}));
  }
  JointGroup group(double silence_s = 0.2) {
    JointGroup made(line_, "the bus", {.joints = ids_, .timeout_s = 0.5, .silence_s = silence_s});
    return made;
  }
  /// Polls until `is_done()`, for a minute at most. @returns whether it is
  template <class IsDone>
  static bool poll_until(JointGroup& joints, const JointGroup::VisitTelemetry& visit,
                         const IsDone& is_done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!is_done() && std::chrono::steady_clock::now() < end) joints.poll(visit, 0.01);
    return is_done();
  }

  std::uint16_t host_port_ = 0;
  std::vector<std::uint16_t> ports_ = {};
  std::vector<std::uint8_t> ids_ = {};
  std::vector<std::unique_ptr<ServedJoint>> joints_ = {};
  std::shared_ptr<LinkTransport> line_;
};

TEST_F(JointGroups, TelemetryOfTwelveJointsArrivesAtTheSameTimeWithoutControl) {
  JointGroup joints = group();
  ASSERT_EQ(joints.size(), kJoints);
  EXPECT_EQ(joints.id(11), 12);
  EXPECT_EQ(joints.information(3).name, "elbow");
  EXPECT_THAT(joints.channels(7), ElementsAre("angle_rad", "torque_Nm", "current_A"));
  joints.subscribe({"current_A", "angle_rad"}, 480.0);
  EXPECT_EQ(joints.subscription(5).rate_Hz, 500.0);
  EXPECT_THAT(joints.subscription(5).channels, ElementsAre("angle_rad", "current_A"));
  std::vector<std::uint64_t> received(kJoints);
  std::vector<std::uint64_t> last_ns(kJoints);
  std::vector<std::uint32_t> sent(kJoints);  // since the first that was received
  std::vector<std::uint32_t> first(kJoints);
  const auto visit = [&](std::size_t joint, const LinkTelemetry& telemetry) {
    ASSERT_EQ(telemetry.values.count, 2);
    EXPECT_EQ(telemetry.values.values[1], 2.5F);
    EXPECT_GT(telemetry.time_ns, last_ns[joint]);
    last_ns[joint] = telemetry.time_ns;
    if (received[joint] == 0) first[joint] = telemetry.sequence;
    sent[joint] = telemetry.sequence - first[joint] + 1;
    ++received[joint];
  };
  EXPECT_TRUE(poll_until(joints, visit, [&] { return std::ranges::min(received) >= 300; }));
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    EXPECT_EQ(joints.counts(joint).telemetry, received[joint]);
    EXPECT_EQ(joints.counts(joint).telemetry + joints.counts(joint).lost, sent[joint]);
    EXPECT_FALSE(joints.is_silent(joint));
    joints_[joint]->with(
        [](LinkedJoint& joint_at) { EXPECT_EQ(joint_at.endpoint.guard().controlling_host(), 0); });
  }
}

TEST_F(JointGroups, LostFramesAreCountedPerJoint) {
  JointGroup joints = group();
  joints.subscribe({}, 1000.0);
  joints_[4]->lost_share = 0.2;
  std::vector<std::uint64_t> received(kJoints);
  const auto visit = [&](std::size_t joint, const LinkTelemetry&) { ++received[joint]; };
  EXPECT_TRUE(poll_until(joints, visit, [&] { return std::ranges::min(received) >= 500; }));
  EXPECT_GT(joints.counts(4).lost, 50U);
  // A busy machine may lose some of the others.
  EXPECT_LT(joints.counts(3).lost, joints.counts(4).lost);
  EXPECT_LT(joints.counts(5).lost, joints.counts(4).lost);
}

TEST_F(JointGroups, ASilentJointIsReportedAndFoundAgainWhileTheOthersContinue) {
  JointGroup joints = group();
  joints.subscribe({}, 200.0);
  std::vector<std::uint64_t> received(kJoints);
  const auto visit = [&](std::size_t joint, const LinkTelemetry&) { ++received[joint]; };
  ASSERT_TRUE(poll_until(joints, visit, [&] { return std::ranges::min(received) >= 100; }));
  joints_[6].reset();
  ASSERT_TRUE(poll_until(joints, visit, [&] { return joints.is_silent(6); }));
  std::vector<std::uint64_t> before = received;
  ASSERT_TRUE(poll_until(joints, visit, [&] { return received[7] >= before[7] + 100; }));
  EXPECT_EQ(received[6], before[6]);
  for (std::size_t joint = 0; joint < kJoints; ++joint)
    EXPECT_EQ(joints.is_silent(joint), joint == 6);
  start_again(6);
  EXPECT_TRUE(poll_until(joints, visit, [&] { return received[6] >= before[6] + 50; }));
  EXPECT_FALSE(joints.is_silent(6));
  // It numbers from 0 again, which is not a loss.
  EXPECT_LT(joints.counts(6).lost, 50U);
}

TEST_F(JointGroups, MistakesNameTheJoint) {
  EXPECT_THAT(error_message([&] {
                JointGroup(line_, "the bus", {.joints = {3, 40}, .timeout_s = 0.01});
              }),
              AllOf(HasSubstr("joint 40 at the bus"), HasSubstr("no reply: information")));
  EXPECT_THAT(error_message([&] {
                JointGroup(line_, "the bus", {.joints = {3, 3}});
              }),
              AllOf(HasSubstr("each id once"), HasSubstr("3 twice")));
  EXPECT_THAT(error_message([&] { JointGroup(line_, "the bus", {}); }),
              HasSubstr("at least one id"));
  JointGroup joints = group();
  EXPECT_THAT(error_message([&] { joints.subscribe({"torque"}, 100.0); }),
              AllOf(HasSubstr("joint 1 at the bus"), HasSubstr("torque_Nm")));
}

}  // namespace
}  // namespace torsio
