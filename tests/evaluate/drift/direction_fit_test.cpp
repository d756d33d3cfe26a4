#include "evaluate/drift/direction_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "torsio/core/random.hpp"

namespace torsio::test {
namespace {

constexpr std::size_t kSamples = 4000;

TEST(FitDirections, FindsTheCoefficientsAndTheirErrorsInCorrelatedNoise) {
  constexpr int kRuns = 200;
  int covered = 0;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(run));
    Matrix columns(kSamples, 2);
    std::vector<double> residual(kSamples);
    double noise = 0.0;
    for (std::size_t n = 0; n < kSamples; ++n) {
      noise = 0.9 * noise + 0.1 * random.normal();
      columns(n, 0) = 1.0;
      columns(n, 1) = std::sin(0.02 * static_cast<double>(n));
      residual[n] = 0.3 - 0.2 * columns(n, 1) + noise;
    }
    const DirectionFit fit = fit_directions(columns, residual, 200, 1);
    EXPECT_NEAR(fit.coefficients[0], 0.3, 0.1);
    if (std::abs(fit.coefficients[1] + 0.2) < 1.96 * fit.standard_errors[1]) ++covered;
  }
  // 95 % of them, less than 4 standard deviations of the count; white errors would cover about 35 %.
  EXPECT_GT(covered, 0.88 * kRuns);
}

/// An error of the model of the RMS 0.1 that turns slowly, and white noise.
DirectionFit with_noise(double noise, std::size_t samples) {
  Random random(5);
  DirectionFit fit;
  for (std::size_t n = 0; n < samples; ++n)
    fit.residual.push_back(0.1 * std::numbers::sqrt2 * std::sin(0.02 * static_cast<double>(n)) +
                           noise * random.normal());
  return fit;
}

TEST(LastingError, IsThatOfTheModelAndNotTheNoise) {
  for (const double noise : {0.0, 0.1, 0.3}) {
    const LastingError found = with_noise(noise, 20'000).lasting_error(1);
    EXPECT_NEAR(found.rms, 0.1, 0.01) << noise;
    EXPECT_TRUE(found.is_resolved) << noise;
  }
}

TEST(LastingError, IsWhatTheNoiseCannotExcludeWhereItIsHidden) {
  const LastingError found = with_noise(3.0, 20'000).lasting_error(1);
  EXPECT_FALSE(found.is_resolved);
  EXPECT_GT(found.rms, 0.1);
  EXPECT_LT(found.rms, 0.15 * 3.0);
}

TEST(FitDirections, LeavesOutWhatTheOthersExplain) {
  Matrix columns(kSamples, 3);
  std::vector<double> residual(kSamples);
  for (std::size_t n = 0; n < kSamples; ++n) {
    columns(n, 0) = 1.0;
    columns(n, 1) = std::sin(0.02 * static_cast<double>(n));
    columns(n, 2) = 2.0 * columns(n, 1) + 0.001 * std::sin(0.05 * static_cast<double>(n));
    residual[n] = columns(n, 1) + 0.01 * std::sin(0.3 * static_cast<double>(n));
  }
  const DirectionFit fit = fit_directions(columns, residual, 100, 1);
  EXPECT_NEAR(fit.coefficients[1], 1.0, 0.01);
  EXPECT_EQ(fit.own_rms[2], 0.0);
  EXPECT_TRUE(std::isnan(fit.standard_errors[2]));
}

}  // namespace
}  // namespace torsio::test
