#include "core/hyperbolic_tangent.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace torsio::detail {
namespace {

TEST(HyperbolicTangent, IsWithinTwoUnitsInTheLastPlace) {
  for (double x = 1e-8; x < 30.0; x *= 1.00037) {
    const double expected = static_cast<double>(std::tanh(static_cast<long double>(x)));
    const double unit = std::nextafter(expected, 2.0) - expected;
    ASSERT_LE(std::abs(hyperbolic_tangent(x) - expected), 2.0 * unit) << x;
    ASSERT_EQ(hyperbolic_tangent(-x), -hyperbolic_tangent(x)) << x;
    ASSERT_LE(hyperbolic_tangent(x), 1.0) << x;
  }
}

TEST(HyperbolicTangent, KeepsZerosAndNanAndEndsAtOne) {
  EXPECT_EQ(hyperbolic_tangent(0.0), 0.0);
  EXPECT_TRUE(std::signbit(hyperbolic_tangent(-0.0)));
  EXPECT_EQ(hyperbolic_tangent(std::numeric_limits<double>::infinity()), 1.0);
  EXPECT_EQ(hyperbolic_tangent(-1e300), -1.0);
  EXPECT_TRUE(std::isnan(hyperbolic_tangent(std::numeric_limits<double>::quiet_NaN())));
}

}  // namespace
}  // namespace torsio::detail
