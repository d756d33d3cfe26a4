#include "torsio/sim/joints/joint_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "sim/joints/hosted_joints.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {
namespace {

using test::HostedJoint;
using test::HostedJoints;
using testing::HasSubstr;

class AServedJoint : public testing::Test {
 protected:
  HostedJoints hosted_{HostedJoints::single("dfki-50")};
  HostedJoint& joint_ = hosted_.joints[0];

  /// Moves within a second to an angle, and waits there.
  void move_to(double angle_rad) {
    const double start_rad = joint_[JointChannel::joint_angle];
    for (int n = 0; n < 1500; ++n) {
      const double s = std::min(1.0, n / 1000.0);
      const double smooth = s * s * (3.0 - 2.0 * s);
      hosted_.follow(
          joint_,
          {.mode = JointMode::position,
           .position_rad = static_cast<float>(start_rad + smooth * (angle_rad - start_rad))});
      hosted_.tick();
    }
  }
};

TEST_F(AServedJoint, HoldsItsPositionFromTheEnableToTheFirstReference) {
  const double start_rad = joint_[JointChannel::joint_angle];
  ASSERT_TRUE(hosted_.start());
  hosted_.hold(500);
  EXPECT_EQ(hosted_.state(), LinkDriveState::enabled);
  EXPECT_NEAR(joint_[JointChannel::joint_angle], start_rad, 2e-3);
}

TEST_F(AServedJoint, FollowsPositions) {
  ASSERT_TRUE(hosted_.start());
  move_to(0.5);
  EXPECT_NEAR(joint_[JointChannel::joint_angle], 0.5, 0.05);
  EXPECT_EQ(joint_[JointChannel::reference_mode], static_cast<double>(JointMode::position));
  EXPECT_NEAR(joint_[JointChannel::torque], joint_[JointChannel::truth_torque], 2.0);
}

TEST_F(AServedJoint, FollowsTorques) {
  ASSERT_TRUE(hosted_.start());
  move_to(0.5);
  const double carried_Nm = joint_[JointChannel::torque];
  hosted_.follow(joint_, {.mode = JointMode::torque, .torque_Nm = static_cast<float>(carried_Nm)},
                 300);
  EXPECT_NEAR(joint_[JointChannel::torque], carried_Nm, 1.0);
  EXPECT_EQ(hosted_.state(), LinkDriveState::enabled);
}

TEST_F(AServedJoint, IsSoftInAnImpedance) {
  ASSERT_TRUE(hosted_.start());
  hosted_.follow(joint_,
                 {.mode = JointMode::impedance,
                  .position_rad = 0.3F,
                  .stiffness_Nm_rad = 40.0F,
                  .damping_Nms_rad = 4.0F},
                 2000);
  EXPECT_GT(joint_[JointChannel::joint_angle], 0.15);
  EXPECT_LT(joint_[JointChannel::joint_angle], 0.3);
}

TEST_F(AServedJoint, RefusesReferencesBeyondItsLimits) {
  ASSERT_TRUE(hosted_.start());
  const auto refusal = [&](LinkReference reference) {
    reference.deadline_ns = hosted_.now_ns + 40 * HostedJoints::kTick_ns;
    return hosted_.command(joint_, reference);
  };
  const LinkRefusal beyond = LinkRefusal::out_of_range;
  EXPECT_EQ(refusal({.mode = JointMode::position, .position_rad = 3.0F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::torque, .torque_Nm = 51.0F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::velocity, .velocity_rad_s = 100.0F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::current, .current_A = 1e3F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::impedance, .stiffness_Nm_rad = -1.0F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::impedance, .stiffness_Nm_rad = 1e5F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::impedance, .damping_Nms_rad = -1.0F}), beyond);
  EXPECT_EQ(refusal({.mode = JointMode::deflection, .deflection_rad = 1.0F}), beyond);
  EXPECT_EQ(
      refusal({.mode = JointMode::torque, .torque_Nm = std::numeric_limits<float>::quiet_NaN()}),
      LinkRefusal::not_finite);
  EXPECT_EQ(refusal({.mode = JointMode::torque, .torque_Nm = 1.0F}), std::nullopt);
  EXPECT_EQ(hosted_.state(), LinkDriveState::enabled);
}

TEST_F(AServedJoint, StopsWhenItsHostIsSilent) {
  ASSERT_TRUE(hosted_.start());
  hosted_.tick(60);
  EXPECT_EQ(hosted_.state(), LinkDriveState::stop);
  EXPECT_EQ(hosted_.server.joints()[0].reason, LinkStateReason::host_lost);
  hosted_.tick(500);
  EXPECT_EQ(joint_[JointChannel::phase], static_cast<double>(JointStop::Phase::off));
  EXPECT_EQ(hosted_.change(joint_, LinkStateCommand::enable), LinkRefusal::not_in_this_state);
  EXPECT_EQ(hosted_.change(joint_, LinkStateCommand::disable), LinkRefusal::none);
  hosted_.tick(2);
  EXPECT_TRUE(hosted_.start()) << "after a stop it can be enabled again";
}

TEST_F(AServedJoint, SurvivesAClockThatJumps) {
  ASSERT_TRUE(hosted_.start());
  hosted_.now_ns -= 500'000'000;
  hosted_.tick(5);
  EXPECT_EQ(hosted_.state(), LinkDriveState::stop);
  EXPECT_EQ(hosted_.server.joints()[0].reason, LinkStateReason::clock);
}

TEST_F(AServedJoint, ListensToOneHostAtATime) {
  ASSERT_TRUE(hosted_.start());
  HostedJoint other(1, 253);
  hosted_.send(other, LinkPing{.token = 7});
  hosted_.server.cycle(hosted_.now_ns += HostedJoints::kTick_ns);
  other.receive(hosted_.line.to_hosts);
  ASSERT_GT(other.host.clock_ns(), 0U);
  hosted_.follow(other, {.mode = JointMode::torque, .torque_Nm = 20.0F});
  hosted_.hold(3);
  EXPECT_NE(joint_[JointChannel::reference_torque], 20.0);
  EXPECT_EQ(
      hosted_.server.joints()[0].counts.refused[static_cast<std::size_t>(LinkRefusal::other_host)],
      1U);
}

TEST_F(AServedJoint, ContinuesWhenItsHostStopsReading) {
  ASSERT_TRUE(hosted_.start());
  hosted_.line.is_read = false;
  hosted_.tick(100);
  EXPECT_EQ(hosted_.state(), LinkDriveState::stop);
  EXPECT_GT(hosted_.server.line().transport.not_sent, 50U);
}

TEST_F(AServedJoint, ChangesItsModeWithoutAJump) {
  ASSERT_TRUE(hosted_.start());
  move_to(0.5);
  const double angle_rad = joint_[JointChannel::joint_angle];
  for (const JointMode mode : {JointMode::impedance, JointMode::torque, JointMode::position}) {
    ASSERT_EQ(hosted_.command(joint_, LinkModeChange{.mode = mode}), LinkRefusal::none);
    hosted_.hold(200);
    EXPECT_EQ(joint_[JointChannel::reference_mode], static_cast<double>(mode));
    EXPECT_NEAR(joint_[JointChannel::joint_angle], angle_rad, 0.03) << name(mode);
  }
}

TEST_F(AServedJoint, HasRegistersThatLimitAndTuneIt) {
  const std::string all = hosted_.server.registers(1);
  for (const char* name : {"actuator", "rated_torque_Nm", "largest_torque_Nm", "position_gain_1_s",
                           "watchdog_s", "stop_phase", "executed_commands", "thermal_load_1"})
    EXPECT_THAT(all, HasSubstr("\"" + std::string(name) + "\""));
  const auto write = [&](std::uint16_t index, const LinkValue& value) {
    return hosted_.command(joint_, LinkRegisterWrite{.index = index, .value = value});
  };
  constexpr std::uint16_t kHighest = 9;  // highest_angle_rad
  constexpr std::uint16_t kTorque = 11;  // largest_torque_Nm
  constexpr std::uint16_t kGain = 12;    // position_gain_1_s
  EXPECT_EQ(write(kHighest, LinkValue::of(1.0)), LinkRefusal::none);
  EXPECT_EQ(write(kHighest, LinkValue::of(3.0)), LinkRefusal::out_of_range);
  EXPECT_EQ(write(kHighest, LinkValue::of(-1.0)), LinkRefusal::out_of_range)
      << "the joint is at 0 rad";
  EXPECT_EQ(write(kTorque, LinkValue::of(std::int32_t{3})), LinkRefusal::wrong_type);
  EXPECT_EQ(write(0, LinkValue::of("dfki-28")), LinkRefusal::read_only);
  ASSERT_TRUE(hosted_.start());
  EXPECT_EQ(write(kHighest, LinkValue::of(0.5)), LinkRefusal::only_when_disabled);
  EXPECT_EQ(write(kGain, LinkValue::of(15.0)), LinkRefusal::none);
  hosted_.send(joint_, LinkRegisterRead{.index = kGain});
  hosted_.hold(1);
  ASSERT_TRUE(joint_.value);
  EXPECT_EQ(joint_.value->float64, 15.0);
  EXPECT_EQ(hosted_.command(joint_, LinkReference{.deadline_ns = hosted_.now_ns + 40'000'000,
                                                  .mode = JointMode::position,
                                                  .position_rad = 1.2F}),
            LinkRefusal::out_of_range);
}

TEST_F(AServedJoint, SetsZerosOnlyWhileItIsDisabled) {
  constexpr auto kTorqueChannel = static_cast<std::uint8_t>(JointChannel::torque);
  const double before_Nm = joint_[JointChannel::torque];
  EXPECT_EQ(hosted_.command(joint_, LinkZero{.channel = kTorqueChannel, .value = 3.0}),
            LinkRefusal::none);
  hosted_.tick(100);
  EXPECT_NEAR(joint_[JointChannel::torque], 3.0, 0.1 + std::abs(before_Nm) * 0.1);
  EXPECT_EQ(hosted_.command(joint_, LinkZero{.channel = kTorqueChannel, .value = 0.0}),
            LinkRefusal::none);
  hosted_.tick(100);
  const double gear_rad = joint_[JointChannel::gear_angle];
  EXPECT_EQ(hosted_.command(joint_, LinkZero{.channel = 1, .value = gear_rad + 1e-3}),
            LinkRefusal::none);
  hosted_.tick(100);
  EXPECT_NEAR(joint_[JointChannel::gear_angle], gear_rad + 1e-3, 1e-4);
  EXPECT_EQ(hosted_.command(joint_, LinkZero{.channel = 9, .value = 0.0}),
            LinkRefusal::not_supported);
  ASSERT_TRUE(hosted_.start());
  EXPECT_EQ(hosted_.command(joint_, LinkZero{.channel = kTorqueChannel, .value = 0.0}),
            LinkRefusal::only_when_disabled);
}

TEST_F(AServedJoint, IsInFaultWithoutASensorUntilTheFaultEnds) {
  ASSERT_TRUE(hosted_.start());
  EXPECT_EQ(
      hosted_.command(joint_, LinkInjectFault{.fault = "nan", .channel = 2, .duration_s = 0.5F}),
      LinkRefusal::none);
  hosted_.hold(20);
  EXPECT_EQ(hosted_.state(), LinkDriveState::fault);
  EXPECT_EQ(hosted_.change(joint_, LinkStateCommand::reset_fault), LinkRefusal::not_in_this_state);
  hosted_.tick(1500);
  EXPECT_EQ(hosted_.change(joint_, LinkStateCommand::reset_fault), LinkRefusal::none);
  EXPECT_EQ(hosted_.state(), LinkDriveState::ready);
  hosted_.tick(2);
  EXPECT_TRUE(hosted_.start());
}

TEST_F(AServedJoint, InjectsFaultsOfSensorsAndPartsAndEndsThem) {
  const double motor_rad = joint_[JointChannel::motor_angle];
  EXPECT_EQ(
      hosted_.command(joint_, LinkInjectFault{.fault = "jump", .channel = 0, .magnitude = 0.5}),
      LinkRefusal::none);
  hosted_.tick(3);
  EXPECT_NEAR(joint_[JointChannel::motor_angle], motor_rad + 0.5, 0.01);
  EXPECT_EQ(hosted_.command(joint_, LinkInjectFault{}), LinkRefusal::none);
  hosted_.tick(3);
  EXPECT_NEAR(joint_[JointChannel::motor_angle], motor_rad, 0.01);
  for (const LinkInjectFault& fault :
       {LinkInjectFault{.fault = "break", .magnitude = 0.5},
        LinkInjectFault{.fault = "bottom", .magnitude = 0.1},
        LinkInjectFault{.fault = "friction", .magnitude = 2.0},
        LinkInjectFault{.fault = "torque-constant", .magnitude = 0.9}})
    EXPECT_EQ(hosted_.command(joint_, fault), LinkRefusal::none) << fault.fault;
  EXPECT_EQ(hosted_.command(joint_, LinkInjectFault{.fault = "melt"}), LinkRefusal::unknown_value);
  EXPECT_EQ(
      hosted_.command(joint_, LinkInjectFault{.fault = "jump", .channel = 3, .magnitude = 1.0}),
      LinkRefusal::out_of_range);
  EXPECT_EQ(hosted_.command(joint_, LinkInjectFault{.fault = "friction", .magnitude = -1.0}),
            LinkRefusal::out_of_range);
  // Only an encoder has turns, and only whole ones.
  for (const LinkInjectFault& fault :
       {LinkInjectFault{.fault = "wrap", .channel = 4, .magnitude = 1.0},
        LinkInjectFault{.fault = "wrap", .channel = 0, .magnitude = 1.5}})
    EXPECT_EQ(hosted_.command(joint_, fault), LinkRefusal::out_of_range) << fault.channel;
  for (int n = 0; n < 20; ++n)
    static_cast<void>(hosted_.command(joint_, LinkInjectFault{.fault = "jump", .magnitude = 0.1}));
  EXPECT_EQ(hosted_.command(joint_, LinkInjectFault{.fault = "jump", .magnitude = 0.1}),
            LinkRefusal::not_in_this_state);
  hosted_.tick(100);
  EXPECT_TRUE(std::isfinite(joint_[JointChannel::truth_torque]));
}

TEST(JointServer, DrivesEveryActuatorWithASpringAtItsOutput) {
  for (const DataSheet& sheet : data_sheets()) {
    SCOPED_TRACE(sheet.name);
    if (sheet.family == ActuatorFamily::harmonic_drive) continue;
    HostedJoints hosted(HostedJoints::single(sheet.name));
    HostedJoint& joint = hosted.joints[0];
    ASSERT_TRUE(hosted.start());
    for (int n = 0; n < 2000; ++n) {
      hosted.follow(joint,
                    {.mode = JointMode::position,
                     .position_rad = 0.2F * std::min(1.0F, static_cast<float>(n) / 1000.0F)});
      hosted.tick();
    }
    EXPECT_NEAR(joint[JointChannel::joint_angle], 0.2, 0.1);
    EXPECT_EQ(hosted.state(), LinkDriveState::enabled);
    hosted.follow(
        joint,
        {.mode = JointMode::torque, .torque_Nm = static_cast<float>(joint[JointChannel::torque])},
        500);
    EXPECT_LT(std::abs(joint[JointChannel::joint_speed]), 0.5);
    EXPECT_EQ(hosted.state(), LinkDriveState::enabled);
  }
}

TEST(JointServer, ServesTheJointsOfAnArmTogether) {
  std::vector<ServedArm> arms;
  arms.push_back({.setup = arm6_setup()});
  HostedJoints hosted(std::move(arms));
  ASSERT_EQ(hosted.joints.size(), 6U);
  for (std::size_t j = 0; j < 5; ++j)
    ASSERT_EQ(hosted.change(hosted.joints[j], LinkStateCommand::enable), LinkRefusal::none);
  hosted.hold(5);
  hosted.follow(hosted.joints[0], {.mode = JointMode::position});
  hosted.hold(2);
  EXPECT_EQ(hosted.joints[0].reply, LinkRefusal::not_in_this_state) << "not before all are enabled";
  ASSERT_EQ(hosted.change(hosted.joints[5], LinkStateCommand::enable), LinkRefusal::none);
  hosted.hold(1500);
  ASSERT_EQ(hosted.joints[0][JointChannel::is_ready], 1.0);
  const double start_rad = hosted.joints[3][JointChannel::joint_angle];
  for (int n = 0; n < 1500; ++n) {
    hosted.follow(
        hosted.joints[3],
        {.mode = JointMode::position,
         .position_rad = static_cast<float>(start_rad + 0.2 * std::min(1.0, n / 1000.0))});
    hosted.hold(1);
  }
  EXPECT_NEAR(hosted.joints[3][JointChannel::joint_angle], start_rad + 0.2, 0.05);
  hosted.send(hosted.joints[1], LinkStop{.category = 1});
  hosted.hold(2);
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(hosted.state(j), LinkDriveState::stop) << j;
  hosted.tick(1000);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_EQ(hosted.change(hosted.joints[j], LinkStateCommand::disable), LinkRefusal::none) << j;
  hosted.tick(2);
  ASSERT_TRUE(hosted.start());
  ASSERT_EQ(hosted.command(hosted.joints[2], LinkInjectFault{.fault = "nan", .channel = 1}),
            LinkRefusal::none);
  hosted.hold(20);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_EQ(hosted.state(j), j == 2 ? LinkDriveState::fault : LinkDriveState::stop) << j;
  EXPECT_EQ(hosted.server.joints()[0].reason, LinkStateReason::joint_fault);
}

TEST(JointServer, TwelveJointsFollowEveryReferenceForTenMinutes) {
  constexpr int kCycles = 600'000;
  constexpr int kRenewal = 30'000;
  std::vector<ServedArm> arms;
  for (std::uint8_t id = 1; id <= 12; ++id)
    arms.push_back({.setup = single_joint_setup(data_sheet("dfki-28")), .first_id = id});
  HostedJoints hosted(std::move(arms));
  ASSERT_TRUE(hosted.start());
  const auto before = hosted.server.joints();
  for (int n = 0; n < kCycles; ++n) {
    for (HostedJoint& joint : hosted.joints) {
      if (n % kRenewal == 0) hosted.subscribe(joint);
      hosted.follow(joint, {.mode = JointMode::position,
                            .position_rad = static_cast<float>(0.2 * std::sin(1e-3 * n))});
    }
    hosted.tick();
  }
  const auto after = hosted.server.joints();
  for (std::size_t j = 0; j < after.size(); ++j) {
    EXPECT_EQ(after[j].state, LinkDriveState::enabled);
    EXPECT_EQ(after[j].counts.executed - before[j].counts.executed, std::uint64_t{kCycles});
  }
}

TEST(JointServer, RefusesIdsThatItCannotGive) {
  test::MemoryLine line;
  const auto message = [&](std::uint8_t first, std::uint8_t second) {
    std::vector<ServedArm> arms;
    for (const std::uint8_t id : {first, second})
      arms.push_back({.setup = single_joint_setup(data_sheet("dfki-28")), .first_id = id});
    return test::error_message([&] { JointServer server(std::move(arms), {}, line); });
  };
  EXPECT_THAT(message(3, 3), HasSubstr("an id per joint, found 3 twice"));
  EXPECT_THAT(message(1, 255), HasSubstr("an id of 1 to 254, found 255"));
  EXPECT_THAT(test::error_message([] {
                static_cast<void>(single_joint_setup(data_sheet("dfki-28"), {.mass_kg = 40.0}));
              }),
              HasSubstr("weight of the links is beyond the rating"));
  EXPECT_THAT(test::error_message(
                  [] { static_cast<void>(single_joint_setup(data_sheet("harmonic-drive"))); }),
              HasSubstr("torsion tube before its last gear"));
}

}  // namespace
}  // namespace torsio
