#include "model/hysteresis/slip_bank.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<double> kThresholds{0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8, 1.3, 2.1};

std::vector<double> random_path(std::size_t count, double step) {
  Random random(7);
  std::vector<double> path(count);
  double x = 0.0;
  for (double& each : path) each = x = std::clamp(x + step * random.normal(), -2.0, 2.0);
  return path;
}

TEST(SlipBank, FollowsItsDefinition) {
  SlipBank bank(std::vector{10.0, 20.0}, std::vector{1.0, 0.5}, "test");
  EXPECT_DOUBLE_EQ(bank.step(0.01), 0.1 + 0.2);
  EXPECT_DOUBLE_EQ(bank.step(0.05), 0.6 + 0.5);
  EXPECT_DOUBLE_EQ(bank.step(-0.01), 0.5 + 0.3);
  EXPECT_DOUBLE_EQ(bank.step(-10.0), -1.5);
  EXPECT_THAT(bank.forces(), ElementsAre(-1.0, -0.5));
  bank.reset();
  EXPECT_THAT(bank.forces(), Each(0.0));
}

TEST(SlipBank, StopAndPlayOfOneThresholdAddUpToTheInput) {
  SlipBank stops(kThresholds, "test");
  std::vector<double> play(kThresholds.size(), 0.0);
  double before = 0.0;
  for (const double x : random_path(5000, 0.1)) {
    stops.move(x - before);
    before = x;
    for (std::size_t i = 0; i < play.size(); ++i) {
      play[i] = std::max(x - kThresholds[i], std::min(x + kThresholds[i], play[i]));
      ASSERT_NEAR(stops.forces()[i] + play[i], x, 1e-14);
    }
  }
}

TEST(SlipBank, SpringsAreWeightedStops) {
  Random random(3);
  std::vector<double> stiffness(kThresholds.size());
  std::vector<double> limit(kThresholds.size());
  for (std::size_t i = 0; i < stiffness.size(); ++i) {
    stiffness[i] = 30.0 * random.uniform();
    limit[i] = stiffness[i] * kThresholds[i];
  }
  SlipBank springs(stiffness, limit, "test");
  SlipBank stops(kThresholds, "test");
  double before = 0.0;
  for (const double x : random_path(3000, 0.2)) {
    EXPECT_NEAR(springs.step(x - before), stops.step(x - before, stiffness), 1e-12);
    before = x;
  }
}

TEST(SlipBank, DependsOnThePathAndNotOnItsSteps) {
  SlipBank coarse(kThresholds, "test");
  SlipBank fine(kThresholds, "test");
  double before = 0.0;
  for (const double x : random_path(300, 0.5)) {
    const double whole = coarse.step(x - before);
    double in_parts = 0.0;
    for (int part = 0; part < 16; ++part) in_parts = fine.step((x - before) / 16.0);
    EXPECT_NEAR(whole, in_parts, 1e-12);
    before = x;
  }
}

TEST(SlipBank, ReturnsTheForceOfAStepWithoutTakingIt) {
  SlipBank bank(kThresholds, "test");
  const std::vector<double> weights{1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0};
  bank.move(0.3);
  const std::vector<double> before(bank.forces().begin(), bank.forces().end());
  const double predicted = bank.sum_after(-0.17, weights);
  EXPECT_TRUE(std::ranges::equal(bank.forces(), before));
  EXPECT_EQ(bank.step(-0.17, weights), predicted);
}

TEST(SlipBank, NaNMovesNothingAndAnInfiniteStepSlipsAll) {
  SlipBank bank(std::vector{10.0, 0.0, 1e300}, std::vector{1.0, 0.5, 2.0}, "test");
  bank.step(0.05);
  const double before = bank.sum();
  EXPECT_EQ(bank.step(std::numeric_limits<double>::quiet_NaN()), before);
  EXPECT_EQ(bank.step(std::numeric_limits<double>::infinity()), 3.0);
  EXPECT_EQ(bank.step(-1.7e308), -3.0);
  EXPECT_EQ(bank.step(-std::numeric_limits<double>::infinity()), -3.0);
}

TEST(SlipBank, StartsFromTheGivenState) {
  SlipBank bank(std::vector{10.0, 20.0, 5.0}, std::vector{1.0, 0.5, 2.0}, "test");
  bank.step(0.02);
  bank.set_forces(std::vector{3.0, -0.25, std::numeric_limits<double>::quiet_NaN()});
  EXPECT_THAT(bank.forces(), ElementsAre(1.0, -0.25, DoubleNear(0.1, 1e-15)));
}

TEST(SlipBank, RefusesWhatIsNoSpring) {
  const auto refusal = [](std::vector<double> stiffness, std::vector<double> limit) {
    return test::error_message([&] { SlipBank(stiffness, limit, "maxwell_slip"); });
  };
  EXPECT_THAT(refusal({1.0, -1.0}, {1.0, 1.0}), HasSubstr("maxwell_slip: stiffness of element 2"));
  EXPECT_THAT(refusal({1.0}, {std::nan("")}), HasSubstr("maxwell_slip: limit of element 1"));
  EXPECT_THAT(refusal({1.0}, {1.0, 2.0}), HasSubstr("a stiffness for each limit"));
  EXPECT_EQ(SlipBank(std::vector<double>{}, "empty").step(1.0), 0.0);
}

TEST(SlipBank, NeverGivesMoreWorkThanItTook) {
  EXPECT_TRUE(rc::check([](const std::vector<std::int16_t>& increments, std::uint8_t size) {
    std::vector<double> stiffness;
    std::vector<double> limit;
    for (int i = 0; i < size % 13; ++i) {
      stiffness.push_back(1.0 + i);
      limit.push_back(0.1 * (1.0 + i * i));
    }
    SlipBank bank(stiffness, limit, "test");
    double work = 0.0;
    double before = 0.0;
    for (const std::int16_t each : increments) {
      const double dx = each / 32768.0;
      // The mean of the forces before and after is the least that met the motion: slipping comes
      // last.
      const double after = bank.step(dx);
      work += 0.5 * (before + after) * dx;
      before = after;
      RC_ASSERT(work >= -1e-12);
    }
  }));
}

}  // namespace
}  // namespace torsio
