#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "sim/closed_loop/tracking_parts.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

std::vector<double> sine(double amplitude, double frequency_Hz, double duration_s) {
  std::vector<double> values(static_cast<std::size_t>(duration_s * kRate_Hz));
  for (std::size_t n = 0; n < values.size(); ++n)
    values[n] = amplitude *
                std::sin(2.0 * std::numbers::pi * frequency_Hz * static_cast<double>(n) / kRate_Hz);
  return values;
}

TEST(LimitCycle, IsFoundWithItsFrequencyInASlowError) {
  std::vector<double> error = sine(2.0, 0.2, 10.0);
  const std::vector<double> cycle = sine(0.5, 11.0, 10.0);
  for (std::size_t i = 4000; i < 7000; ++i) error[i] += cycle[i];
  const auto found = find_limit_cycle(error, std::vector<double>(error.size(), 0.0), 0.1, kRate_Hz);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->frequency_Hz, 11.0, 0.5);
  EXPECT_NEAR(found->amplitude, 0.5, 0.2);
}

// A loop of 1 kHz with two ticks of delay cycles at the upper end.
TEST(LimitCycle, IsFoundAtEveryFrequencyUpToNearlyAQuarterOfTheSampleRate) {
  for (int frequency_Hz = 5; frequency_Hz <= 240; frequency_Hz += 5) {
    const std::vector<double> cycle = sine(0.5, frequency_Hz + 0.3, 4.0);
    const auto found =
        find_limit_cycle(cycle, std::vector<double>(cycle.size(), 0.0), 0.1, kRate_Hz);
    ASSERT_TRUE(found) << frequency_Hz;
    EXPECT_NEAR(found->frequency_Hz, frequency_Hz + 0.3, 0.05 * frequency_Hz);
    EXPECT_NEAR(found->amplitude, 0.5, 0.2) << frequency_Hz;
  }
}

TEST(LimitCycle, RefusesAReferenceOfAnotherLength) {
  EXPECT_NE(test::error_message([] {
              (void)find_limit_cycle(std::vector<double>(10), std::vector<double>(9), 0.1,
                                     kRate_Hz);
            }).find("of 10 samples"),
            std::string::npos);
}

TEST(LimitCycle, IsNoneInSlowMotionSmallMotionNoiseOrADecay) {
  const std::vector<double> none(10000, 0.0);
  EXPECT_FALSE(find_limit_cycle(sine(2.0, 1.0, 10.0), none, 0.1, kRate_Hz));
  EXPECT_FALSE(find_limit_cycle(sine(0.05, 11.0, 10.0), none, 0.1, kRate_Hz));
  Random random(5);
  std::vector<double> noise(10000);
  for (double& value : noise) value = random.normal();
  EXPECT_FALSE(find_limit_cycle(noise, none, 0.1, kRate_Hz));
  std::vector<double> decay = sine(2.0, 11.0, 10.0);
  for (std::size_t i = 0; i < decay.size(); ++i)
    decay[i] *= std::exp(-2.0 * static_cast<double>(i) / kRate_Hz);
  EXPECT_FALSE(find_limit_cycle(decay, none, 0.1, kRate_Hz));
}

TEST(LimitCycle, IsNoneWhereTheReferenceMovesSo) {
  const std::vector<double> wanted = sine(2.0, 11.0, 10.0);
  EXPECT_FALSE(find_limit_cycle(wanted, wanted, 0.1, kRate_Hz));
}

}  // namespace
}  // namespace torsio
