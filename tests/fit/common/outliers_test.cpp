#include "fit/common/outliers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace torsio {
namespace {

/// A swing between -1 and 1.
std::vector<double> swing(std::size_t samples) {
  std::vector<double> values(samples);
  for (std::size_t n = 0; n < samples; ++n) values[n] = std::sin(0.01 * static_cast<double>(n));
  return values;
}

std::size_t outliers(const std::vector<double>& values) {
  std::vector<double> scratch = values;
  const OutlierLimits limits = outlier_limits(scratch);
  std::size_t count = 0;
  for (const double value : values)
    if (!limits.contain(value)) ++count;
  return count;
}

TEST(OutlierLimits, FindAnAbsurdValueFromAThousandSamplesOn) {
  std::vector<double> values = swing(1000);
  EXPECT_EQ(outliers(values), 0U);
  values[500] = 1e12;
  EXPECT_EQ(outliers(values), 1U);
  values[500] = -1e12;
  EXPECT_EQ(outliers(values), 1U);
  values.pop_back();
  EXPECT_EQ(outliers(values), 0U) << "999 samples";
}

TEST(OutlierLimits, AreWithinTheNumberAndTheShare) {
  for (const auto& [samples, most] : {std::pair<std::size_t, std::size_t>{1000, 1},
                                      {19999, 1},
                                      {20000, 2},
                                      {100000, 10},
                                      {300000, 10}}) {
    std::vector<double> values = swing(samples);
    for (std::size_t k = 0; k < most; ++k) values[100 + 7 * k] = k % 2 == 0 ? 1e6 : -1e6;
    EXPECT_EQ(outliers(values), most) << samples;
    values[90] = 1e6;
    EXPECT_LE(outliers(values), most) << samples << ": more frequent values are data";
  }
}

TEST(OutlierLimits, AreOutsideFiveTimesTheRange) {
  std::vector<double> values = swing(20000);
  values[777] = 4.9;  // the range is 2 wide
  EXPECT_EQ(outliers(values), 0U);
  values[777] = 5.2;
  EXPECT_EQ(outliers(values), 1U);
}

TEST(OutlierLimits, AnExcursionThroughTheValuesBetweenIsAMotion) {
  std::vector<double> values = swing(100000);
  for (std::size_t k = 0; k < 10; ++k) values[500 + k] = 1.0 + 1.5 * static_cast<double>(k);
  EXPECT_EQ(outliers(values), 0U);
  values[700] = 1e12;  // beyond the motion by a gap
  EXPECT_EQ(outliers(values), 1U);
}

TEST(OutlierLimits, TheMostDistantComeFirst) {
  std::vector<double> values = swing(10000);  // one outlier is possible
  values[100] = -20.0;
  values[200] = 1e12;
  std::vector<double> scratch = values;
  const OutlierLimits limits = outlier_limits(scratch);
  EXPECT_FALSE(limits.contain(1e12));
  EXPECT_TRUE(limits.contain(-20.0));
}

TEST(OutlierLimits, AConstantChannelIsMeasuredAgainstItsMagnitudeOrOneUnit) {
  std::vector<double> values(5000, 0.3);
  values[100] = 2.0;
  EXPECT_EQ(outliers(values), 0U);
  values[100] = 1e12;
  EXPECT_EQ(outliers(values), 1U);
  std::vector<double> temperatures(5000, 300.0);
  temperatures[100] = 350.0;
  EXPECT_EQ(outliers(temperatures), 0U);
  temperatures[100] = -273.0 * 4.0;
  EXPECT_EQ(outliers(temperatures), 1U);
  EXPECT_EQ(outliers({}), 0U);
}

}  // namespace
}  // namespace torsio
