#include "evaluate/monitor/exceedance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::ElementsAre;
using testing::IsNan;

TEST(Persisting, IsReachedByAThirdOfTheWindow) {
  const std::vector<double> values{1.0, 5.0, 4.0, 3.0, 6.0, 7.0, 8.0};
  EXPECT_THAT(persisting(values, 2), ElementsAre(IsNan(), 1.0, 4.0, 4.0, 5.0, 6.0, 7.0));
  EXPECT_THAT(persisting(values, 1), ElementsAre(1.0, 5.0, 5.0, 5.0, 6.0, 7.0, 8.0));
  EXPECT_TRUE(persisting({}, 3).empty());
}

// One value after NaN, or at the begin, does not persist.
TEST(Persisting, PassesOverWhatIsNotANumber) {
  const std::vector<double> values{9.0,          kNotMeasured, 8.0, 1.0,
                                   kNotMeasured, kNotMeasured, 7.0, 6.0};
  EXPECT_THAT(persisting(values, 2),
              ElementsAre(IsNan(), IsNan(), 8.0, 8.0, IsNan(), IsNan(), 8.0, 8.0));
  EXPECT_THAT(persisting(values, 5),
              ElementsAre(IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), 1.0));
}

TEST(BlockMaxima, CountsCompleteBlocksAcrossCalls) {
  BlockMaxima maxima(4);
  maxima.add(std::vector{1.0, 2.0, 3.0});
  EXPECT_EQ(maxima.size(), 0U);
  maxima.add(std::vector{9.0, 1.0});
  EXPECT_EQ(maxima.size(), 1U);
  EXPECT_EQ(maxima.largest(), 9.0);
  maxima.add(std::vector{kNotMeasured, kNotMeasured, 4.0});
  EXPECT_EQ(maxima.size(), 2U);
  maxima.add(std::vector<double>(4, kNotMeasured));
  EXPECT_EQ(maxima.size(), 2U) << "a block without a value is none";
}

TEST(BlockMaxima, TheThresholdIsExceededAtTheWantedRate) {
  // Blocks of one exponential number of mean 1: P(x > h) = exp(-h).
  Random random(3);
  BlockMaxima maxima(1);
  std::vector<double> values(20'000);
  for (double& value : values) value = -std::log(1.0 - random.uniform());
  maxima.add(values);
  // Within the data a little above what was observed, beyond it along the tail.
  EXPECT_GE(maxima.threshold(0.01), 1.05 * maxima.largest());
  EXPECT_NEAR(maxima.threshold(1e-8), -std::log(1e-8), 1.5);
  EXPECT_GT(maxima.threshold(1e-10), maxima.threshold(1e-8));
}

TEST(BlockMaxima, ValuesBelowZeroHaveATailAsWell) {
  Random random(4);
  BlockMaxima maxima(1);
  BlockMaxima shifted(1);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::exp(0.5 * random.normal());
    maxima.add(value);
    shifted.add(value - 100.0);
  }
  EXPECT_GT(maxima.exceeded_in(1e-5), 1.2 * maxima.largest());
  EXPECT_NEAR(shifted.exceeded_in(1e-5), maxima.exceeded_in(1e-5) - 100.0, 1e-9);
  EXPECT_EQ(maxima.exceeded_in(0.5), maxima.largest());
}

TEST(BlockMaxima, WithoutABlockThereIsNoThreshold) {
  EXPECT_EQ(BlockMaxima(10).exceeded_in(0.1), 0.0);
  EXPECT_EQ(BlockMaxima(10).threshold(0.1), 0.0);
}

}  // namespace
}  // namespace torsio
