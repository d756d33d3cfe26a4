#include "data/resample.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "data/interpolate.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

Recording sine(double rate_Hz, double frequency_Hz, std::size_t samples) {
  Recording recording("sine", rate_Hz, 1.0);
  std::vector<double> values(samples);
  for (std::size_t i = 0; i < samples; ++i)
    values[i] = std::sin(2.0 * std::numbers::pi * frequency_Hz * static_cast<double>(i) / rate_Hz);
  recording.add({.name = "angle_rad", .values = values});
  return recording;
}

TEST(Resample, AStraightLineStaysExactAtEveryRate) {
  EXPECT_TRUE(rc::check([] {
    const double from_Hz = *rc::gen::inRange(50, 2000);
    const double to_Hz = *rc::gen::inRange(50, 2000);
    Recording line("line", from_Hz);
    std::vector<double> values(500);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = 3.0 + line.time_s(i);
    line.add({.name = "x_m", .values = values});
    const Recording moved = resample(line, to_Hz);
    RC_ASSERT(moved.time_s(moved.size() - 1) <= line.time_s(499) + 1e-6);
    RC_ASSERT(moved.time_s(moved.size()) > line.time_s(499) - 1e-6);
    for (std::size_t i = 0; i < moved.size(); ++i)
      RC_ASSERT(std::abs(moved.channels()[0].values[i] - 3.0 - moved.time_s(i)) < 1e-9);
  }));
}

TEST(Resample, TheSameRateChangesNoBit) {
  const Recording recording = sine(833.0, 3.0, 1000);
  EXPECT_EQ(resample(recording, 833.0).channels()[0].values, recording.channels()[0].values);
}

TEST(Resample, DownwardRemovesWhatTheNewRateCannotHold) {
  const Recording moved = resample(sine(1000.0, 101.0, 2000), 100.0);
  for (std::size_t i = 2; i + 2 < moved.size(); ++i)
    EXPECT_LT(std::abs(moved.channels()[0].values[i]), 0.05) << i;
}

TEST(Resample, DownwardDelaysNothing) {
  const Recording moved = resample(sine(1000.0, 2.0, 2000), 100.0);
  for (std::size_t i = 0; i < moved.size(); ++i)
    EXPECT_NEAR(moved.channels()[0].values[i],
                std::sin(4.0 * std::numbers::pi * (moved.time_s(i) - 1.0)), 2e-3);
}

TEST(Resample, HeldChannelsStayHeldAndKeepTheirFreshness) {
  Recording recording("held", 100.0);
  recording.add(
      {.name = "torque_Nm", .values = {1.0, 1.0, 1.0, 2.0, 2.0, 2.0}, .fresh = {1, 0, 0, 1, 0, 0}});
  const Recording up = resample(recording, 200.0);
  EXPECT_EQ(up.channels()[0].values, (std::vector<double>{1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2}));
  EXPECT_EQ(up.channels()[0].fresh, (std::vector<std::uint8_t>{1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0}));
  const Recording down = resample(recording, 50.0);
  EXPECT_EQ(down.channels()[0].values, (std::vector<double>{1, 1, 2}));
  EXPECT_EQ(down.channels()[0].fresh, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST(Resample, MissingValuesSpreadNoFurtherThanTheirNeighbours) {
  Recording recording("gap", 100.0);
  recording.add({.name = "x_m", .values = {0.0, 1.0, std::nan(""), 3.0, 4.0}});
  const auto values = resample(recording, 200.0).channels()[0].values;
  ASSERT_EQ(values.size(), 9U);
  EXPECT_EQ(values[2], 1.0);
  EXPECT_TRUE(std::isnan(values[3]));
  EXPECT_TRUE(std::isnan(values[5]));
  EXPECT_EQ(values[6], 3.0);
}

TEST(Resample, ConditionsStayConditions) {
  Recording recording = sine(100.0, 1.0, 50);
  recording.add_condition("support_m", 0.02);
  const Recording moved = resample(recording, 33.0);
  EXPECT_EQ(moved.conditions(), std::vector<std::string>{"support_m"});
  EXPECT_EQ(moved.channel("support_m").values, std::vector<double>(moved.size(), 0.02));
}

TEST(Resample, RefusesARateThatIsNoneOrFillsTheMemory) {
  EXPECT_THROW(static_cast<void>(resample(sine(100.0, 1.0, 50), 0.0)), Error);
  EXPECT_THROW(static_cast<void>(resample(sine(100.0, 1.0, 50), 1e12)), Error);
  // 10^8 samples a channel, 3 * 10^8 numbers in all
  Recording three = sine(100.0, 1.0, 101);
  three.add({.name = "b_m", .values = std::vector<double>(101, 0.0)});
  three.add({.name = "c_m", .values = std::vector<double>(101, 0.0)});
  EXPECT_THROW(static_cast<void>(resample(three, 1e8)), Error);
}

TEST(Interpolate, FollowsUnevenStamps) {
  const std::vector<double> stamps = {1.0, 1.1, 1.4, 2.0};
  std::vector<double> values;
  for (const double stamp : stamps) values.push_back(2.0 * stamp);
  const auto even = interpolate(stamps, values, 10.0, 11);
  for (std::size_t i = 0; i < even.size(); ++i)
    EXPECT_NEAR(even[i], 2.0 + 0.2 * static_cast<double>(i), 1e-12);
}

}  // namespace
}  // namespace torsio
