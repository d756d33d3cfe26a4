// Simulated joints as nodes of a CAN bus: what moves is the plant, as over NDLCom.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "link/can_node.hpp"
#include "sim/joints/hosted_joints.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::can_frame;
using test::HostedJoints;
using test::MemoryLine;
using test::number_in;
using testing::Contains;
using testing::HasSubstr;

constexpr double kJointTurn_rad = 2.0 * std::numbers::pi;

/// Frames in memory, without delay.
class MemoryCan : public CanBus {
 public:
  bool receive(CanFrame& frame) noexcept override {
    if (to_nodes.empty()) return false;
    frame = to_nodes.front();
    to_nodes.pop_front();
    return true;
  }
  bool send(const CanFrame& frame) noexcept override {
    to_hosts[frame.id] = frame;
    return true;
  }
  int descriptor() const noexcept override { return -1; }
  std::string place() const override { return "memory"; }

  std::deque<CanFrame> to_nodes = {};
  std::map<std::uint32_t, CanFrame> to_hosts = {};  ///< the last of each id
};

class CanNodes : public testing::Test {
 protected:
  using enum CanSimpleCommand;

  static std::vector<ServedArm> two_joints() {
    std::vector<ServedArm> arms = HostedJoints::single("dfki-50");
    arms.push_back({.setup = single_joint_setup(data_sheet("dfki-28")), .first_id = 2});
    return arms;
  }
  CanNodes() { tick(100); }

  void tick(int ticks = 1) {
    for (; ticks > 0; --ticks) server_.cycle(now_ns_ += HostedJoints::kTick_ns);
  }
  template <class... Numbers>
  void send(std::uint8_t node, CanSimpleCommand command, Numbers... numbers) {
    can_.to_nodes.push_back(can_frame(can_simple_id(node, command), numbers...));
  }
  template <class... Numbers>
  void stream(int ticks, std::uint8_t node, CanSimpleCommand command, Numbers... numbers) {
    for (; ticks > 0; --ticks) {
      send(node, command, numbers...);
      tick();
    }
  }
  double heard(std::uint8_t node, CanSimpleCommand command, std::size_t index) {
    return double{number_in<float>(can_.to_hosts[can_simple_id(node, command)], 4 * index)};
  }
  std::uint32_t error(std::uint8_t node) {
    return number_in<std::uint32_t>(can_.to_hosts[can_simple_id(node, heartbeat)], 0);
  }
  void enable(std::uint8_t node, std::uint32_t mode) {
    send(node, set_controller_mode, mode, std::uint32_t{1});
    send(node, set_axis_state, std::uint32_t{8});
  }
  LinkDriveState state(std::size_t joint) const { return server_.joints()[joint].state; }

  MemoryLine line_;
  MemoryCan can_;
  JointServer server_{two_joints(), {.can_rate_Hz = 1000.0}, line_, &can_};
  std::uint64_t now_ns_ = 1'000'000'000'000;
};

TEST_F(CanNodes, FollowPositionsAgainstInertiaAndGravity) {
  enable(1, 3);
  stream(20, 1, set_input_pos, 0.05F, std::int16_t{0}, std::int16_t{0});
  EXPECT_LT(heard(1, get_encoder_estimates, 0), 0.04) << "a mirror would be there at once";
  stream(1500, 1, set_input_pos, 0.05F, std::int16_t{0}, std::int16_t{0});
  EXPECT_NEAR(heard(1, get_encoder_estimates, 0), 0.05, 1e-3);
  EXPECT_NEAR(heard(1, get_encoder_estimates, 1), 0.0, 2e-3);
  EXPECT_NEAR(heard(1, get_torques, 1), 12.5 * std::sin(0.05 * kJointTurn_rad), 1.0);
  EXPECT_NEAR(heard(1, get_iq, 0), heard(1, get_iq, 1), 0.3);
  EXPECT_EQ(server_.joints()[0].counts.all_refused(), 0U);
  EXPECT_EQ(state(1), LinkDriveState::ready) << "the other node";
}

TEST_F(CanNodes, FollowVelocitiesInTurnsPerSecond) {
  enable(2, 2);
  stream(900, 2, set_input_vel, 0.1F, 0.0F);  // the brake needs 500 of them
  const double before = heard(2, get_encoder_estimates, 0);
  stream(500, 2, set_input_vel, 0.1F, 0.0F);
  EXPECT_NEAR(heard(2, get_encoder_estimates, 0) - before, 0.05, 5e-3);
  EXPECT_NEAR(heard(2, get_encoder_estimates, 1), 0.1, 0.02);
}

// The lever swings: its torque follows the wanted one with a delay.
TEST_F(CanNodes, FollowTorques) {
  enable(1, 1);
  stream(1000, 1, set_input_torque, 4.0F);
  EXPECT_NEAR(heard(1, get_torques, 0), 4.0, 1e-3);
  EXPECT_GT(heard(1, get_torques, 1), 1.5);
  EXPECT_GT(heard(1, get_encoder_estimates, 0), 0.01);
  EXPECT_GT(heard(1, get_encoder_estimates, 1), 0.1);
}

TEST_F(CanNodes, ReportAFaultOfASensor) {
  std::vector<ServedArm> arms = HostedJoints::single("dfki-50");
  arms[0].faults.resize(1);
  arms[0].faults[0].faults.push_back(
      parse_injection("gear_angle=nan@0.5s", arms[0].setup.joints[0].sheet));
  MemoryCan can;
  JointServer server(arms, {}, line_, &can);
  const auto heard_error = [&] {
    return number_in<std::uint32_t>(can.to_hosts[can_simple_id(1, heartbeat)], 0);
  };
  for (int n = 0; n < 1000; ++n) {
    server.cycle(now_ns_ += HostedJoints::kTick_ns);
    if (n == 100) can.to_nodes.push_back(can_frame(0x27, std::uint32_t{8}));
    if (n > 100 && n < 700)
      can.to_nodes.push_back(can_frame(0x2C, 0.0F, std::int16_t{0}, std::int16_t{0}));
    if (n == 450) {
      EXPECT_EQ(heard_error(), 0U);
    }
  }
  EXPECT_EQ(server.joints()[0].state, LinkDriveState::fault);
  EXPECT_EQ(heard_error(), CanSimpleError::kMissingEstimate);
}

TEST_F(CanNodes, StopWithoutInputs) {
  enable(1, 3);
  stream(300, 1, set_input_pos, 0.0F, std::int16_t{0}, std::int16_t{0});
  tick(60);
  EXPECT_EQ(state(0), LinkDriveState::stop);
  tick(200);
  EXPECT_EQ(error(1), CanSimpleError::kWatchdogTimerExpired);
  for (int n = 0; n < 20 && error(1) != 0; ++n) {
    send(1, clear_errors, std::uint8_t{0});
    tick(100);
  }
  EXPECT_EQ(state(0), LinkDriveState::ready);
}

TEST_F(CanNodes, AreNamedInEventsAndCounted) {
  enable(1, 3);
  send(7, estop);
  tick(3);
  EXPECT_THAT(server_.take_events(), Contains(HasSubstr("joint 1: the CAN bus in control")));
  const auto status = server_.can();
  ASSERT_TRUE(status);
  EXPECT_EQ(status->place, "memory");
  EXPECT_EQ(status->frames.frames, 2U);
  EXPECT_EQ(status->frames.to_no_node, 1U);
  EXPECT_EQ(server_.joints()[0].host, JointServer::kCanHost);
}

TEST_F(CanNodes, HaveNumbersOfSixBits) {
  std::vector<ServedArm> arms = HostedJoints::single("dfki-50");
  arms[0].first_id = 63;
  EXPECT_THAT(test::error_message([&] { JointServer(arms, {}, line_, &can_); }),
              HasSubstr("CAN node 63: expected a number of 0 to 62"));
  JointServer without(arms, {}, line_);
  EXPECT_FALSE(without.can());
}

}  // namespace
}  // namespace torsio
