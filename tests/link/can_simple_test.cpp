// Joints as nodes of CANSimple: bytes in, bytes out.
#include "torsio/link/can_simple.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "link/can_node.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::can_frame;
using test::CanJoint;
using test::number_in;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kCanTurn_rad = 2.0 * std::numbers::pi;
constexpr float kCanNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kCanInfinity = std::numeric_limits<float>::infinity();

class ACanNode : public testing::Test {
 protected:
  using enum CanSimpleCommand;

  void enable() {
    joint_.set_state(8);
    ASSERT_EQ(joint_.state(), LinkDriveState::enabled);
  }
  /// The last reference that the joint was given.
  const JointReference& last() const { return joint_.joint.references.back(); }
  std::size_t references() const { return joint_.joint.references.size(); }

  CanJoint joint_;
  HostEndpoint host_ = HostEndpoint({.id = 200, .joint = CanJoint::kNode});

  template <class Message>
  void send_ndlcom(const Message& message) {
    test::LinkBytes frame(kNdlcomMaxEncodedBytes);
    frame.resize(host_.build(LinkPing{}, frame));
    joint_.sent.take();
    joint_.endpoint.receive(frame, joint_.now_ns);
    host_.receive(joint_.sent.take(), [](const auto&) {});
    frame.resize(kNdlcomMaxEncodedBytes);
    frame.resize(host_.build(message, frame));
    joint_.endpoint.receive(frame, joint_.now_ns);
  }
};

TEST(CanSimpleId, HasTheNodeInItsUpperSixBits) {
  EXPECT_EQ(can_simple_id(1, CanSimpleCommand::set_input_pos), 0x2CU);
  EXPECT_EQ(can_simple_id(62, CanSimpleCommand::enter_dfu_mode), 0x7DFU);
}

// The bytes of the heartbeat: error of 32 bits, state, result, flag of the trajectory, 0.
TEST_F(ACanNode, SendsAHeartbeat) {
  EXPECT_EQ(joint_.ask(heartbeat),
            (CanFrame{.id = 0xA1, .size = 8, .data = {0, 0, 0, 0, 1, 0, 0, 0}}));
  enable();
  EXPECT_EQ(joint_.ask(heartbeat),
            (CanFrame{.id = 0xA1, .size = 8, .data = {0, 0, 0, 0, 8, 1, 0, 0}}));
  joint_.send(estop);
  EXPECT_EQ(joint_.ask(heartbeat),
            (CanFrame{.id = 0xA1, .size = 8, .data = {0, 0, 0, 2, 1, 3, 0, 0}}));
}

TEST_F(ACanNode, StatesItsVersion) {
  EXPECT_EQ(joint_.ask(get_version),
            (CanFrame{.id = 0xA0, .size = 8, .data = {2, 0, 0, 0, 0, 2, 0, 0}}));
}

TEST_F(ACanNode, MeasuresInTurnsOfTheJoint) {
  // The rotor turns 100 times as far: a quarter of a turn of the joint.
  joint_.joint.values[0] = static_cast<float>(25.0 * kCanTurn_rad);
  joint_.tick();
  const CanFrame frame = *joint_.ask(get_encoder_estimates);
  EXPECT_EQ(frame.id, 0xA9U);
  EXPECT_EQ(frame.size, 8);
  EXPECT_FLOAT_EQ(number_in<float>(frame, 0), 0.25F);
}

TEST_F(ACanNode, MeasuresItsSpeed) {
  for (int n = 1; n <= 200; ++n) {
    joint_.joint.values[0] = static_cast<float>(0.1 * n);  // 100 rad/s of the rotor
    joint_.tick();
  }
  EXPECT_NEAR(number_in<float>(*joint_.ask(get_encoder_estimates), 4), 1.0 / kCanTurn_rad, 1e-4);
  // 0.1 Nm/A * 2 A * 100 rad/s = 20 W from 48 V.
  const CanFrame supply = *joint_.ask(get_bus_voltage_current);
  EXPECT_EQ(number_in<float>(supply, 0), 48.0F);
  EXPECT_NEAR(number_in<float>(supply, 4), 20.0 / 48.0, 1e-3);
}

TEST_F(ACanNode, StatesCurrentsAndTorquesWantedFirst) {
  EXPECT_EQ(joint_.ask(get_iq), can_frame(0xB4, 2.5F, 2.0F));
  EXPECT_EQ(joint_.ask(get_torques), can_frame(0xBC, 12.0F, 11.0F));
}

// Some adapters cannot send remote frames.
TEST_F(ACanNode, TakesAnEmptyFrameForARequest) {
  joint_.bus.take();
  joint_.send(get_iq);
  EXPECT_THAT(joint_.bus.take(), ElementsAre(can_frame(0xB4, 2.5F, 2.0F)));
  joint_.send(get_iq, 1.0F, 2.0F);  // the reply of another device with this number
  EXPECT_THAT(joint_.bus.take(), IsEmpty());
  EXPECT_EQ(joint_.refused(LinkRefusal::unknown_message), 1U);
}

TEST_F(ACanNode, IsEnabledAndDisabled) {
  enable();
  EXPECT_EQ(joint_.joint.enables, 1);
  EXPECT_EQ(joint_.endpoint.guard().controlling_host(), CanJoint::kBusHost);
  joint_.set_state(8);  // a heartbeat
  EXPECT_EQ(joint_.joint.enables, 1);
  joint_.set_state(1);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
  EXPECT_EQ(joint_.joint.disables, 1);
  EXPECT_EQ(joint_.heartbeat_result(), 0);
  joint_.set_state(1);
  EXPECT_EQ(joint_.joint.disables, 1);
  EXPECT_EQ(joint_.all_refused(), 0U);
}

TEST_F(ACanNode, RefusesOtherStatesWithAResult) {
  for (const std::uint32_t state : {0U, 2U, 3U, 7U, 9U, 11U, 14U, 0xFFFF'FFFFU})
    joint_.set_state(state);
  EXPECT_EQ(joint_.refused(LinkRefusal::not_supported), 8U);
  EXPECT_EQ(joint_.heartbeat_state(), 1);
  EXPECT_EQ(joint_.heartbeat_result(), 13);
  enable();
  joint_.set_state(3);
  EXPECT_EQ(joint_.heartbeat_state(), 8) << "what is refused changes nothing";
}

TEST_F(ACanNode, FollowsPositionsWithFeedForward) {
  enable();
  joint_.send(set_input_pos, 0.25F, std::int16_t{500}, std::int16_t{-2500});
  EXPECT_EQ(last().mode, JointMode::position);
  EXPECT_NEAR(last().position_rad, 0.25 * kCanTurn_rad, 1e-6);
  EXPECT_NEAR(last().velocity_rad_s, 0.5 * kCanTurn_rad, 1e-6);
  EXPECT_NEAR(last().torque_Nm, -2.5, 1e-6);
}

TEST_F(ACanNode, FollowsVelocities) {
  joint_.set_mode(2);
  enable();
  joint_.send(set_input_vel, -0.5F, 3.0F);
  EXPECT_EQ(last().mode, JointMode::velocity);
  EXPECT_NEAR(last().velocity_rad_s, -0.5 * kCanTurn_rad, 1e-6);
  EXPECT_EQ(last().torque_Nm, 3.0);
  EXPECT_EQ(last().position_rad, 0.0);
}

TEST_F(ACanNode, FollowsTorques) {
  joint_.set_mode(1);
  enable();
  joint_.send(set_input_torque, 7.5F);
  EXPECT_EQ(last().mode, JointMode::torque);
  EXPECT_EQ(last().torque_Nm, 7.5);
  EXPECT_EQ(last().velocity_rad_s, 0.0);
}

// As in an ODrive: inputs that the mode does not control are its feed-forward.
TEST_F(ACanNode, TakesOtherInputsForFeedForward) {
  joint_.joint.values[0] = static_cast<float>(10.0 * kCanTurn_rad);
  joint_.tick();
  enable();
  joint_.send(set_input_vel, 0.1F, 2.0F);
  EXPECT_EQ(last().mode, JointMode::position);
  EXPECT_NEAR(last().position_rad, 0.1 * kCanTurn_rad, 1e-5) << "where it is";
  EXPECT_NEAR(last().velocity_rad_s, 0.1 * kCanTurn_rad, 1e-6);
  joint_.send(set_input_torque, 4.0F);
  EXPECT_NEAR(last().velocity_rad_s, 0.1 * kCanTurn_rad, 1e-6);
  EXPECT_EQ(last().torque_Nm, 4.0);
}

TEST_F(ACanNode, ChangesTheModeWithoutMotion) {
  enable();
  joint_.send(set_input_pos, 0.1F, std::int16_t{9}, std::int16_t{9});
  const std::size_t before = references();
  joint_.set_mode(1);
  EXPECT_EQ(joint_.joint.mode, JointMode::torque);
  EXPECT_EQ(references(), before);
  joint_.send(set_input_torque, 1.0F);
  EXPECT_EQ(last().mode, JointMode::torque);
  EXPECT_EQ(last().velocity_rad_s, 0.0);
  EXPECT_EQ(joint_.all_refused(), 0U);
}

TEST_F(ACanNode, RefusesOtherModes) {
  joint_.set_mode(0);     // voltage
  joint_.set_mode(3, 5);  // trapezoidal trajectory
  joint_.set_mode(3, 0);  // inactive
  joint_.set_mode(4);     // unknown
  joint_.set_mode(~0U, 1);
  EXPECT_EQ(joint_.refused(LinkRefusal::not_supported), 3U);
  EXPECT_EQ(joint_.refused(LinkRefusal::unknown_value), 2U);
  EXPECT_EQ(joint_.line.nodes()[0]->control_mode(), CanSimpleControlMode::position);
}

TEST_F(ACanNode, RefusesNumbersThatAreNotFiniteOrBeyondTheLimits) {
  enable();
  for (const float number : {kCanNaN, kCanInfinity, -kCanInfinity}) {
    joint_.send(set_input_pos, number, std::int16_t{0}, std::int16_t{0});
    joint_.send(set_input_vel, number, 0.0F);
    joint_.send(set_input_vel, 0.0F, number);
    joint_.send(set_input_torque, number);
  }
  EXPECT_EQ(joint_.refused(LinkRefusal::not_finite), 12U);
  joint_.send(set_input_pos, 3e38F, std::int16_t{0},
              std::int16_t{0});          // more radians than a float has
  joint_.send(set_input_torque, 51.0F);  // the joint's own limit
  EXPECT_EQ(joint_.refused(LinkRefusal::out_of_range), 2U);
  EXPECT_EQ(references(), 0U);
  joint_.send(set_input_vel, 0.0F, 0.0F);
  EXPECT_EQ(last().torque_Nm, 0.0) << "what was refused leaves nothing";
}

TEST_F(ACanNode, RefusesFramesThatAreTooShort) {
  enable();
  for (const CanSimpleCommand command : {set_axis_state, set_controller_mode, set_input_pos,
                                         set_input_vel, set_input_torque, set_limits}) {
    joint_.send(command);
    joint_.send(command, std::uint8_t{1}, std::uint16_t{0});
  }
  for (const CanSimpleCommand command :
       {set_controller_mode, set_input_pos, set_input_vel, set_limits})
    joint_.send(command, 1.0F, std::uint16_t{1}, std::uint8_t{1});
  EXPECT_EQ(joint_.refused(LinkRefusal::wrong_length), 16U);
  EXPECT_EQ(references(), 0U);
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled);
}

// Drivers that always send eight bytes.
TEST_F(ACanNode, IgnoresBytesAfterItsNumbers) {
  joint_.send(set_axis_state, std::uint32_t{8}, std::uint32_t{77});
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled);
}

TEST_F(ACanNode, CountsWhatItDoesNotOffer) {
  for (const CanSimpleCommand command :
       {rx_sdo, tx_sdo, address, set_traj_vel_limit, set_traj_accel_limits, set_traj_inertia,
        reboot, set_absolute_position, set_pos_gain, set_vel_gains, enter_dfu_mode})
    joint_.send(command, 1.0F, 1.0F);
  EXPECT_FALSE(joint_.ask(get_temperature));
  EXPECT_FALSE(joint_.ask(get_powers));
  EXPECT_EQ(joint_.refused(LinkRefusal::not_supported), 13U);
  for (const int reserved : {0x08, 0x0A, 0x10, 0x1E})
    joint_.send(static_cast<CanSimpleCommand>(reserved), 1.0F);
  EXPECT_FALSE(joint_.ask(set_input_pos)) << "a remote frame of a command";
  EXPECT_EQ(joint_.refused(LinkRefusal::unknown_message), 5U);
}

TEST_F(ACanNode, IsGivenOnlyItsOwnFrames) {
  CanSimpleLine& line = joint_.line;
  const CanFrame torque = can_frame(can_simple_id(6, set_axis_state), std::uint32_t{8});
  line.receive(torque, joint_.now_ns);
  EXPECT_EQ(line.counts().to_no_node, 1U);
  CanFrame own = can_frame(can_simple_id(CanJoint::kNode, set_axis_state), std::uint32_t{8});
  own.is_extended = true;
  line.receive(own, joint_.now_ns);
  own.id = 0x1234'5678;
  line.receive(own, joint_.now_ns);
  own = can_frame(0xFFFF, std::uint32_t{8});
  line.receive(own, joint_.now_ns);
  EXPECT_EQ(line.counts().extended, 3U);
  own = can_frame(can_simple_id(CanJoint::kNode, set_axis_state), std::uint32_t{8});
  own.is_error = true;
  line.receive(own, joint_.now_ns);
  EXPECT_EQ(line.counts().errors, 1U);
  line.receive(can_frame(can_simple_id(63, set_axis_state), std::uint32_t{8}), joint_.now_ns);
  EXPECT_EQ(line.counts().broadcasts, 1U);
  EXPECT_EQ(line.counts().frames, 0U);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
}

TEST_F(ACanNode, StopsAtEveryEstop) {
  enable();
  joint_.send(estop);
  EXPECT_EQ(joint_.state(), LinkDriveState::stop);
  EXPECT_THAT(joint_.joint.stops, ElementsAre(StopCategory::power_off));
  EXPECT_EQ(joint_.endpoint.counts().stops, 1U);
  joint_.line.receive(can_frame(can_simple_id(63, estop)), joint_.now_ns);
  joint_.send(estop, 1.0F, 1.0F);
  joint_.line.receive({.id = can_simple_id(CanJoint::kNode, estop), .is_remote = true},
                      joint_.now_ns);
  EXPECT_EQ(joint_.endpoint.counts().stops, 4U);
  EXPECT_THAT(joint_.sent.take(), IsEmpty()) << "on the NDLCom line";
}

TEST_F(ACanNode, KeepsAStopUntilTheErrorsAreCleared) {
  enable();
  joint_.send(estop);
  joint_.tick();
  EXPECT_EQ(joint_.ask(get_error),
            can_frame(0xA3, CanSimpleError::kEstopRequested, CanSimpleError::kEstopRequested));
  joint_.set_state(8);
  EXPECT_EQ(joint_.state(), LinkDriveState::stop);
  EXPECT_EQ(joint_.heartbeat_result(), 3);
  joint_.set_state(1);
  EXPECT_EQ(joint_.state(), LinkDriveState::stop) << "idle does not clear errors";
  joint_.joint.at_rest = false;
  joint_.send(clear_errors, std::uint8_t{0});
  EXPECT_EQ(joint_.state(), LinkDriveState::stop) << "the joint moves";
  EXPECT_EQ(joint_.refused(LinkRefusal::not_in_this_state), 2U);
  joint_.joint.at_rest = true;
  joint_.send(clear_errors);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
  EXPECT_EQ(joint_.ask(get_error), can_frame(0xA3, 0U, 0U));
  EXPECT_EQ(joint_.heartbeat_error(), 0U);
  enable();
}

TEST_F(ACanNode, StopsWithinTheTimeOfTheWatchdog) {
  enable();
  for (int n = 0; n < 200; ++n) {
    joint_.send(set_input_pos, 0.0F, std::int16_t{0}, std::int16_t{0});
    joint_.tick();
  }
  for (int n = 0; n < 48; ++n) {
    static_cast<void>(joint_.ask(get_encoder_estimates));  // a request does not move a joint
    joint_.tick();
  }
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled);
  joint_.tick(2);
  EXPECT_EQ(joint_.state(), LinkDriveState::stop);
  EXPECT_EQ(joint_.heartbeat_error(), CanSimpleError::kWatchdogTimerExpired);
  EXPECT_EQ(joint_.endpoint.guard().controlling_host(), 0);
}

TEST_F(ACanNode, IsNotKeptMovingByWhatItRefuses) {
  enable();
  for (int n = 0; n < 60; ++n) {
    joint_.send(set_input_torque, kCanNaN);
    joint_.send(set_input_torque, 99.0F);
    joint_.send(reboot, std::uint8_t{0});
    joint_.tick();
  }
  EXPECT_EQ(joint_.endpoint.drive().reason(), LinkStateReason::host_lost);
}

TEST_F(ACanNode, ReportsAFaultAndItsCause) {
  enable();
  joint_.stop_cause = "measurement";
  joint_.joint.fault = true;
  joint_.tick();
  EXPECT_EQ(joint_.state(), LinkDriveState::fault);
  EXPECT_EQ(joint_.heartbeat_error(), CanSimpleError::kMissingEstimate);
  joint_.stop_cause = "overload";
  EXPECT_EQ(number_in<std::uint32_t>(*joint_.ask(get_error), 0), CanSimpleError::kSystemLevel);
  joint_.send(clear_errors);
  EXPECT_EQ(joint_.state(), LinkDriveState::fault) << "its cause is still there";
  joint_.joint.fault = false;
  joint_.send(clear_errors);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
  EXPECT_EQ(joint_.heartbeat_error(), 0U);
}

TEST_F(ACanNode, ClearsAFaultWithAStopThatCameInIt) {
  joint_.joint.fault = true;
  joint_.tick();
  joint_.send(estop);
  joint_.joint.fault = false;
  joint_.send(clear_errors);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
}

TEST_F(ACanNode, ReportsWhyItStopped) {
  struct Case {
    LinkStateReason reason;
    std::uint32_t error;
  };
  for (const auto& [reason, error] :
       {Case{LinkStateReason::requested, CanSimpleError::kEstopRequested},
        Case{LinkStateReason::host_released, CanSimpleError::kMissingInput},
        Case{LinkStateReason::clock, CanSimpleError::kTimingError},
        Case{LinkStateReason::joint_fault, CanSimpleError::kSystemLevel}}) {
    enable();
    joint_.joint.stopped_by = reason;
    joint_.tick();
    EXPECT_EQ(joint_.heartbeat_error(), error) << name(reason);
    joint_.joint.stopped_by = LinkStateReason::none;
    joint_.send(clear_errors);
  }
}

TEST_F(ACanNode, InitialisesFirst) {
  CanJoint starting(0.0, false);
  EXPECT_EQ(starting.heartbeat_error(), CanSimpleError::kInitializing);
  starting.set_state(8);
  EXPECT_EQ(starting.state(), LinkDriveState::initialising);
  EXPECT_EQ(starting.heartbeat_result(), 3);
  starting.joint.initialised = true;
  starting.tick();
  EXPECT_EQ(starting.heartbeat_error(), 0U);
}

TEST_F(ACanNode, IsNotCommandedWhileAnotherHostIsInControl) {
  send_ndlcom(LinkStateChange{.command = LinkStateCommand::enable});
  ASSERT_EQ(joint_.state(), LinkDriveState::enabled);
  joint_.tick();
  EXPECT_EQ(joint_.heartbeat_state(), 8);
  joint_.send(set_input_pos, 0.1F, std::int16_t{0}, std::int16_t{0});
  joint_.set_mode(1);
  joint_.set_state(1);
  joint_.set_state(8);
  EXPECT_EQ(joint_.heartbeat_result(), 2);
  joint_.send(set_limits, 1.0F, 1.0F);
  EXPECT_EQ(joint_.refused(LinkRefusal::other_host), 5U);
  EXPECT_EQ(joint_.endpoint.guard().refused(CommandGuard::Refusal::other_host), 5U);
  EXPECT_EQ(references(), 0U);
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled);
  joint_.send(estop);
  EXPECT_EQ(joint_.state(), LinkDriveState::stop) << "any host may stop";
}

TEST_F(ACanNode, KeepsOtherHostsFromCommandsWhileItsBusIsInControl) {
  enable();
  send_ndlcom(LinkReference{.deadline_ns = joint_.now_ns + 40'000'000, .mode = JointMode::torque});
  send_ndlcom(LinkStateChange{.command = LinkStateCommand::disable});
  EXPECT_EQ(joint_.endpoint.guard().refused(CommandGuard::Refusal::other_host), 2U);
  EXPECT_EQ(references(), 0U);
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled);
  joint_.set_state(1);
  joint_.tick(60);  // the bus is silent for longer than the watchdog's time
  send_ndlcom(LinkStateChange{.command = LinkStateCommand::enable});
  EXPECT_EQ(joint_.endpoint.guard().controlling_host(), 200);
}

// An NDLCom frame with the id of the bus as its sender would take over its control.
TEST_F(ACanNode, IsNotImpersonatedOnTheOtherLine) {
  HostEndpoint impostor({.id = CanJoint::kBusHost, .joint = CanJoint::kNode});
  test::LinkBytes frame(kNdlcomMaxEncodedBytes);
  frame.resize(impostor.build(LinkStateChange{.command = LinkStateCommand::enable}, frame));
  joint_.endpoint.receive(frame, joint_.now_ns);
  EXPECT_EQ(joint_.endpoint.counts().without_sender, 1U);
  EXPECT_EQ(joint_.state(), LinkDriveState::ready);
}

TEST_F(ACanNode, FollowsAnInputThatCameBeforeTheBrakeWasOpen) {
  joint_.joint.values[5] = 0.0F;
  joint_.tick();
  enable();
  joint_.send(set_input_pos, 0.1F, std::int16_t{0}, std::int16_t{0});
  for (int n = 0; n < 100; ++n) {
    joint_.send(set_input_pos, 0.125F, std::int16_t{0}, std::int16_t{0});
    joint_.tick();
  }
  EXPECT_EQ(joint_.state(), LinkDriveState::enabled) << "inputs keep it enabled";
  EXPECT_EQ(references(), 0U);
  joint_.joint.values[5] = 1.0F;
  joint_.tick();
  ASSERT_EQ(references(), 1U);
  EXPECT_NEAR(last().position_rad, 0.125 * kCanTurn_rad, 1e-6);
  EXPECT_EQ(joint_.all_refused(), 0U);
}

TEST_F(ACanNode, DoesNotFollowAnInputThatHasWaitedForTooLong) {
  joint_.joint.values[5] = 0.0F;
  joint_.tick();
  enable();
  joint_.send(set_input_pos, 0.1F, std::int16_t{0}, std::int16_t{0});
  joint_.tick(55);
  joint_.joint.values[5] = 1.0F;
  joint_.tick();
  EXPECT_EQ(joint_.state(), LinkDriveState::stop);
  EXPECT_EQ(references(), 0U);
}

TEST_F(ACanNode, SetsLimitsWithinThoseOfTheJoint) {
  joint_.send(set_limits, 0.5F, 3.0F);
  EXPECT_NEAR(joint_.largest_speed_rad_s, 0.5 * kCanTurn_rad, 1e-6);
  EXPECT_NEAR(joint_.largest_torque_Nm, 3.0 * 0.1 * 100.0, 1e-6);
  joint_.send(set_limits, kCanInfinity, 1000.0F);
  EXPECT_EQ(joint_.largest_speed_rad_s, 4.0);
  EXPECT_EQ(joint_.largest_torque_Nm, 50.0);
  joint_.send(set_limits, kCanNaN, 1.0F);
  joint_.send(set_limits, 1.0F, kCanNaN);
  EXPECT_EQ(joint_.refused(LinkRefusal::not_finite), 2U);
  joint_.send(set_limits, 0.0F, 1.0F);
  joint_.send(set_limits, 1.0F, -1.0F);
  EXPECT_EQ(joint_.refused(LinkRefusal::out_of_range), 2U);
  enable();
  joint_.send(set_limits, 0.25F, 1.0F);
  EXPECT_EQ(joint_.refused(LinkRefusal::only_when_disabled), 1U);
  EXPECT_EQ(joint_.largest_speed_rad_s, 4.0);
}

TEST(ACanNodeWithCyclicFrames, SendsThem) {
  CanJoint joint(10.0);
  joint.bus.take();
  joint.tick(1000);
  std::map<std::uint32_t, int> counts;
  for (const CanFrame& frame : joint.bus.take()) ++counts[frame.id];
  EXPECT_THAT(counts,
              ElementsAre(std::pair(0xA1U, 10), std::pair(0xA3U, 10), std::pair(0xA9U, 10),
                          std::pair(0xB4U, 10), std::pair(0xB7U, 10), std::pair(0xBCU, 10)));
}

TEST(ACanNodeWithCyclicFrames, SendsAChangeOfItsHeartbeatAtOnce) {
  CanJoint joint(1.0);
  joint.tick(10);
  joint.bus.take();
  joint.set_state(8);
  joint.tick();
  EXPECT_THAT(joint.bus.take(),
              ElementsAre(CanFrame{.id = 0xA1, .size = 8, .data = {0, 0, 0, 0, 8, 1, 0, 0}}));
}

TEST(ACanNodeWithCyclicFrames, CountsFramesThatTheBusDoesNotTake) {
  CanJoint joint(1000.0);
  joint.bus.takes = false;
  joint.tick(10);
  EXPECT_EQ(joint.line.nodes()[0]->not_sent(), 60U);
}

TEST(CanSimpleNode, RefusesJointsThatItCannotServe) {
  CanJoint joint;
  const auto message = [&](const CanSimpleNode::Settings& settings, const LinkJoint& of,
                           JointEndpoint& endpoint, const RegisterTable& table) {
    return test::error_message([&] { CanSimpleNode(settings, endpoint, of, table, joint.bus); });
  };
  EXPECT_THAT(message({.node = 63}, joint.joint, joint.endpoint, joint.table),
              HasSubstr("CAN node 63: expected a number of 0 to 62, found 63"));
  EXPECT_THAT(
      message({.node = 1, .estimate_rate_Hz = 2000.0}, joint.joint, joint.endpoint, joint.table),
      HasSubstr("expected 0 to 1000 Hz, found 2000"));
  EXPECT_THAT(message({.node = 1, .status_rate_Hz = std::nan("")}, joint.joint, joint.endpoint,
                      joint.table),
              HasSubstr("found nan"));
  const test::RecordingJoint bare;
  EXPECT_THAT(message({.node = 1}, bare, joint.endpoint, joint.table),
              HasSubstr("expected the channel motor_angle_rad, found a joint without it"));
  const RegisterTable empty({});
  EXPECT_THAT(message({.node = 1}, joint.joint, joint.endpoint, empty),
              HasSubstr("expected the register gear_ratio"));
  JointEndpoint without_bus({.id = 1}, joint.joint, joint.table, joint.sent);
  EXPECT_THAT(message({.node = 1}, joint.joint, without_bus, joint.table),
              HasSubstr("expected an endpoint with a bus_host, found none"));
  EXPECT_THAT(test::error_message([&] {
                JointEndpoint({.id = 9, .bus_host = 9}, joint.joint, joint.table, joint.sent);
              }),
              HasSubstr("another id of the host of the bus"));
}

TEST(CanSimpleLine, RefusesANumberTwice) {
  CanJoint joint;
  std::vector<std::unique_ptr<CanSimpleNode>> nodes;
  for (int n = 0; n < 2; ++n)
    nodes.push_back(std::make_unique<CanSimpleNode>(
        CanSimpleNode::Settings{.node = 3}, joint.endpoint, joint.joint, joint.table, joint.bus));
  EXPECT_THAT(test::error_message([&] { CanSimpleLine line(std::move(nodes)); }),
              HasSubstr("CAN bus: expected a number per node, found 3 twice"));
}

}  // namespace
}  // namespace torsio
