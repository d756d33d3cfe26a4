#include "torsio/link/drive_state.hpp"

#include <gtest/gtest.h>

namespace torsio {
namespace {

using State = LinkDriveState;
using Wanted = LinkStateCommand;

DriveState ready_drive() {
  DriveState drive;
  drive.initialised();
  return drive;
}

DriveState enabled_drive() {
  DriveState drive = ready_drive();
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::none);
  return drive;
}

TEST(DriveState, CanBeEnabledOnlyWhenItIsReady) {
  DriveState drive;
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::not_in_this_state);
  drive.initialised();
  EXPECT_EQ(drive.state(), State::ready);
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::none);
  EXPECT_TRUE(drive.is_enabled());
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::disable, false, false), LinkRefusal::none);
  EXPECT_EQ(drive.state(), State::ready);
  EXPECT_EQ(drive.request(Wanted::disable, false, false), LinkRefusal::none);
}

TEST(DriveState, AStopIsLatchedUntilItIsDisabledAtRest) {
  DriveState drive = enabled_drive();
  EXPECT_TRUE(drive.stop(LinkStateReason::host_lost));
  EXPECT_FALSE(drive.stop(LinkStateReason::requested));
  EXPECT_EQ(drive.reason(), LinkStateReason::host_lost);
  EXPECT_FALSE(drive.is_disabled());
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::reset_fault, true, false), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::disable, false, false), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::disable, true, false), LinkRefusal::none);
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::none);
}

TEST(DriveState, AStopHoldsInAJointThatIsNotEnabled) {
  DriveState drive = ready_drive();
  EXPECT_TRUE(drive.stop(LinkStateReason::requested));
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::not_in_this_state);
  DriveState starting;
  EXPECT_FALSE(starting.stop(LinkStateReason::requested));
  EXPECT_EQ(starting.state(), State::initialising);
  starting.initialised();
  EXPECT_EQ(starting.state(), State::stop);
}

TEST(DriveState, AFaultIsStrongerThanAStopAndResetWhenItsCauseHasEnded) {
  DriveState drive = enabled_drive();
  EXPECT_TRUE(drive.stop(LinkStateReason::requested));
  EXPECT_TRUE(drive.fault());
  EXPECT_FALSE(drive.fault());
  EXPECT_EQ(drive.reason(), LinkStateReason::joint_fault);
  EXPECT_EQ(drive.request(Wanted::disable, true, false), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::reset_fault, true, true), LinkRefusal::not_in_this_state);
  EXPECT_EQ(drive.request(Wanted::reset_fault, true, false), LinkRefusal::none);
  EXPECT_EQ(drive.state(), State::ready);
}

TEST(DriveState, AStopInAFaultHoldsAfterTheReset) {
  DriveState drive = enabled_drive();
  drive.fault();
  EXPECT_FALSE(drive.stop(LinkStateReason::requested));
  EXPECT_EQ(drive.request(Wanted::reset_fault, true, false), LinkRefusal::none);
  EXPECT_EQ(drive.state(), State::stop);
  EXPECT_EQ(drive.request(Wanted::enable, true, false), LinkRefusal::not_in_this_state);
}

TEST(DriveState, HeartbeatAndReleaseChangeNothing) {
  DriveState drive = enabled_drive();
  EXPECT_EQ(drive.request(Wanted::heartbeat, true, false), LinkRefusal::none);
  EXPECT_EQ(drive.request(Wanted::release, true, false), LinkRefusal::none);
  EXPECT_TRUE(drive.is_enabled());
}

}  // namespace
}  // namespace torsio
