#include "numerics/event_bounds.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace torsio {
namespace {

TEST(EventBounds, OfACountAreThoseOfThePoissonTables) {
  EXPECT_NEAR(poisson_upper_95(0), -std::log(0.05), 1e-9);
  EXPECT_NEAR(poisson_upper_95(1), 4.7439, 1e-4);
  EXPECT_NEAR(poisson_upper_95(2), 6.2958, 1e-4);
  EXPECT_NEAR(poisson_upper_95(10), 16.9622, 1e-4);
  EXPECT_NEAR(poisson_upper_95(100), 118.08, 0.01);
}

TEST(EventBounds, OfAShareAreThoseOfClopperAndPearson) {
  EXPECT_NEAR(binomial_upper_95(0, 300), 1.0 - std::pow(0.05, 1.0 / 300.0), 1e-9);
  EXPECT_LT(binomial_upper_95(0, 300), 0.01);
  EXPECT_NEAR(binomial_upper_95(1, 10), 0.394163, 1e-5);
  EXPECT_NEAR(binomial_upper_95(5, 20), 0.455582, 1e-5);
  EXPECT_EQ(binomial_upper_95(10, 10), 1.0);
  EXPECT_EQ(binomial_upper_95(0, 0), 1.0);
}

}  // namespace
}  // namespace torsio
