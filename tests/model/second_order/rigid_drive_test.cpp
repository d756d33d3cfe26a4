#include "model/second_order/rigid_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

RigidDrive::Parameters sliding(std::size_t substeps = 1) {
  return {.inertia = 95.0,
          .viscous = 200.0,
          .coulomb = 20.0,
          .time = {.sample_period_s = 1e-3, .substeps = substeps},
          .lowest = -10.0,
          .highest = 10.0};
}

double step(RigidDrive& model, double force) { return model.step({&force, 1}).value; }

TEST(RigidDrive, BrakesByCoulombFrictionAndStays) {
  auto parameters = sliding();
  parameters.viscous = 0.0;
  parameters.time.input_order = 1;  // a cubic would overshoot where the force jumps
  RigidDrive model(parameters);
  model.set_state(std::vector<double>{0.0, 0.1, 0.0});
  // Stops after v J / Fc = 0.475 s, v^2 J / (2 Fc) = 23.75 mm away.
  double q = 0.0;
  for (int n = 0; n < 2000; ++n) {
    q = step(model, 0.0);
    if (n != 200) continue;
    EXPECT_NEAR(q, 0.1 * 0.2 - 0.5 * 20.0 / 95.0 * 0.04, 1e-9);
  }
  EXPECT_NEAR(q, 0.02375, 2e-7);  // the sample in which it stops
  EXPECT_EQ(model.state()[1], 0.0);
  EXPECT_EQ(step(model, 19.9), q);
  EXPECT_EQ(step(model, 19.9), q);
  for (int n = 0; n < 100; ++n) (void)step(model, 20.1);
  EXPECT_GT(model.state()[0], q);
}

/// Miss of the position after half a second of a constant force, against the exact answer.
double drag_error(std::size_t substeps) {
  auto parameters = sliding(substeps);
  parameters.viscous = 2000.0;
  parameters.time.sample_period_s = 0.01;
  RigidDrive model(parameters);
  double q = 0.0;
  for (int n = 0; n <= 50; ++n) q = step(model, 120.0);
  const double rate = 2000.0 / 95.0;
  const double speed = 100.0 / 2000.0;
  return std::abs(q - speed * (0.5 - (1.0 - std::exp(-rate * 0.5)) / rate));
}

TEST(RigidDrive, ConvergesWithTheSecondPowerOfTheSubstep) {
  EXPECT_NEAR(std::log2(drag_error(2) / drag_error(4)), 2.0, 0.1);
}

TEST(RigidDrive, SlidesSteadilyWhereItsForcesBalance) {
  auto parameters = sliding();
  parameters.offset = -3.0;
  parameters.static_ratio = 1.4;
  parameters.stribeck_speed = 0.01;
  parameters.viscous_asymmetry = -30.0;
  parameters.viscous_quadratic = 100.0;
  for (const double force : {80.0, -80.0}) {
    RigidDrive model(parameters);
    for (int n = 0; n < 10000; ++n) (void)step(model, force);
    const double v = model.state()[1];
    const double resisted =
        -3.0 + 200.0 * v - 30.0 * std::abs(v) + 100.0 * std::abs(v) * v + std::copysign(20.0, v);
    EXPECT_NEAR(resisted, force, 1e-6);
  }
}

TEST(RigidDrive, NeedsTheBreakawayForceToStart) {
  auto parameters = sliding();
  parameters.static_ratio = 1.5;
  parameters.stribeck_speed = 0.01;
  RigidDrive model(parameters);
  for (int n = 0; n < 100; ++n) (void)step(model, 29.9);
  EXPECT_EQ(model.state()[0], 0.0);
  for (int n = 0; n < 1000; ++n) (void)step(model, 30.5);
  EXPECT_GT(model.state()[1], 0.01);  // and then slides against less
}

TEST(RigidDrive, HasMoreFrictionAccordingToItsSlope) {
  auto parameters = sliding();
  parameters.coulomb_slope = 0.5;
  RigidDrive model(parameters);
  for (const double q : {-1.0, 0.0, 1.0}) {
    const double level = 20.0 * (1.0 + 0.5 * q);
    model.reset();
    model.set_state(std::vector<double>{q, 0.0, 0.0});
    for (int n = 0; n < 20; ++n) EXPECT_EQ(step(model, 0.999 * level), q);
    for (int n = 0; n < 20; ++n) (void)step(model, 1.01 * level);
    EXPECT_GT(model.state()[0], q);
  }
}

TEST(RigidDrive, HasMoreFrictionUnderLoad) {
  auto parameters = sliding();
  parameters.variable_friction = VariableFriction{.load_share = 0.2};
  // Starts where F = 20 + 0.2 F, slides where 200 v = 80 - 36.
  RigidDrive model(parameters);
  for (int n = 0; n < 100; ++n) EXPECT_EQ(step(model, 24.9), 0.0);
  for (int n = 0; n < 10000; ++n) (void)step(model, 80.0);
  EXPECT_NEAR(model.state()[1], 0.22, 1e-6);
}

TEST(RigidDrive, NeedsMoreForceToStartTheLongerItRested) {
  auto parameters = sliding();
  parameters.variable_friction = VariableFriction{.dwell_gain = 0.5, .dwell_time_s = 0.2};
  double before = 0.0;
  for (const int rest_ms : {10, 100, 1000}) {
    RigidDrive model(parameters);
    for (int n = 0; n < rest_ms; ++n) (void)step(model, 0.0);
    double force = 0.0;
    for (; model.state()[1] == 0.0 && force < 50.0; force += 0.5) (void)step(model, force);
    EXPECT_GT(force, before);
    before = force;
    if (rest_ms != 1000) continue;
    EXPECT_NEAR(force, 30.0, 1.5);
    for (int n = 0; n < 2000; ++n) (void)step(model, 60.0);
    EXPECT_NEAR(model.state()[1], 0.2, 1e-2);  // it slides against the same friction as before
  }
}

TEST(RigidDrive, LosesFrictionAsItWarmsAndRegainsItAtRest) {
  auto parameters = sliding();
  parameters.variable_friction = VariableFriction{.heating = 0.002, .heating_time_s = 5.0};
  parameters.highest = 1e4;
  RigidDrive model(parameters);
  for (int n = 0; n < 200000; ++n) (void)step(model, 80.0);
  // At rest the power 80 v heats, E = 5 s 80 v, and exp(-0.002 E) (200 v + 20) = 80.
  const double speed = model.state()[1];
  EXPECT_NEAR(std::exp(-0.002 * 5.0 * 80.0 * speed) * (200.0 * speed + 20.0), 80.0, 0.1);
  const double heat = model.state()[4];
  for (int n = 0; n < 30000; ++n) (void)step(model, 0.0);
  EXPECT_LT(model.state()[4], 0.01 * heat);
  EXPECT_GT(heat, 100.0);
  model.reset();
  EXPECT_EQ(model.state()[4], 0.0);
}

TEST(RigidDrive, WithABristleIsASpringBeforeItSlides) {
  auto parameters = sliding();
  parameters.bristle = 1e-3;  // 20 kN/m
  RigidDrive model(parameters);
  for (int n = 0; n < 5000; ++n) (void)step(model, std::min(0.001 * n, 1.0));
  const double z = model.state()[2];
  EXPECT_NEAR(z, 1.0, 1e-3);
  EXPECT_NEAR(model.state()[0], -1e-3 * std::log1p(-1.0 / 20.0), 2e-6);  // F' = s (1 - F / Fc) v
}

TEST(RigidDrive, TakesMoreEnergyThanItHolds) {
  for (const double bristle : {0.0, 1e-3}) {
    auto parameters = sliding(2);
    parameters.bristle = bristle;
    parameters.static_ratio = 1.5;
    parameters.stribeck_speed = 0.02;
    parameters.spring = 300.0;
    parameters.variable_friction = VariableFriction{
        .load_share = 0.1, .dwell_gain = 0.3, .dwell_time_s = 0.1, .heating = 0.05};
    RigidDrive model(parameters);
    double work = 0.0;
    double before = 0.0;
    for (int n = 1; n < 20000; ++n) {
      const double force = 60.0 * std::sin(0.004 * n) * std::sin(0.0007 * n);
      const double q = step(model, force);
      work += force * (q - before);
      before = q;
      const auto state = model.state();
      const double held = 0.5 * 95.0 * state[1] * state[1] + 150.0 * q * q +
                          (bristle > 0.0 ? 0.5 * state[2] * state[2] * bristle / 30.0 : 0.0);
      ASSERT_GE(work, held - 1e-3) << bristle << ", " << n;
    }
    EXPECT_GT(work, 1.0);
  }
}

TEST(RigidDrive, StopsAtTheEndOfItsRangeAndGoesOnAfterNaN) {
  RigidDrive model(sliding());
  double force = 1e7;
  Estimate estimate;
  for (int n = 0; n < 1000; ++n) estimate = model.step({&force, 1});
  EXPECT_EQ(estimate.fault, Fault::diverged);
  EXPECT_EQ(estimate.value, 10.0);
  force = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(model.step({&force, 1}).fault, Fault::none);
  force = -1.0;
  for (int n = 0; n < 10; ++n) estimate = model.step({&force, 1});
  EXPECT_EQ(estimate.fault, Fault::none);
  EXPECT_EQ(estimate.value, 10.0);
}

TEST(RigidDrive, KeepsABristleBelowWhatItCanHold) {
  auto parameters = sliding();
  parameters.bristle = 1e-3;
  RigidDrive with(parameters);
  with.set_state(std::vector<double>{0.0, NAN, 1e9});
  EXPECT_THAT(with.state(), testing::ElementsAre(0.0, 0.0, 20.0, 0.0, 0.0));
  RigidDrive without(sliding());
  without.set_state(std::vector<double>{20.0, 1.0, 5.0});
  EXPECT_THAT(without.state(), testing::ElementsAre(10.0, 1.0, 0.0, 0.0, 0.0));
}

TEST(RigidDrive, RefusesWhatIsNoDrive) {
  const auto refused = [](auto change) {
    auto parameters = sliding();
    change(parameters);
    return test::error_message([&] { RigidDrive model(parameters); });
  };
  EXPECT_THAT(refused([](auto& p) { p.inertia = 0.0; }), HasSubstr("rigid_drive: inertia"));
  EXPECT_THAT(refused([](auto& p) { p.lowest = 1e-9; }), HasSubstr("found 1e-09"));
  EXPECT_THAT(refused([](auto& p) { p.static_ratio = 0.9; }), HasSubstr("static_ratio"));
  EXPECT_THAT(refused([](auto& p) { p.viscous_asymmetry = 300.0; }),
              HasSubstr("viscous_asymmetry"));
  EXPECT_THAT(refused([](auto& p) { p.gains = {0.0}; }), HasSubstr("gains"));
  EXPECT_THAT(refused([](auto& p) { p.bristle = 1e-9; }), HasSubstr("substeps"));
}

}  // namespace
}  // namespace torsio
