#include "torsio/estimate/torque_sources.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/error_message.hpp"
#include "support/monitored_joint.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kNaN;
using testing::HasSubstr;

TEST(FrictionFilter, FollowsAFactorWithinSecondsOfMotionAndReportsItsUncertainty) {
  FrictionFilter filter({}, 1000.0);
  Random random(2);
  for (int n = 0; n < 60'000; ++n) {
    const double friction_Nm = n / 500 % 2 == 0 ? 6.0 : -6.0;
    filter.step(friction_Nm, 1.4 * friction_Nm + 0.5 * random.normal(), 0.5);
  }
  EXPECT_NEAR(filter.factor(), 1.4, 0.03);
  EXPECT_LT(filter.std_dev(), 0.05);
  EXPECT_GT(filter.std_dev(), 0.005);
  filter.reset();
  EXPECT_EQ(filter.factor(), 1.0);
  EXPECT_EQ(filter.std_dev(), 0.25);
}

TEST(FrictionFilter, AFaultOfTwentyMillisecondsHardlyEnters) {
  FrictionFilter filter({}, 1000.0);
  filter.set(1.0, 0.02);
  for (int n = 0; n < 20; ++n) filter.step(6.0, 6.0 + 10.0, 0.5);
  EXPECT_NEAR(filter.factor(), 1.0, 0.01);
}

TEST(FrictionFilter, StaysWithinItsBoundsAndIgnoresWhatIsNotANumber) {
  FrictionFilter filter({}, 1000.0);
  for (int n = 0; n < 200'000; ++n) filter.step(6.0, 600.0, 0.5);
  EXPECT_EQ(filter.factor(), 2.0);
  for (int n = 0; n < 200'000; ++n) filter.step(6.0, -600.0, 0.5);
  EXPECT_EQ(filter.factor(), 0.5);
  filter.step(kNaN, 1.0, 1.0);
  filter.step(1.0, kNaN, 1.0);
  filter.step(1.0, 1.0, kNaN);
  filter.step(1.0, 1.0, 0.0);
  filter.step(1e300, 1e300, 1e-300);
  EXPECT_TRUE(std::isfinite(filter.factor()));
  EXPECT_TRUE(std::isfinite(filter.std_dev()));
  filter.set(kNaN, kNaN);
  EXPECT_EQ(filter.factor(), 1.0);
  EXPECT_EQ(filter.std_dev(), 0.25);
}

TEST(FrictionFilter, IsLessCertainWhereNothingMoves) {
  FrictionFilter filter({}, 1000.0);
  filter.set(1.2, 0.01);
  for (int n = 0; n < 60'000; ++n) filter.step(0.0, 0.0, 0.5);
  EXPECT_EQ(filter.factor(), 1.2);
  EXPECT_NEAR(filter.std_dev(), std::hypot(0.01, 2.5e-3 * std::sqrt(60.0)), 1e-9);
}

TEST(FrictionFilter, RefusesImpossibleSettings) {
  const auto refusal = [](const FrictionFilter::Settings& settings, double rate_Hz = 1000.0) {
    return test::error_message([&] { FrictionFilter(settings, rate_Hz); });
  };
  EXPECT_THAT(refusal({.lowest = 1.2}), HasSubstr("bounds above 0 that contain 1"));
  EXPECT_THAT(refusal({.highest = 0.9}), HasSubstr("bounds above 0 that contain 1"));
  EXPECT_THAT(refusal({.std_dev_at_start = 0.0}), HasSubstr("std_dev_at_start"));
  EXPECT_THAT(refusal({.drift_per_sqrt_s = kNaN}), HasSubstr("drift_per_sqrt_s"));
  EXPECT_THAT(refusal({.correlation_s = -1.0}), HasSubstr("correlation_s"));
  EXPECT_THAT(refusal({}, 0.0), HasSubstr("sample rate"));
}

/// A drive whose friction is 5 Nm per unit of `motor_speed_rad_s`, and a spring.
TorqueSources drive_and_spring() {
  std::vector<SourceModel> models;
  models.push_back({.torque = test::proportional_source("motor_current_A", 10.0),
                    .friction = test::proportional_source("motor_speed_rad_s", -5.0)});
  models.push_back({.torque = test::proportional_source("spring_deflection_rad", 500.0),
                    .error_bar_factor = 2.0});
  return TorqueSources(std::move(models));
}

TEST(TorqueSources, AddTheFrictionWithItsFactorAndItsUncertainty) {
  TorqueSources sources = drive_and_spring();
  EXPECT_THAT(sources.raw_inputs(), testing::ElementsAre("motor_current_A", "motor_speed_rad_s",
                                                         "spring_deflection_rad"));
  sources.set_friction_factor(0, 1.2, 0.1);
  const std::vector<double> raw{3.0, 1.0, 0.048};
  const auto estimates = sources.step(raw);
  EXPECT_NEAR(estimates[0].value, 30.0 - 1.2 * 5.0, 1e-12);
  EXPECT_NEAR(estimates[0].std_dev, std::hypot(0.1, 0.1 * 5.0), 1e-12);
  EXPECT_NEAR(estimates[1].value, 24.0, 1e-12);
  EXPECT_NEAR(estimates[1].std_dev, 0.2, 1e-12);
  EXPECT_EQ(sources.friction_factor(1), 1.0);
}

TEST(TorqueSources, TheFrictionFollowsTheOtherSources) {
  TorqueSources sources = drive_and_spring();
  for (int n = 0; n < 60'000; ++n) {
    const double speed_rad_s = n / 1000 % 2 == 0 ? 1.0 : -1.0;
    const double torque_Nm = 10.0 * std::sin(0.002 * n);
    sources.step(
        std::vector{(torque_Nm + 1.3 * 5.0 * speed_rad_s) / 10.0, speed_rad_s, torque_Nm / 500.0});
  }
  EXPECT_NEAR(sources.friction_factor(0), 1.3, 0.02);
  sources.reset();
  EXPECT_EQ(sources.friction_factor(0), 1.0);
}

TEST(TorqueSources, ASourceThatIsNotValidDoesNotChangeTheFriction) {
  TorqueSources sources = drive_and_spring();
  sources.fail_model(1);
  for (int n = 0; n < 10'000; ++n) {
    const auto estimates = sources.step(std::vector{5.0, 1.0, 0.01});
    EXPECT_EQ(estimates[1].fault, Fault::model_not_finite);
  }
  EXPECT_EQ(sources.friction_factor(0), 1.0);
  sources.reset();
  EXPECT_EQ(sources.step(std::vector{5.0, 1.0, 0.01})[1].fault, Fault::none);
  sources.refuse(Fault::input_count_wrong);
  EXPECT_EQ(sources.estimates()[0].fault, Fault::input_count_wrong);
  EXPECT_EQ(sources.step(std::vector{5.0, kNaN, 0.01})[0].fault, Fault::input_not_finite);
}

TEST(TorqueSources, TakeZerosByChannelAndRefuseWhatDoesNotFit) {
  TorqueSources sources = drive_and_spring();
  sources.set_zero("spring_deflection_rad", 0.01);
  EXPECT_NEAR(sources.step(std::vector{0.0, 0.0, 0.03})[1].value, 10.0, 1e-12);
  EXPECT_THAT(test::error_message([&] { sources.set_zero("spring_deflection", 0.0); }),
              HasSubstr("spring_deflection_rad"));
  EXPECT_THAT(test::error_message([] { TorqueSources({}); }), HasSubstr("at least one model"));
  EXPECT_THAT(test::error_message([] {
                test::torque_sources({test::proportional_source("motor_current_A", 1.0),
                                      test::proportional_source("motor_current_A", 1.0, 500.0)});
              }),
              HasSubstr("1000 Hz"));
  EXPECT_THAT(test::error_message([] {
                std::vector<SourceModel> models;
                models.push_back({.torque = test::proportional_source("motor_current_A", 1.0),
                                  .error_bar_factor = 0.0});
                TorqueSources(std::move(models));
              }),
              HasSubstr("error_bar_factor"));
}

}  // namespace
}  // namespace torsio
