#include "identify/drive/error_gain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using ::testing::HasSubstr;

constexpr double kErrorGain_1_rad = 0.11;

/// Steps of the goal every 0.4 s at 1 kHz, followed by a joint with a lag of 60 ms; the duty follows a goal that is late.
Recording steps(double delay_s, double duty_noise_1, unsigned seed) {
  constexpr double kPeriod_s = 0.001;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> goals(-1.0, 1.0);
  std::normal_distribution<double> noise;
  const auto late = static_cast<std::size_t>(std::lround(delay_s / kPeriod_s));
  std::vector<double> goal;
  std::vector<double> angle;
  std::vector<double> duty;
  double q = 0.0;
  for (std::size_t n = 0; n < 4000; ++n) {
    goal.push_back(n % 400 == 0 ? goals(random) : goal.back());
    const double read = goal[n > late ? n - late : 0];
    angle.push_back(q);
    duty.push_back(
        std::clamp(5.0 * kErrorGain_1_rad * (read - q) + duty_noise_1 * noise(random), -1.0, 1.0));
    q += kPeriod_s / 0.06 * (read - q);
  }
  Recording recording("steps", 1.0 / kPeriod_s);
  recording.add({.name = "goal_angle_rad", .values = goal});
  recording.add({.name = "joint_angle_rad", .values = angle});
  recording.add({.name = "duty_1", .values = duty});
  recording.add_condition("kp_1", 5.0);
  recording.add_condition("supply_V", 24.0);
  return recording;
}

TEST(MeasuredDrives, HaveTheErrorGainAndTheDelayOfALateGoal) {
  const std::vector<Recording> recordings{steps(0.012, 0.002, 1), steps(0.012, 0.002, 2)};
  const MeasuredDrive measured =
      measured_drive(recordings, assumed_drive_sheet(recordings.front()));
  ASSERT_TRUE(measured.error_gain.has_value());
  EXPECT_NEAR(measured.error_gain->value_1_rad, kErrorGain_1_rad, 0.005 * kErrorGain_1_rad);
  // Samples next to a jump of the goal are left out, so that one more or less is the same.
  EXPECT_NEAR(measured.error_gain->delay_s, 0.012, 0.0011);
  EXPECT_NEAR(measured.error_gain->residual_duty_1, 0.002, 2e-4);
  EXPECT_DOUBLE_EQ(measured.sheet.error_gain_1_rad.value(), measured.error_gain->value_1_rad);
}

TEST(MeasuredDrives, HaveAStandardErrorThatCoversTheErrorOfTheGain) {
  std::vector<Recording> recordings;
  for (unsigned seed = 1; seed <= 6; ++seed) recordings.push_back(steps(0.0, 0.1, seed));
  const MeasuredDrive measured =
      measured_drive(recordings, assumed_drive_sheet(recordings.front()));
  const double error = std::abs(measured.error_gain->value_1_rad - kErrorGain_1_rad);
  EXPECT_GT(measured.error_gain->standard_error_1_rad, 0.0);
  EXPECT_LT(error, 3.0 * measured.error_gain->standard_error_1_rad);
  EXPECT_LT(measured.error_gain->standard_error_1_rad, 0.15 * kErrorGain_1_rad);
}

TEST(MeasuredDrives, OfOneRecordingHaveNoStandardError) {
  const std::vector<Recording> recordings{steps(0.0, 0.01, 1)};
  const MeasuredDrive measured =
      measured_drive(recordings, assumed_drive_sheet(recordings.front()));
  EXPECT_TRUE(std::isnan(measured.error_gain->standard_error_1_rad));
}

std::vector<Recording> three_steps() {
  return {steps(0.0, 0.002, 1), steps(0.0, 0.002, 2), steps(0.0, 0.002, 3)};
}

/// A recording with another duty.
Recording with_duty(const Recording& from, const std::function<double(double)>& change) {
  Recording changed(from.name(), from.sample_rate_Hz());
  for (Channel channel : from.channels()) {
    if (channel.name == "duty_1")
      for (double& value : channel.values) value = change(value);
    changed.add(std::move(channel));
  }
  return changed;
}

std::string findings_text(const std::vector<Recording>& recordings) {
  std::string text;
  for (const DriveFinding& finding :
       measured_drive(recordings, assumed_drive_sheet(recordings.front())).findings)
    text += finding.subject + ": " + finding.text + "\n";
  return text;
}

TEST(MeasuredDrives, RemarkNothingOfADutyThatFollowsItsLaw) {
  EXPECT_EQ(findings_text(three_steps()), "");
}

TEST(MeasuredDrives, NameARecordingOfAnotherGain) {
  std::vector<Recording> recordings = three_steps();
  recordings[1] = with_duty(recordings[1], [](double duty) { return 2.0 * duty; });
  EXPECT_THAT(findings_text(recordings), HasSubstr("2.00 times as strongly"));
}

TEST(MeasuredDrives, RemarkALimitBelowThatOfTheFile) {
  std::vector<Recording> recordings = three_steps();
  for (Recording& recording : recordings)
    recording = with_duty(recording, [](double duty) { return std::clamp(duty, -0.3, 0.3); });
  EXPECT_THAT(findings_text(recordings), HasSubstr("state 'max_duty: 0.3'"));
}

TEST(MeasuredDrives, RemarkADutyOfAnotherLaw) {
  std::vector<Recording> recordings = three_steps();
  int n = 0;
  for (Recording& recording : recordings)
    recording = with_duty(recording, [&](double duty) { return duty + 0.1 * (n++ % 2 * 2 - 1); });
  EXPECT_THAT(findings_text(recordings), HasSubstr("the law is another one"));
}

TEST(MeasuredDrives, NameTheSignAndThePower) {
  const auto refusal = [](double factor) -> std::string {
    std::vector<Recording> recordings = three_steps();
    for (Recording& recording : recordings)
      recording = with_duty(recording, [&](double duty) { return factor * duty; });
    try {
      (void)measured_drive(recordings, assumed_drive_sheet(recordings.front()));
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(refusal(-1.0), HasSubstr("has the other sign: 'sign: -1'"));
  EXPECT_THAT(refusal(0.0), HasSubstr("recordings with power"));
}

}  // namespace
}  // namespace torsio
