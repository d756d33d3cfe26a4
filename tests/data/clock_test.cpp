#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "data/inspect_clock.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

std::vector<double> even_stamps(std::size_t samples, double period_s) {
  std::vector<double> stamps(samples);
  for (std::size_t i = 0; i < samples; ++i) stamps[i] = 5.0 + static_cast<double>(i) * period_s;
  return stamps;
}

TEST(Clock, EvenStampsAreUniform) {
  const ClockReport report = inspect_clock(even_stamps(1000, 0.002));
  EXPECT_TRUE(report.is_uniform());
  EXPECT_NEAR(report.sample_rate_Hz, 500.0, 1e-9);
  EXPECT_NEAR(report.stamp_step_s, 0.002, 1e-12);
}

TEST(Clock, OneMissingSampleAnywhereIsSeen) {
  for (const std::size_t missing : {1U, 2U, 250U, 500U, 997U, 998U}) {
    auto stamps = even_stamps(1000, 0.002);
    stamps.erase(stamps.begin() + missing);
    const ClockReport report = inspect_clock(stamps);
    EXPECT_FALSE(report.is_uniform()) << missing;
    EXPECT_EQ(report.worst_interval, missing);
  }
}

TEST(Clock, CountsDuplicatedAndBackwardStamps) {
  const ClockReport report = inspect_clock(std::vector<double>{0.0, 1.0, 1.0, 2.0, 1.5, 3.0});
  EXPECT_EQ(report.duplicated, 1U);
  EXPECT_EQ(report.backward, 1U);
  EXPECT_EQ(report.first_not_increasing, 2U);
  EXPECT_FALSE(report.is_uniform());
}

TEST(Clock, NeedsTwoFiniteStamps) {
  EXPECT_FALSE(inspect_clock(std::vector<double>{}).is_uniform());
  EXPECT_FALSE(inspect_clock(std::vector<double>{1.0}).is_uniform());
  EXPECT_FALSE(inspect_clock(std::vector<double>{1.0, 1.0}).is_uniform());
  EXPECT_EQ(inspect_clock(std::vector<double>{0.0, std::nan(""), 2.0}).not_finite, 1U);
}

TEST(Clock, TheSimplestRateIsFoundAsFrequencyOrPeriod) {
  EXPECT_EQ(simplest_rate(1000.0000000001, 1e-9), 1000.0);
  EXPECT_EQ(simplest_rate(833.33333333334, 1e-9), 1.0 / 0.0012);
  EXPECT_EQ(simplest_rate(999.97, 1e-6), 999.97);
}

}  // namespace
}  // namespace torsio
