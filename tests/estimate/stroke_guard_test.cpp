#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "support/error_message.hpp"
#include "support/example_settings.hpp"
#include "support/examples/linear.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {
namespace {

using detail::StrokeClock;

TEST(StrokeClock, CountsFromTheTurningPointAlsoWhereItIsNoticedLate) {
  StrokeClock clock(0.5);
  for (int n = 0; n <= 10; ++n) clock.follow(n);
  EXPECT_EQ(clock.ticks(), 11.0);
  for (int n = 1; n <= 4; ++n) clock.follow(10.0 - 0.2 * n);  // beyond the dead band at the third
  EXPECT_EQ(clock.ticks(), 4.0);
  EXPECT_EQ(clock.longest(), 11.0);
}

TEST(StrokeClock, TakesNoiseBelowTheDeadBandForNoTurn) {
  StrokeClock clock(0.5);
  for (int n = 0; n < 1000; ++n) clock.follow(0.01 * n + (n % 2 == 0 ? 0.2 : -0.2));
  EXPECT_EQ(clock.ticks(), 1000.0);
}

TEST(StrokeClock, IsThatOfTheSlowestOfThisStrokeAndTheOneBefore) {
  StrokeClock clock(0.1);
  const auto stroke = [&](double to, int ticks, double from) {
    for (int n = 1; n <= ticks; ++n) clock.follow(std::lerp(from, to, n / double(ticks)));
  };
  stroke(1.0, 100, 0.0);
  stroke(0.0, 400, 1.0);
  stroke(1.0, 100, 0.0);
  EXPECT_NEAR(clock.longest(), 400.0, 1.0);
  stroke(0.0, 100, 1.0);
  EXPECT_NEAR(clock.longest(), 100.0, 1.0);
  clock.reset();
  EXPECT_EQ(clock.longest(), 0.0);
}

EstimatorSettings settings_with(const StrokeGuard& strokes) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels = {};
  settings.features.inputs = {"spring_deflection_rad", "joint_angle_rad"};
  settings.ranges = {.lowest = {-1.0, -1.0}, .highest = {1.0, 1.0}, .margin = 0.05};
  settings.disturbances = {.largest_step = {0.1, 0.1}, .largest_travel = 0.1};
  settings.residuals = {.edges = {-1e3, 1e3}, .std_dev = {0.3}};
  settings.strokes = strokes;
  return settings;
}

Estimator estimator_with(const StrokeGuard& strokes) {
  return {settings_with(strokes), AnyModel(test::example<Linear>())};
}

/// The last estimate of a sine of this period.
Estimate after_sine(Estimator& estimator, double period_s) {
  Estimate estimate;
  const double rate_Hz = estimator.settings().sample_rate_Hz;
  for (int n = 0; n < static_cast<int>(3.0 * period_s * rate_Hz); ++n)
    estimate = estimator.step(
        std::array{0.5 * std::sin(2.0 * std::numbers::pi * n / (period_s * rate_Hz)), 0.0});
  return estimate;
}

constexpr StrokeGuard kGuard{.longest_s = 0.1, .dead_band = 0.01, .growth = 0.2, .limit = 5.0};

TEST(StrokeGuard, AddsNothingInStrokesOfTheTraining) {
  Estimator with = estimator_with(kGuard);
  Estimator without = estimator_with({});
  const Estimate now = after_sine(with, 0.19);
  EXPECT_EQ(now.std_dev, after_sine(without, 0.19).std_dev);
  EXPECT_EQ(now.novelty, 0.0);
}

TEST(StrokeGuard, WidensTheErrorBarOfASlowerMotionAndNothingElse) {
  Estimator with = estimator_with(kGuard);
  Estimator without = estimator_with({});
  const Estimate slow = after_sine(with, 0.8);  // strokes of 0.4 s: r = 4, n = 9/4
  const Estimate plain = after_sine(without, 0.8);
  EXPECT_EQ(slow.value, plain.value);
  EXPECT_EQ(slow.fault, plain.fault);
  EXPECT_TRUE(std::isnan(plain.novelty));
  EXPECT_NEAR(slow.novelty, 9.0 / 4.0, 0.05);
  EXPECT_NEAR(slow.std_dev, std::hypot(plain.std_dev, 0.2 * slow.novelty), 1e-12);
}

TEST(StrokeGuard, AddsNoMoreThanTheSpreadOfTheTarget) {
  Estimator with = estimator_with(kGuard);
  const Estimate rest = after_sine(with, 200.0);
  EXPECT_GT(rest.novelty, 100.0);
  EXPECT_NEAR(rest.std_dev, std::hypot(0.3, 5.0), 1e-12);
}

TEST(StrokeGuard, RefusesNumbersThatAreNegativeOrNotFinite) {
  for (const StrokeGuard& bad :
       {StrokeGuard{.longest_s = -1.0}, StrokeGuard{.longest_s = 1.0, .growth = std::nan("")}})
    EXPECT_NE(test::error_message([&] { estimator_with(bad); }).find("guards.strokes."),
              std::string::npos);
}

}  // namespace
}  // namespace torsio
