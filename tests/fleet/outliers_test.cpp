#include "fleet/outliers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "torsio/core/random.hpp"

namespace torsio {
namespace {

std::size_t count_of(const OutlierTest& test) {
  return static_cast<std::size_t>(std::ranges::count_if(test.scores, &OutlierScore::is_outlier));
}

std::vector<double> uniform(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> values(count);
  for (double& value : values) value = random.uniform(-0.03, 0.03);
  return values;
}

std::vector<double> normal(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> values(count);
  for (double& value : values) value = random.normal();
  return values;
}

TEST(OutliersTest, SoundMembersOfAnyTailAreRarelyListed) {
  // At most 0.1 are expected on each side of each population: 8 in all.
  std::size_t of_uniform = 0;
  std::size_t of_normal = 0;
  constexpr std::size_t kPopulations = 40;
  for (std::uint64_t seed = 1; seed <= kPopulations; ++seed) {
    of_uniform += count_of(find_outliers(uniform(1000, seed)));
    of_normal += count_of(find_outliers(normal(1000, seed)));
  }
  EXPECT_LE(of_uniform, 4U);
  EXPECT_LE(of_normal, 8U);
}

TEST(OutliersTest, NoiseOfTheEstimatesRoundsTheEndOfATolerance) {
  // The noise is beyond the values that the tail is fitted to.
  std::size_t listed = 0;
  constexpr std::size_t kPopulations = 20;
  for (const double noise : {0.04, 0.08})
    for (std::uint64_t seed = 1; seed <= kPopulations; ++seed) {
      std::vector<double> values = uniform(1000, seed);
      Random random(100 + seed);
      for (double& value : values) value += noise * 0.03 * random.normal();
      listed += count_of(find_outliers(values));
    }
  EXPECT_LE(listed, 8U) << "0.1 on each side of each population";
}

TEST(OutliersTest, PartsBeyondTheirToleranceAreFound) {
  std::vector<double> values = uniform(1000, 7);
  const std::vector<std::size_t> planted{3, 200, 611, 777, 900};
  for (std::size_t k = 0; k < planted.size(); ++k) values[planted[k]] += k % 2 == 0 ? 0.08 : -0.08;
  const OutlierTest test = find_outliers(values);
  EXPECT_TRUE(test.has_fitted_tails);
  for (const std::size_t member : planted) {
    EXPECT_TRUE(test.scores[member].is_outlier) << values[member];
    EXPECT_LT(test.scores[member].expected, 0.1);
  }
  EXPECT_EQ(count_of(test), planted.size());
  // The limit is near the end of the tolerance.
  EXPECT_GT(test.highest, 0.030);
  EXPECT_LT(test.highest, 0.045);
}

TEST(OutliersTest, OutliersDoNotMoveTheLimits) {
  std::vector<double> values = normal(1000, 3);
  const double before = find_outliers(values).highest;
  for (std::size_t k = 0; k < 12; ++k) values[10 * k] = 30.0;
  const OutlierTest test = find_outliers(values);
  EXPECT_EQ(count_of(test), 12U);
  EXPECT_LT(test.highest, 1.5 * before);
}

TEST(OutliersTest, FewMembersAreComparedByStudentsDistribution) {
  std::vector<double> values = normal(30, 5);
  EXPECT_EQ(count_of(find_outliers(values)), 0U);
  values[4] = 12.0;
  const OutlierTest test = find_outliers(values);
  EXPECT_FALSE(test.has_fitted_tails);
  EXPECT_TRUE(test.scores[4].is_outlier);
  EXPECT_EQ(count_of(test), 1U);
}

TEST(OutliersTest, TooFewMembersGiveNoVerdict) {
  std::vector<double> values{0.0, 0.1, -0.1, 0.2, 50.0};
  const OutlierTest test = find_outliers(values);
  EXPECT_EQ(count_of(test), 0U);
  EXPECT_TRUE(std::isnan(test.highest));
  EXPECT_TRUE(std::isnan(test.scores[4].probability));
}

TEST(OutliersTest, ValuesThatAreMissingHaveNoScore) {
  std::vector<double> values = uniform(200, 9);
  values[17] = kNotMeasured;
  values[40] = 1.0;
  const OutlierTest test = find_outliers(values);
  EXPECT_TRUE(std::isnan(test.scores[17].distance));
  EXPECT_FALSE(test.scores[17].is_outlier);
  EXPECT_TRUE(test.scores[40].is_outlier);
}

TEST(OutliersTest, EqualMembersGiveNoVerdict) {
  const std::vector<double> same(200, 0.5);
  EXPECT_EQ(count_of(find_outliers(same)), 0U);
  EXPECT_EQ(count_of(find_outliers(std::vector<double>(20, 0.5))), 0U);
  EXPECT_EQ(count_of(find_outliers({})), 0U);
}

TEST(OutliersTest, OnlyLargeSizesAreOutliersOnOneSide) {
  std::vector<double> values = normal(400, 11);
  values[1] = -40.0;
  values[2] = 40.0;
  const OutlierTest test = find_outliers(values, {.sides = OutlierSides::upper});
  EXPECT_FALSE(test.scores[1].is_outlier);
  EXPECT_TRUE(test.scores[2].is_outlier);
  EXPECT_TRUE(std::isnan(test.lowest));
}

TEST(OutliersTest, NothingWithinTheToleranceIsAnOutlier) {
  std::vector<double> values = normal(200, 13);
  for (double& value : values) value *= 1e-6;
  values[5] = 1e-3;
  EXPECT_TRUE(find_outliers(values).scores[5].is_outlier);
  EXPECT_FALSE(find_outliers(values, {.tolerance = 0.01}).scores[5].is_outlier);
}

}  // namespace
}  // namespace torsio
