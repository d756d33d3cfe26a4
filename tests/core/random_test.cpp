#include "torsio/core/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace torsio {
namespace {

constexpr std::uint64_t kSeed = 7;
constexpr int kDraws = 200'000;

// Made with the reference's own recurrences written once more in Python integers (SplitMix64 fill,
// xoshiro256++ step), seed 42.
TEST(Random, GivesTheReferenceSequence) {
  Random random(42);
  EXPECT_EQ(random.bits(), 0xd0764d4f4476689fU);
  EXPECT_EQ(random.bits(), 0x519e4174576f3791U);
  EXPECT_EQ(random.bits(), 0xfbe07cfb0c24ed8cU);
}

TEST(Random, RepeatsForASeedAndDiffersBetweenSeeds) {
  Random first(kSeed);
  Random second(kSeed);
  Random other(kSeed + 1);
  for (int i = 0; i < 100; ++i) {
    const double value = first.normal();
    EXPECT_EQ(value, second.normal());
    EXPECT_NE(value, other.normal());
  }
}

TEST(Random, UniformFillsItsIntervalEvenly) {
  Random random(kSeed);
  std::array<int, 10> counts{};
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    ++counts[static_cast<std::size_t>(value * 10.0)];
  }
  for (const int count : counts) EXPECT_NEAR(count, kDraws / 10, 5.0 * std::sqrt(0.09 * kDraws));
}

TEST(Random, NormalHasTheMomentsOfTheStandardNormal) {
  Random random(kSeed);
  std::array<double, 5> moments{};
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.normal();
    double power = 1.0;
    for (double& moment : moments) moment += (power *= value) / kDraws;
  }
  const double error = 5.0 / std::sqrt(kDraws);
  EXPECT_NEAR(moments[0], 0.0, error);
  EXPECT_NEAR(moments[1], 1.0, error * std::sqrt(2.0));
  EXPECT_NEAR(moments[2], 0.0, error * std::sqrt(15.0));
  EXPECT_NEAR(moments[3], 3.0, error * std::sqrt(96.0));
}

TEST(Random, BelowReachesEveryNumberAndNoOther) {
  Random random(kSeed);
  std::array<int, 7> counts{};
  for (int i = 0; i < 7'000; ++i) ++counts.at(random.below(counts.size()));
  for (const int count : counts) EXPECT_NEAR(count, 1'000, 150);
  EXPECT_EQ(random.below(1), 0U);
}

}  // namespace
}  // namespace torsio
