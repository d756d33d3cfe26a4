#include "torsio/signal/excitation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::kNaN;
using test::kRate_Hz;

constexpr double kTurn = 2.0 * std::numbers::pi;

template <class Signal>
std::vector<double> samples(Signal& signal, std::size_t count) {
  std::vector<double> values(count);
  for (double& value : values) value = signal.step();
  return values;
}

template <class Signal>
void expect_repeatable(Signal signal) {
  const std::vector<double> first = samples(signal, 5000);
  EXPECT_NE(*std::min_element(first.begin(), first.end()),
            *std::max_element(first.begin(), first.end()));
  signal.reset();
  EXPECT_EQ(samples(signal, 5000), first);
  Signal copy = signal;
  EXPECT_EQ(samples(copy, 100), samples(signal, 100));
}

TEST(Excitation, RepeatsAfterResetAndInCopies) {
  expect_repeatable(Chirp({}, kRate_Hz));
  expect_repeatable(Triangle({}, kRate_Hz));
  expect_repeatable(TrapezoidSweep({}, kRate_Hz));
  expect_repeatable(Multisine({{1.0, 3.0}, {0.5, 0.25}, 4}, kRate_Hz));
  expect_repeatable(BandLimitedNoise({}, kRate_Hz));
  expect_repeatable(QuasiPeriodic({}, kRate_Hz));
  expect_repeatable(Steps({{1.0, -2.0, 3.0}, 0.7}, kRate_Hz));
}

TEST(Chirp, SweepsItsFrequencyLinearlyAndThenStays) {
  Chirp chirp({.amplitude = 2.0, .start_Hz = 1.0, .end_Hz = 5.0, .duration_s = 10.0}, kRate_Hz);
  const std::vector<double> values = samples(chirp, 12'001);
  std::vector<double> rises_s;  // times of upward zero crossings
  for (std::size_t n = 1; n < values.size(); ++n)
    if (values[n - 1] < 0.0 && values[n] >= 0.0)
      rises_s.push_back((static_cast<double>(n) - values[n] / (values[n] - values[n - 1])) /
                        kRate_Hz);
  // 30 turns up to 10 s: the k-th is complete at t + 0.2 t^2 = k, and 10 more at 5 Hz follow.
  ASSERT_GE(rises_s.size(), 39U);
  for (std::size_t i = 0; i < rises_s.size(); ++i) {
    const double turns = static_cast<double>(i) + 1.0;
    const double expected_s =
        turns <= 30.0 ? (std::sqrt(1.0 + 0.8 * turns) - 1.0) / 0.4 : 10.0 + (turns - 30.0) / 5.0;
    EXPECT_NEAR(rises_s[i], expected_s, 1e-5);
  }
  EXPECT_NEAR(*std::max_element(values.begin(), values.end()), 2.0, 1e-3);
}

TEST(Triangle, GoesStraightBetweenItsCorners) {
  Triangle triangle({.amplitude = 3.0, .frequency_Hz = 2.0}, kRate_Hz);
  const std::vector<double> values = samples(triangle, 1001);
  EXPECT_EQ(values[0], 0.0);
  EXPECT_DOUBLE_EQ(values[125], 3.0);
  EXPECT_NEAR(values[250], 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(values[375], -3.0);
  for (std::size_t n = 1; n < values.size(); ++n)
    EXPECT_NEAR(std::abs(values[n] - values[n - 1]), 3.0 * 4.0 * 2.0 / kRate_Hz, 1e-12);
}

TEST(TrapezoidSweep, KeepsItsLimitsAndReachesItsEnds) {
  const TrapezoidSweep::Parameters parameters{.amplitude = 2.0, .speed = 1.5, .acceleration = 4.0};
  TrapezoidSweep sweep(parameters, kRate_Hz);
  const std::vector<double> values = samples(sweep, 20'000);
  double fastest = 0.0;
  for (std::size_t n = 1; n < values.size(); ++n) {
    const double speed = (values[n] - values[n - 1]) * kRate_Hz;
    fastest = std::max(fastest, std::abs(speed));
    if (n < 2) continue;
    const double previous_speed = (values[n - 1] - values[n - 2]) * kRate_Hz;
    EXPECT_LE(std::abs(speed - previous_speed) * kRate_Hz, 4.0 * (1.0 + 1e-6)) << n;
  }
  EXPECT_EQ(values[0], 0.0);
  EXPECT_NEAR(fastest, 1.5, 1e-9);
  EXPECT_NEAR(*std::max_element(values.begin(), values.end()), 2.0, 1e-5);
  EXPECT_NEAR(*std::min_element(values.begin(), values.end()), -2.0, 1e-5);
  // From rest to rest over 4 units: 4 / 1.5 s at full speed and 1.5 / 4 s for the ramps.
  const double stroke_s = 4.0 / 1.5 + 1.5 / 4.0;
  const double first_s = 2.0 / 1.5 + 1.5 / 4.0;
  EXPECT_NEAR(values[static_cast<std::size_t>((first_s + stroke_s) * kRate_Hz)], -2.0, 1e-5);
}

TEST(TrapezoidSweep, CrossesAShortRangeWithoutReachingFullSpeed) {
  TrapezoidSweep sweep({.amplitude = 0.1, .speed = 100.0, .acceleration = 4.0}, kRate_Hz);
  const std::vector<double> values = samples(sweep, 5000);
  EXPECT_NEAR(*std::max_element(values.begin(), values.end()), 0.1, 1e-5);
  double fastest = 0.0;
  for (std::size_t n = 1; n < values.size(); ++n)
    fastest = std::max(fastest, std::abs(values[n] - values[n - 1]) * kRate_Hz);
  EXPECT_NEAR(fastest, std::sqrt(0.2 * 4.0), 2e-3);
}

TEST(Multisine, HoldsEachAmplitudeAtItsFrequency) {
  Multisine multisine({{2.0, 7.0}, {0.5, 1.5}, 21}, kRate_Hz);
  const std::vector<double> values = samples(multisine, 1000);  // whole turns of both
  const auto amplitude_at = [&](double frequency_Hz) {
    double sine = 0.0;
    double cosine = 0.0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      const double angle = kTurn * frequency_Hz * static_cast<double>(n) / kRate_Hz;
      sine += values[n] * std::sin(angle) / 500.0;
      cosine += values[n] * std::cos(angle) / 500.0;
    }
    return std::hypot(sine, cosine);
  };
  EXPECT_NEAR(amplitude_at(2.0), 0.5, 1e-12);
  EXPECT_NEAR(amplitude_at(7.0), 1.5, 1e-12);
  EXPECT_NEAR(amplitude_at(4.0), 0.0, 1e-12);
  Multisine other({{2.0, 7.0}, {0.5, 1.5}, 22}, kRate_Hz);
  EXPECT_NE(samples(other, 10), std::vector<double>(values.begin(), values.begin() + 10));
}

TEST(RandomWalk, HasTheRequestedRmsBelowItsCutOff) {
  BandLimitedNoise walk({.rms = 2.5, .cutoff_Hz = 1.0, .seed = 5}, 100.0);
  EXPECT_EQ(walk.step(), 0.0);
  const std::vector<double> values = samples(walk, 200'000);  // about 4000 independent values
  double square = 0.0;
  double speed_square = 0.0;
  for (std::size_t n = 1; n < values.size(); ++n) {
    square += values[n] * values[n];
    speed_square += std::pow((values[n] - values[n - 1]) * 100.0, 2.0);
  }
  const auto count = static_cast<double>(values.size());
  EXPECT_NEAR(std::sqrt(square / count), 2.5, 0.1);
  // For |H|^2 = 1 / (1 + (f / fc)^4) the mean square frequency is fc^2.
  EXPECT_NEAR(std::sqrt(speed_square / square), kTurn, 0.05 * kTurn);
}

TEST(QuasiPeriodic, SpreadsAmplitudesAndPeriodsAroundTheirMeans) {
  QuasiPeriodic hand({.amplitude = 20.0, .frequency_Hz = 0.4, .seed = 6}, kRate_Hz);
  const std::vector<double> values = samples(hand, 10'000'000);
  std::vector<double> periods_s;
  std::vector<double> peaks;
  double peak = 0.0;
  double began_s = 0.0;
  for (std::size_t n = 1; n < values.size(); ++n) {
    peak = std::max(peak, std::abs(values[n]));
    EXPECT_LT(std::abs(values[n] - values[n - 1]), 0.12) << "a jump at " << n;
    if (!(values[n - 1] < 0.0 && values[n] >= 0.0)) continue;
    const double crossed_s =
        (static_cast<double>(n) - values[n] / (values[n] - values[n - 1])) / kRate_Hz;
    periods_s.push_back(crossed_s - began_s);
    peaks.push_back(peak);
    began_s = crossed_s;
    peak = 0.0;
  }
  const auto count = static_cast<double>(periods_s.size());
  EXPECT_NEAR(count, 4000.0, 30.0);
  const auto expect_spread = [&](const std::vector<double>& of, double mean, double share) {
    double sum = 0.0;
    double squares = 0.0;
    for (const double value : of) sum += value;
    for (const double value : of) squares += (value - sum / count) * (value - sum / count);
    // Four standard errors; the cut at 3 takes 0.7 % of the spread.
    EXPECT_NEAR(sum / count, mean, 4.0 * share * mean / std::sqrt(count));
    EXPECT_NEAR(std::sqrt(squares / count) / mean, share, 0.06 * share);
    for (const double value : of) EXPECT_LE(std::abs(value / mean - 1.0), 3.01 * share);
  };
  expect_spread(peaks, 20.0, 0.15);
  expect_spread(periods_s, 2.5, 0.12);
}

TEST(QuasiPeriodic, IsASineWithoutSpread) {
  QuasiPeriodic sine(
      {.amplitude = 2.0, .frequency_Hz = 3.0, .amplitude_spread = 0.0, .period_spread = 0.0},
      kRate_Hz);
  const std::vector<double> values = samples(sine, 5000);
  for (std::size_t n = 0; n < values.size(); ++n)
    ASSERT_NEAR(values[n], 2.0 * std::sin(kTurn * 3.0 * static_cast<double>(n) / kRate_Hz), 1e-9);
}

TEST(Steps, HoldEachLevelForExactlyItsTime) {
  Steps steps({.levels = {1.0, -2.0, 5.0}, .hold_s = 0.1}, kRate_Hz);
  const std::vector<double> values = samples(steps, 1000);
  const std::vector<double> levels{1.0, -2.0, 5.0};
  for (std::size_t n = 0; n < values.size(); ++n) EXPECT_EQ(values[n], levels[n / 100 % 3]) << n;
}

TEST(Excitation, RefusesParametersOutOfRange) {
  EXPECT_THROW(Chirp({.end_Hz = 500.0}, kRate_Hz), UsageError);
  EXPECT_THROW(Chirp({.start_Hz = -1.0}, kRate_Hz), UsageError);
  EXPECT_THROW(Chirp({.duration_s = 0.0}, kRate_Hz), UsageError);
  EXPECT_THROW(Chirp({.amplitude = kNaN}, kRate_Hz), UsageError);
  EXPECT_THROW(Chirp({}, 0.0), UsageError);
  EXPECT_THROW(Triangle({.frequency_Hz = kNaN}, kRate_Hz), UsageError);
  EXPECT_THROW(TrapezoidSweep({.amplitude = 0.0}, kRate_Hz), UsageError);
  EXPECT_THROW(TrapezoidSweep({.speed = -1.0}, kRate_Hz), UsageError);
  EXPECT_THROW(TrapezoidSweep({.acceleration = kNaN}, kRate_Hz), UsageError);
  EXPECT_THROW(TrapezoidSweep({}, -1.0), UsageError);
  EXPECT_THROW(Multisine({}, kRate_Hz), UsageError);
  EXPECT_THROW(Multisine({{1.0, 2.0}, {1.0}, 1}, kRate_Hz), UsageError);
  EXPECT_THROW(Multisine({{600.0}, {1.0}, 1}, kRate_Hz), UsageError);
  EXPECT_THROW(BandLimitedNoise({.rms = -1.0}, kRate_Hz), UsageError);
  EXPECT_THROW(BandLimitedNoise({.cutoff_Hz = 500.0}, kRate_Hz), UsageError);
  EXPECT_THROW(QuasiPeriodic({.amplitude = kNaN}, kRate_Hz), UsageError);
  EXPECT_THROW(QuasiPeriodic({.period_spread = 0.31}, kRate_Hz), UsageError);
  EXPECT_THROW(QuasiPeriodic({.amplitude_spread = -0.1}, kRate_Hz), UsageError);
  EXPECT_THROW(QuasiPeriodic({.frequency_Hz = 60.0, .period_spread = 0.3}, kRate_Hz), UsageError);
  EXPECT_THROW(Steps({}, kRate_Hz), UsageError);
  EXPECT_THROW(Steps({{1.0}, 0.0}, kRate_Hz), UsageError);
  EXPECT_THROW(Steps({{kNaN}, 1.0}, kRate_Hz), UsageError);
  try {
    const Chirp chirp({.end_Hz = 500.0}, kRate_Hz);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "chirp: frequency: expected at least 0 and below 500 Hz, half the sample rate, "
                 "found 500");
  }
}

// Its phase grows by f0 T / ln r (r^(t/T) - 1) turns: the frequency is f0 r^(t/T).
TEST(LogSweep, GivesEveryOctaveTheSameTime) {
  LogSweep sweep({.amplitude = 2.0, .start_Hz = 1.0, .end_Hz = 8.0, .duration_s = 3.0}, 10'000.0);
  std::vector<double> rising_s;
  double last = sweep.step();
  EXPECT_EQ(last, 0.0);
  for (int n = 1; n < 40'000; ++n) {
    const double now = sweep.step();
    if (last < 0.0 && now >= 0.0) rising_s.push_back(n / 10'000.0);
    last = now;
  }
  for (std::size_t k = 0; k < rising_s.size(); ++k) {
    const double t = rising_s[k];
    const double turns = t <= 3.0 ? (std::pow(8.0, t / 3.0) - 1.0) * 3.0 / std::log(8.0)
                                  : 21.0 / std::log(8.0) + 8.0 * (t - 3.0);
    EXPECT_NEAR(turns, static_cast<double>(k + 1), 2e-3);
  }
  EXPECT_EQ(rising_s.size(), 18U);
}

TEST(LogSweep, StaysAtItsFrequencyWhereBothEndsAreOne) {
  LogSweep sweep({.start_Hz = 5.0, .end_Hz = 5.0, .duration_s = 1.0}, 1000.0);
  for (int n = 0; n < 3000; ++n)
    ASSERT_NEAR(sweep.step(), std::sin(2.0 * std::numbers::pi * 5e-3 * n), 1e-9);
}

TEST(Replay, GoesThroughTheValuesAtAnotherRate) {
  Replay replay({.values = {1.0, 3.0, 2.0}, .recorded_Hz = 100.0}, 200.0);
  for (const double expected : {1.0, 2.0, 3.0, 2.5, 2.0, 2.0, 2.0})
    EXPECT_NEAR(replay.step(), expected, 1e-12);
  replay.reset();
  EXPECT_EQ(replay.step(), 1.0);
  Replay again({.values = {1.0, 3.0, 2.0}, .recorded_Hz = 100.0, .repeats = true}, 200.0);
  for (const double expected : {1.0, 2.0, 3.0, 2.5, 2.0, 1.5, 1.0, 2.0})
    EXPECT_NEAR(again.step(), expected, 1e-12);
}

TEST(References, RefuseWhatTheyCannotFollow) {
  EXPECT_THROW(LogSweep({.start_Hz = 0.0}, 1000.0), UsageError);
  EXPECT_THROW(LogSweep({.end_Hz = 500.0}, 1000.0), UsageError);
  EXPECT_THROW(LogSweep({.duration_s = 0.0}, 1000.0), UsageError);
  EXPECT_THROW(Replay({.values = {}}, 1000.0), UsageError);
  EXPECT_THROW(Replay({.values = {std::nan("")}}, 1000.0), UsageError);
  EXPECT_THROW(Replay({.values = {1.0}, .recorded_Hz = 0.0}, 1000.0), UsageError);
}

}  // namespace
}  // namespace torsio
