#include "torsio/data/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

Recording short_recording() {
  Recording recording("bench", 500.0, 2.0);
  recording.add({.name = "angle_rad", .values = {0.0, 0.1, 0.2}});
  recording.add({.name = "torque_Nm", .values = {1.0, 1.0, 2.0}, .fresh = {1, 0, 1}});
  return recording;
}

TEST(Recording, KnowsItsClock) {
  EXPECT_EQ(short_recording().size(), 3U);
  EXPECT_DOUBLE_EQ(short_recording().time_s(2), 2.004);
  EXPECT_THROW(Recording("x", 0.0), Error);
  EXPECT_THROW(Recording("x", -1.0), Error);
  EXPECT_THROW(Recording("x", std::nan("")), Error);
}

TEST(Recording, DistinguishesNewSamplesFromHeldOnes) {
  const Recording recording = short_recording();
  EXPECT_TRUE(recording.channel("angle_rad").is_fresh(1));
  EXPECT_FALSE(recording.channel("torque_Nm").is_fresh(1));
  EXPECT_TRUE(recording.channel("torque_Nm").is_fresh(2));
}

TEST(Recording, APartHasItsSamplesAndItsTime) {
  const Recording part = short_recording().part(1, 3);
  EXPECT_EQ(part.size(), 2U);
  EXPECT_DOUBLE_EQ(part.time_s(0), short_recording().time_s(1));
  EXPECT_EQ(part.channel("angle_rad").values, (std::vector<double>{0.1, 0.2}));
  EXPECT_EQ(part.channel("torque_Nm").fresh, (std::vector<std::uint8_t>{0, 1}));
}

TEST(Recording, AnUnknownChannelIsAnErrorThatListsTheKnownOnes) {
  try {
    static_cast<void>(short_recording().channel("torqe_Nm"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              "bench: there is no channel 'torqe_Nm'; found the channels angle_rad, torque_Nm\n"
              "  Did you mean 'torque_Nm'?");
  }
}

TEST(Recording, RefusesChannelsThatDoNotFit) {
  Recording recording = short_recording();
  EXPECT_THROW(recording.add({.name = "b_rad", .values = {1.0}}), Error);
  EXPECT_THROW(recording.add({.name = "angle_rad", .values = {1.0, 2.0, 3.0}}), Error);
  EXPECT_THROW(recording.add({.name = "b_deg", .values = {1.0, 2.0, 3.0}}), Error);
  EXPECT_THROW(recording.add({.name = "b", .values = {1.0, 2.0, 3.0}}), Error);
  EXPECT_THROW(recording.add({.name = "b_rad", .values = {1.0, 2.0, 3.0}, .fresh = {1}}), Error);
}

TEST(Recording, AConditionIsAConstantChannel) {
  Recording recording = short_recording();
  recording.add_condition("support_m", 0.033);
  EXPECT_EQ(recording.channel("support_m").values, std::vector<double>(3, 0.033));
  EXPECT_EQ(recording.conditions(), std::vector<std::string>{"support_m"});
  EXPECT_THROW(recording.add_condition("temperature_K", std::nan("")), Error);
}

}  // namespace
}  // namespace torsio
