#include "torsio/signal/lowpass.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kNaN;

// The response to one 1 after a 0 (which starts the filter at rest).
std::vector<double> impulse_response(Lowpass filter, std::size_t count) {
  (void)filter.step(0.0);
  std::vector<double> response{filter.step(1.0)};
  while (response.size() < count) response.push_back(filter.step(0.0));
  return response;
}

TEST(Butterworth, StartsInTheSteadyStateOfItsFirstInput) {
  Lowpass filter(10.0, 1000.0);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(filter.step(-3.7), -3.7);
  filter.reset();
  EXPECT_EQ(filter.step(0.1), 0.1);
}

TEST(Butterworth, SettlesToOnePercentOfAStepInItsStatedSamples) {
  for (const double cutoff_Hz : {0.02, 1.0, 10.0, 120.0, 250.0, 400.0, 499.0}) {
    SCOPED_TRACE(cutoff_Hz);
    Lowpass filter(cutoff_Hz, 1000.0);
    const std::size_t promised = filter.settling_samples();
    (void)filter.step(0.0);
    std::size_t needed = 0;
    for (std::size_t n = 1; n < 4 * promised + 10; ++n)
      if (std::abs(filter.step(1.0) - 1.0) > 0.01) needed = n + 1;
    EXPECT_LE(needed, promised);
    if (cutoff_Hz < 100.0) {
      EXPECT_GE(static_cast<double>(needed), 0.9 * static_cast<double>(promised));
    }
  }
}

TEST(Butterworth, ComputesItsGainForWhiteNoise) {
  for (const double cutoff_Hz : {0.5, 10.0, 120.0, 400.0}) {
    SCOPED_TRACE(cutoff_Hz);
    const Lowpass filter(cutoff_Hz, 1000.0);
    double energy = 0.0;
    for (const double value : impulse_response(filter, 20'000)) energy += value * value;
    EXPECT_NEAR(filter.noise_gain(), std::sqrt(energy), 1e-9);
  }
}

TEST(Butterworth, IgnoresSamplesThatAreNotFinite) {
  Lowpass disturbed(10.0, 1000.0);
  Lowpass quiet(10.0, 1000.0);
  Random random(3);
  EXPECT_TRUE(std::isnan(disturbed.step(kNaN)));
  for (int i = 0; i < 200; ++i) {
    const double input = random.normal();
    EXPECT_EQ(disturbed.step(input), quiet.step(input));
    if (i % 50 == 0) {
      EXPECT_TRUE(std::isnan(disturbed.step(kNaN)));
    }
    if (i % 60 == 0) {
      EXPECT_TRUE(std::isinf(disturbed.step(std::numeric_limits<double>::infinity())));
    }
  }
}

TEST(Butterworth, RecoversFromInputsThatOverflowIt) {
  Lowpass filter(400.0, 1000.0);
  constexpr double kHuge = std::numeric_limits<double>::max();
  for (int i = 0; i < 20; ++i) (void)filter.step(i % 2 == 0 ? kHuge : -kHuge);
  double last = 0.0;
  for (int i = 0; i < 5000; ++i) last = filter.step(1.0);
  EXPECT_NEAR(last, 1.0, 1e-9);
}

TEST(Butterworth, RefusesCutOffsThatTheRateCannotCarry) {
  EXPECT_THROW(Lowpass(500.0, 1000.0), UsageError);
  EXPECT_THROW(Lowpass(0.0, 1000.0), UsageError);
  EXPECT_THROW(Lowpass(-1.0, 1000.0), UsageError);
  EXPECT_THROW(Lowpass(kNaN, 1000.0), UsageError);
  EXPECT_THROW(Lowpass(1.0, 0.0), UsageError);
  EXPECT_THROW(Lowpass(1.0, kNaN), UsageError);
  EXPECT_NO_THROW(Lowpass(499.9, 1000.0));
}

}  // namespace
}  // namespace torsio
