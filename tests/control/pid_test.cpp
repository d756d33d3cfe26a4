#include "torsio/control/pid.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_number;
using test::any_random;
using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;

constexpr double kPeriod_s = 1.0 / kRate_Hz;

Pid::Settings limited_pi(Pid::AntiWindup scheme) {
  return {.gains = {.proportional = 2.0, .integral = 10.0},
          .limits = {.lowest = -1.0, .highest = 1.0},
          .anti_windup = scheme};
}

TEST(Pid, NamesTheTermsThatMakeUpItsCommand) {
  Pid pid({.gains = {.proportional = 2.0, .integral = 10.0, .derivative = 0.1}}, kRate_Hz);
  (void)pid.step(1.0, 0.0, 0.3);
  const Pid::Output output = pid.step(1.0, 0.2, 0.3);
  EXPECT_DOUBLE_EQ(output.proportional, 1.6);
  EXPECT_DOUBLE_EQ(output.integral, 10.0 * 1.0 * kPeriod_s);
  EXPECT_DOUBLE_EQ(output.derivative, -0.1 * 0.2 * kRate_Hz);
  EXPECT_DOUBLE_EQ(output.feed_forward, 0.3);
  EXPECT_DOUBLE_EQ(output.command, output.proportional + output.integral + output.derivative + 0.3);
  EXPECT_FALSE(output.is_limited);
}

TEST(Pid, DoesNotKickAtAStepOfTheReferenceUnlessConfiguredTo) {
  Pid::Settings settings = {.gains = {.proportional = 1.0, .derivative = 1.0}};
  Pid of_measurement(settings, kRate_Hz);
  settings.derivative_of = Pid::DerivativeOf::error;
  Pid of_error(settings, kRate_Hz);
  (void)of_measurement.step(0.0, 0.0);
  (void)of_error.step(0.0, 0.0);
  EXPECT_DOUBLE_EQ(of_measurement.step(1.0, 0.0).derivative, 0.0);
  EXPECT_DOUBLE_EQ(of_error.step(1.0, 0.0).derivative, kRate_Hz);
}

TEST(Pid, FiltersItsDerivative) {
  Pid pid({.gains = {.derivative = 1.0}, .derivative_cutoff_Hz = 20.0}, kRate_Hz);
  double largest = 0.0;
  double last = 0.0;
  for (int n = 0; n < 400; ++n) {
    last = pid.step(0.0, n == 0 ? 0.0 : -0.001 * n + (n % 2 == 0 ? 1e-3 : -1e-3)).derivative;
    if (n > 200) largest = std::max(largest, std::abs(last - 1.0));
  }
  EXPECT_LT(largest, 0.02) << "a ramp of 1 with 2 mrad of noise, 2 rad/s when unfiltered";
}

// u = K_p e + K_i int e on the integrator y' = u: y'' + K_p y' + K_i y = K_p r' + K_i r.
TEST(Pid, OnAnIntegratorFollowsAStepAsTheSecondOrderSystemDoes) {
  constexpr double kFrequency = 8.0;
  constexpr double kDamping = 0.6;
  Pid pid(
      {.gains = {.proportional = 2.0 * kDamping * kFrequency, .integral = kFrequency * kFrequency}},
      100.0 * kRate_Hz);
  const double damped = kFrequency * std::sqrt(1.0 - kDamping * kDamping);
  double y = 0.0;
  for (int n = 0; n < 100'000; ++n) {
    const double t = n * kPeriod_s / 100.0;
    // With its zero: 1 - exp(-zwt) (cos(w_d t) - z / sqrt(1 - z^2) sin(w_d t)).
    const double expected =
        1.0 - std::exp(-kDamping * kFrequency * t) *
                  (std::cos(damped * t) - kDamping * kFrequency / damped * std::sin(damped * t));
    ASSERT_NEAR(y, expected, 2e-4) << t;
    y += pid.step(1.0, y).command * kPeriod_s / 100.0;
  }
}

TEST(Pid, UnwindsAtOnceByEitherScheme) {
  for (const auto scheme : {Pid::AntiWindup::back_calculation, Pid::AntiWindup::conditional}) {
    Pid pid(limited_pi(scheme), kRate_Hz);
    for (int n = 0; n < 20'000; ++n) ASSERT_EQ(pid.step(5.0, 0.0).command, 1.0);
    // 20 s at an error of 5 would have wound up 1000; half a second turns it round.
    int ticks = 0;
    while (pid.step(-0.5, 0.0).command > -0.9 && ticks < 2000) ++ticks;
    EXPECT_LT(ticks, 500);
  }
}

TEST(Pid, DoesNotWindUpWhileAnotherLoopHasTakenOver) {
  for (const auto scheme : {Pid::AntiWindup::back_calculation, Pid::AntiWindup::conditional}) {
    Pid pid(limited_pi(scheme), kRate_Hz);
    for (int n = 0; n < 20'000; ++n) {
      (void)pid.step(0.2, 0.0);
      pid.track(0.1);
    }
    const Pid::Output returned = pid.step(0.05, 0.0);
    EXPECT_LT(std::abs(returned.command), 0.5);
    EXPECT_FALSE(returned.is_limited);
  }
}

TEST(Pid, TracksWhatIsAppliedSoThatTheReturnHasNoBump) {
  Pid pid({.gains = {.proportional = 2.0, .integral = 10.0}}, kRate_Hz);
  for (int n = 0; n < 20'000; ++n) {
    (void)pid.step(0.2, 0.2);
    pid.track(0.37);
  }
  EXPECT_NEAR(pid.step(0.2, 0.2).command, 0.37, 1e-9);
}

TEST(Pid, RefusesImpossibleSettings) {
  const auto refusal = [](const Pid::Settings& settings, double rate_Hz = kRate_Hz) {
    return test::error_message([&] { Pid(settings, rate_Hz); });
  };
  EXPECT_EQ(refusal({.gains = {.proportional = -1.0}}),
            "pid: impossible parameter; expected proportional gain >= 0 and finite, found -1");
  EXPECT_NE(refusal({.gains = {.integral = kNaN}}), "");
  EXPECT_NE(refusal({.gains = {.derivative = kInfinity}}), "");
  EXPECT_NE(refusal({.limits = {.lowest = 1.0, .highest = 1.0}}), "");
  EXPECT_NE(refusal({.limits = {.lowest = kNaN}}), "");
  EXPECT_NE(refusal({.limits = {.rate_per_s = 0.0}}), "");
  EXPECT_NE(refusal({.tracking_s = 0.0}), "");
  EXPECT_NE(refusal({.transfer_s = -0.1}), "");
  EXPECT_NE(refusal({}, 0.0), "");
  EXPECT_EQ(refusal({}), "");
}

TEST(Pid, KeepsItsGainsIfOneOfTheNewIsImpossible) {
  Pid pid({.gains = {.proportional = 2.0, .integral = 1.0}}, kRate_Hz);
  for (const double bad : {-1.0, kNaN, kInfinity}) {
    EXPECT_FALSE(pid.set_gains({.proportional = 3.0, .integral = bad}));
    EXPECT_FALSE(pid.set_gains({.proportional = 3.0, .derivative = bad}));
    EXPECT_FALSE(pid.set_gains({.proportional = bad}));
  }
  EXPECT_EQ(pid.gains().proportional, 2.0);
  EXPECT_EQ(pid.gains().integral, 1.0);
}

// ------------------------------------------------------------------------------------ properties

Pid::Gains any_gains() {
  return {.proportional = any_number(0.0, 20.0),
          .integral = any_number(0.0, 100.0),
          .derivative = any_number(0.0, 0.1)};
}

Pid::Settings any_pid_settings() {
  return {
      .gains = any_gains(),
      .limits = {.lowest = any_number(-3.0, -0.1),
                 .highest = any_number(0.1, 3.0),
                 .rate_per_s = any_number(1.0, 500.0)},
      .anti_windup =
          *rc::gen::element(Pid::AntiWindup::back_calculation, Pid::AntiWindup::conditional),
      .derivative_of = *rc::gen::element(Pid::DerivativeOf::measurement, Pid::DerivativeOf::error),
      .derivative_cutoff_Hz = 100.0};
}

// 100 cases of 10^4 steps.
RC_GTEST_PROP(Pid, NeverLeavesItsLimitsOrItsRateForAnyInput, ()) {
  const Pid::Settings settings = any_pid_settings();
  const double step = settings.limits.rate_per_s * kPeriod_s * (1.0 + 1e-12);
  Random random = any_random();
  Pid pid(settings, kRate_Hz);
  double last = 0.0;
  double reference = 0.0;
  double measurement = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    if (random.uniform() < 0.01) reference = 10.0 * random.normal();
    measurement = 0.9 * measurement + random.normal();
    const double spoiled = random.uniform();
    const double measured = spoiled < 0.01 ? kNaN : spoiled < 0.02 ? 1e308 : measurement;
    const Pid::Output output = pid.step(reference, measured, random.normal());
    RC_ASSERT(output.command >= settings.limits.lowest);
    RC_ASSERT(output.command <= settings.limits.highest);
    RC_ASSERT(std::abs(output.command - last) <= step);
    if (std::isnan(measured)) RC_ASSERT(output.fault == Fault::input_not_finite);
    last = output.command;
  }
}

RC_GTEST_PROP(Pid, ChangesItsGainsWithoutABump, ()) {
  Pid::Settings settings = any_pid_settings();
  settings.limits = {};
  settings.derivative_cutoff_Hz = std::nullopt;
  Random random = any_random();
  Pid pid(settings, kRate_Hz);
  double measurement = random.normal();
  const double reference = random.normal();
  double last_rate = 0.0;
  for (int n = 0; n < 50; ++n) {
    last_rate = 1e-3 * random.normal();
    measurement += last_rate;
    (void)pid.step(reference, measurement);
  }
  Pid unchanged = pid;
  const Pid::Gains gains = any_gains();
  RC_ASSERT(pid.set_gains(gains));
  // The measurement continues at its rate: equal conditions, and the two have equal outputs.
  const Pid::Output before = unchanged.step(reference, measurement + last_rate);
  const Pid::Output after = pid.step(reference, measurement + last_rate);
  const double drift = (settings.gains.proportional - gains.proportional) * last_rate;
  RC_ASSERT(std::abs(after.command - before.command - drift) < 1e-9);
}

RC_GTEST_PROP(Pid, StartsFromTheCommandThatItIsGiven, ()) {
  Pid::Settings settings = any_pid_settings();
  Random random = any_random();
  Pid pid(settings, kRate_Hz);
  for (int n = 0; n < 20; ++n) (void)pid.step(random.normal(), random.normal());
  const double command = any_number(-0.1, 0.1);
  pid.start(command);
  RC_ASSERT(std::abs(pid.step(random.normal(), random.normal(), random.normal()).command -
                     command) < 1e-9);
}

// What has gone wrong once leaves no trace: the same commands as if it had not been.
// Time passes while a measurement is missing; the derivative must not take what happened in it for
// the work of one tick.
TEST(Pid, HasNoKickOfItsDerivativeAfterAGap) {
  for (const auto derivative_of : {Pid::DerivativeOf::measurement, Pid::DerivativeOf::error}) {
    for (const std::optional<double> cutoff_Hz : {std::optional(120.0), std::optional<double>()}) {
      Pid pid({.gains = {.derivative = 1.0},
               .derivative_of = derivative_of,
               .derivative_cutoff_Hz = cutoff_Hz},
              kRate_Hz);
      int ticks = 0;
      const auto step = [&](bool is_lost) {
        const double ramp = ++ticks / kRate_Hz;
        return pid.step(0.0, is_lost ? kNaN : ramp);
      };
      for (int n = 0; n < 1000; ++n) step(false);
      for (int n = 0; n < 50; ++n) EXPECT_EQ(step(true).fault, Fault::input_not_finite);
      for (int n = 0; n < 50; ++n) EXPECT_NEAR(step(false).derivative, -1.0, 1e-6) << n;
    }
  }
}

// But for the derivative's next difference.
RC_GTEST_PROP(Pid, PassesOverWhatIsNotFinite, ()) {
  Pid::Settings settings = any_pid_settings();
  settings.gains.derivative = 0.0;
  Random random = any_random();
  Pid disturbed(settings, kRate_Hz);
  Pid sound(settings, kRate_Hz);
  for (int n = 0; n < 100; ++n) {
    const double reference = random.normal();
    const double measurement = random.normal();
    const double command = sound.step(reference, measurement).command;
    RC_ASSERT(disturbed.step(reference, measurement).command == command);
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      for (const Pid::Output& held :
           {disturbed.step(bad, measurement), disturbed.step(reference, bad),
            disturbed.step(reference, measurement, bad)}) {
        RC_ASSERT(held.fault == Fault::input_not_finite);
        RC_ASSERT(held.command == command);
      }
      disturbed.track(bad);
    }
  }
}

}  // namespace
}  // namespace torsio
