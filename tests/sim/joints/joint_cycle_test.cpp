// A cycle of the server uses no heap, whatever arrives.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "sim/joints/hosted_joints.hpp"
#include "support/allocation_counter.hpp"

namespace torsio {
namespace {

using test::HostedJoint;
using test::HostedJoints;

TEST(JointCycle, UsesNoHeap) {
  std::vector<ServedArm> arms;
  for (std::uint8_t id = 1; id <= 3; ++id)
    arms.push_back({.setup = single_joint_setup(data_sheet("dfki-28")), .first_id = id});
  HostedJoints hosted(std::move(arms));
  ASSERT_TRUE(hosted.start());
  const LinkDriveState enabled = LinkDriveState::enabled;
  const auto calls = test::heap_calls_during([&] {
    for (int n = 0; n < 500; ++n) {
      for (HostedJoint& joint : hosted.joints) {
        hosted.follow(joint, {.mode = n < 250 ? JointMode::position : JointMode::impedance,
                              .position_rad = 0.1F,
                              .stiffness_Nm_rad = n < 250 ? 0.0F : 50.0F});
        if (n % 50 == 0) {
          hosted.send(joint, LinkRegisterRead{.index = 1});
          hosted.send(joint, LinkRegisterWrite{.index = 12, .value = LinkValue::of(15.0)});
          hosted.send(joint, LinkModeChange{.mode = JointMode::position});
          hosted.send(joint,
                      LinkInjectFault{
                          .fault = "jump", .channel = 4, .magnitude = 0.1, .duration_s = 0.02F});
        }
        if (n == 300) hosted.send(joint, LinkInjectFault{});
      }
      hosted.tick();
    }
  });
  EXPECT_EQ(calls, 0U);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(hosted.state(j), enabled);
}

TEST(JointCycle, UsesNoHeapForFaultsStopsAndZeros) {
  HostedJoints hosted(HostedJoints::single("dfki-50"));
  HostedJoint& joint = hosted.joints[0];
  ASSERT_TRUE(hosted.start());
  const auto calls = test::heap_calls_during([&] {
    hosted.send(joint, LinkInjectFault{.fault = "nan", .channel = 2, .duration_s = 0.1F});
    hosted.hold(1500);
    hosted.send(joint, LinkStateChange{.command = LinkStateCommand::reset_fault});
    hosted.tick(5);
    hosted.send(joint, LinkZero{.channel = 5, .value = 0.0});
    hosted.tick(100);
    hosted.send(joint, LinkStateChange{.command = LinkStateCommand::enable});
    hosted.hold(1000);
    hosted.send(joint, LinkStop{.category = 1});
    hosted.tick(1000);
  });
  EXPECT_EQ(calls, 0U);
  EXPECT_EQ(hosted.state(), LinkDriveState::stop);
}

}  // namespace
}  // namespace torsio
