#include "model/second_order/dynamic_bouc_wen.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// The official benchmark's: m = 2, c = 10, k = a = 5e4, b = 1000, g = 0.8, d = -1.1, n = 1.
DynamicBoucWen::Parameters benchmark(std::size_t substeps = 4, double rate_Hz = 750.0) {
  return {.mass = 2.0,
          .damping = 10.0,
          .stiffness = 5e4,
          .hysteretic_stiffness = 5e4,
          .loss = 800.0,
          .skew = -1100.0,
          .time = {.sample_period_s = 1.0 / rate_Hz, .substeps = substeps},
          .lowest = -0.1,
          .highest = 0.1};
}

DynamicBoucWen::Parameters oscillator(std::size_t substeps, double rate_Hz = 750.0) {
  auto parameters = benchmark(substeps, rate_Hz);
  parameters.hysteretic_stiffness = parameters.loss = parameters.skew = 0.0;
  return parameters;
}

double step(DynamicBoucWen& model, double force) { return model.step({&force, 1}).value; }

/// y of the damped oscillator, from rest, to u = t^3: its cubic answer and a decaying oscillation.
double answer_to_cube(double t) {
  constexpr double m = 2.0, c = 10.0, k = 5e4;
  const double a3 = 1.0 / k;
  const double a2 = -3.0 * c * a3 / k;
  const double a1 = -(6.0 * m * a3 + 2.0 * c * a2) / k;
  const double a0 = -(2.0 * m * a2 + c * a1) / k;
  const double decay = c / (2.0 * m);
  const double turn = std::sqrt(k / m - decay * decay);
  const double sine = -(a1 + decay * a0) / turn;
  return a0 + t * (a1 + t * (a2 + t * a3)) +
         std::exp(-decay * t) * (-a0 * std::cos(turn * t) + sine * std::sin(turn * t));
}

TEST(DynamicBoucWen, WithoutHysteresisFollowsTheEquationForACubicForce) {
  DynamicBoucWen model(oscillator(4));
  double worst = 0.0;
  for (int n = 0; n < 750; ++n) {
    const double t = n / 750.0;
    worst = std::max(worst, std::abs(step(model, t * t * t) - answer_to_cube(t)));
  }
  EXPECT_LT(worst, 1e-8 * answer_to_cube(1.0) * 100.0);
}

/// Largest miss of a step response of the oscillator.
double step_response_error(std::size_t substeps) {
  DynamicBoucWen model(oscillator(substeps));
  constexpr double kDecay = 2.5;
  const double turn = std::sqrt(25000.0 - kDecay * kDecay);
  double worst = 0.0;
  for (int n = 0; n < 300; ++n) {
    const double t = n / 750.0;
    const double exact =
        1e-3 *
        (1.0 - std::exp(-kDecay * t) * (std::cos(turn * t) + kDecay / turn * std::sin(turn * t)));
    worst = std::max(worst, std::abs(step(model, 50.0) - exact));
  }
  return worst;
}

TEST(DynamicBoucWen, ConvergesWithTheFourthPowerOfTheSubstepWhereNothingBends) {
  EXPECT_NEAR(std::log2(step_response_error(4) / step_response_error(8)), 4.0, 0.2);
}

TEST(DynamicBoucWen, ConvergesWithAboutTheSecondPowerWhereVelocityTurns) {
  const auto run = [](std::size_t substeps) {
    DynamicBoucWen model(benchmark(substeps));
    std::vector<double> y;
    for (int n = 0; n < 500; ++n) y.push_back(step(model, 60.0 * std::sin(0.25 * n)));
    return y;
  };
  const std::vector<double> exact = run(1000);
  const auto error = [&](std::size_t substeps) {
    const std::vector<double> y = run(substeps);
    double sum = 0.0;
    for (std::size_t n = 0; n < y.size(); ++n) sum += (y[n] - exact[n]) * (y[n] - exact[n]);
    return std::sqrt(sum / static_cast<double>(y.size()));
  };
  EXPECT_GT(std::log2(error(2) / error(32)), 4.0 * 1.7);
  EXPECT_LT(error(4), 4e-7);
}

TEST(DynamicBoucWen, GivesBackNoMoreEnergyThanItWasGiven) {
  for (const double exponent : {1.0, 1.7}) {
    auto parameters = benchmark(2, 20000.0);
    parameters.exponent = exponent;
    if (exponent != 1.0) parameters.loss = 30.0, parameters.skew = -20.0;
    DynamicBoucWen model(parameters);
    double work = 0.0;
    double before[3] = {};
    for (int n = 0; n < 20000; ++n) {
      (void)step(model, 80.0 * std::sin(0.01 * n) * std::sin(0.0007 * n));
      const auto now = model.state();
      work += 0.5 * (before[2] + now[2]) * (now[0] - before[0]);
      std::ranges::copy(now, before);
      if (n % 100 != 0) continue;
      EXPECT_GE(work, hysteretic_energy(parameters, now[2]) - 1e-7) << exponent << ", " << n;
    }
    EXPECT_GT(work, 3.0 * hysteretic_energy(parameters, before[2]));  // it did lose some
  }
}

TEST(DynamicBoucWen, ComputesTheFirstSampleFromTheGivenState) {
  DynamicBoucWen model(benchmark());
  model.reset();
  const std::vector<double> start{1e-3, -0.2, 20.0};
  model.set_state(start);
  EXPECT_EQ(step(model, 5.0), 1e-3);
  EXPECT_NE(step(model, 5.0), 1e-3);
  model.set_state(std::vector<double>{7.0, NAN, 1.0});
  EXPECT_EQ(model.state()[0], 0.1);  // the end of its range
  EXPECT_TRUE(std::isfinite(model.state()[1]));
}

TEST(DynamicBoucWen, StopsAtTheEndOfItsRangeAndReportsIt) {
  auto parameters = benchmark();
  parameters.highest = 1e-3;
  DynamicBoucWen model(parameters);
  double force = 500.0;
  Estimate estimate;
  for (int n = 0; n < 10 && estimate.fault == Fault::none; ++n) estimate = model.step({&force, 1});
  EXPECT_EQ(estimate.fault, Fault::diverged);
  EXPECT_EQ(estimate.value, 1e-3);
  EXPECT_EQ(model.state()[1], 0.0);
  force = 1e200;
  estimate = model.step({&force, 1});
  EXPECT_EQ(estimate.fault, Fault::diverged);
  EXPECT_TRUE(std::isfinite(estimate.value));
}

TEST(DynamicBoucWen, GoesOnAfterAForceThatIsNoNumber) {
  DynamicBoucWen model(benchmark());
  for (int n = 0; n < 20; ++n) (void)step(model, 10.0 * n);
  double force = std::numeric_limits<double>::quiet_NaN();
  const Estimate bad = model.step({&force, 1});
  EXPECT_EQ(bad.fault, Fault::diverged);
  EXPECT_TRUE(std::isfinite(bad.value));
  force = 10.0;
  for (int n = 0; n < 20; ++n) {
    const Estimate estimate = model.step({&force, 1});
    EXPECT_EQ(estimate.fault, Fault::none);
    EXPECT_TRUE(std::isfinite(estimate.value));
  }
}

TEST(DynamicBoucWen, RefusesWhatIsNoMassOnASpring) {
  const auto refused = [](auto change) {
    auto parameters = benchmark();
    change(parameters);
    return test::error_message([&] { DynamicBoucWen model(parameters); });
  };
  EXPECT_THAT(refused([](auto& p) { p.mass = 0.0; }), HasSubstr("dynamic_bouc_wen: mass"));
  EXPECT_THAT(refused([](auto& p) { p.loss = -1.0; }), HasSubstr("loss"));
  EXPECT_THAT(refused([](auto& p) { p.exponent = NAN; }), HasSubstr("exponent"));
  EXPECT_THAT(refused([](auto& p) { p.lowest = 0.01; }), HasSubstr("lowest"));
  EXPECT_THAT(refused([](auto& p) { p.gains = {}; }), HasSubstr("gains"));
  EXPECT_THAT(refused([](auto& p) { p.mass = 1e-3; }), HasSubstr("substeps"));
  EXPECT_THAT(refused([](auto& p) { p.time.input_order = 9; }), HasSubstr("input_order"));
  EXPECT_THAT(refused([](auto& p) { p.time.sample_period_s = 0.0; }), HasSubstr("sample_period_s"));
}

}  // namespace
}  // namespace torsio
