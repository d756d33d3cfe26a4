#include "torsio/signal/differentiator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(Differentiator, ReturnsZeroAndUnsettledBeforeTwoSamples) {
  Differentiator rate(100.0);
  EXPECT_FALSE(rate.is_settled());
  EXPECT_EQ(rate.step(5.0), 0.0);
  EXPECT_FALSE(rate.is_settled());
  EXPECT_DOUBLE_EQ(rate.step(5.25), 25.0);
  EXPECT_TRUE(rate.is_settled());
  rate.reset();
  EXPECT_FALSE(rate.is_settled());
  EXPECT_EQ(rate.step(-7.0), 0.0);
}

TEST(Differentiator, EstimatesTheSlopeOfARampAtEveryRate) {
  for (const double sample_rate_Hz : {50.0, 1000.0, 10'000.0}) {
    Differentiator rate(sample_rate_Hz, 10.0);
    double output = 0.0;
    for (std::size_t n = 0; n < rate.settling_samples(); ++n) {
      EXPECT_FALSE(rate.is_settled());
      output = rate.step(3.0 * static_cast<double>(n) / sample_rate_Hz);
    }
    EXPECT_TRUE(rate.is_settled());
    EXPECT_NEAR(output, 3.0, 0.03);
  }
}

TEST(Differentiator, SkipsASampleThatIsNotFinite) {
  Differentiator rate(10.0);
  (void)rate.step(1.0);
  EXPECT_FALSE(std::isfinite(rate.step(std::numeric_limits<double>::infinity())));
  EXPECT_FALSE(std::isfinite(rate.step(1.0)));
  EXPECT_DOUBLE_EQ(rate.step(1.5), 5.0);
}

TEST(Differentiator, SkipsWhatWasLost) {
  Differentiator rate(10.0);
  rate.step(0.0);
  EXPECT_DOUBLE_EQ(rate.step(0.5), 5.0);
  rate.skip();
  EXPECT_DOUBLE_EQ(rate.step(7.0), 5.0);
  EXPECT_NEAR(rate.step(7.2), 2.0, 1e-12);
  rate.skip();
  rate.reset();
  rate.skip();
  EXPECT_EQ(rate.step(3.0), 0.0);
  EXPECT_NEAR(rate.step(3.1), 1.0, 1e-12);
}

TEST(Differentiator, RefusesARateThatIsNone) {
  EXPECT_THROW(Differentiator(0.0), UsageError);
  EXPECT_THROW(Differentiator(std::numeric_limits<double>::quiet_NaN()), UsageError);
  EXPECT_THROW(Differentiator(100.0, 50.0), UsageError);
}

}  // namespace
}  // namespace torsio
