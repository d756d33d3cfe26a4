#include "torsio/numerics/metrics.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

Metrics metrics_of(const std::vector<double>& values, const std::vector<double>& targets,
                   const std::vector<std::uint8_t>& use = {}) {
  MetricsAccumulator accumulator;
  accumulator.add(values, targets, use);
  return accumulator.metrics();
}

TEST(Metrics, EqualAHandCalculation) {
  // Errors 1 -1 3 -3 over targets 0 2 4 6: mean target 3, its squared deviations sum to 20.
  const Metrics metrics = metrics_of({1.0, 1.0, 7.0, 3.0}, {0.0, 2.0, 4.0, 6.0});
  EXPECT_EQ(metrics.samples, 4U);
  EXPECT_DOUBLE_EQ(metrics.rmse, std::sqrt(5.0));
  EXPECT_DOUBLE_EQ(metrics.mad, 2.0);
  EXPECT_DOUBLE_EQ(metrics.std_abs, 1.0);
  EXPECT_DOUBLE_EQ(metrics.max_abs, 3.0);
  EXPECT_DOUBLE_EQ(metrics.fit_percent, 0.0);
}

TEST(Metrics, FitPercentIsHundredWhenPerfectAndNegativeWhenWorseThanTheMean) {
  EXPECT_DOUBLE_EQ(metrics_of({1.0, 2.0}, {1.0, 2.0}).fit_percent, 100.0);
  EXPECT_DOUBLE_EQ(metrics_of({2.0, 1.0}, {1.0, 2.0}).fit_percent, -100.0);
}

TEST(Metrics, PassOverWhatWasNotMeasuredAndWhatIsNotToBeScored) {
  const Metrics metrics =
      metrics_of({1.0, 9.0, 9.0, 2.0}, {0.0, kNotMeasured, 1.0, 0.0}, {1, 1, 0, 1});
  EXPECT_EQ(metrics.samples, 2U);
  EXPECT_DOUBLE_EQ(metrics.mad, 1.5);
}

TEST(Metrics, OfNothingAreNaN) {
  const Metrics metrics = metrics_of({1.0}, {kNotMeasured});
  EXPECT_EQ(metrics.samples, 0U);
  for (const double each :
       {metrics.rmse, metrics.mad, metrics.std_abs, metrics.max_abs, metrics.fit_percent})
    EXPECT_TRUE(std::isnan(each));
}

TEST(Metrics, AConstantTargetHasNoFitPercent) {
  EXPECT_TRUE(std::isnan(metrics_of({1.0, 2.0}, {3.0, 3.0}).fit_percent));
}

TEST(Metrics, AModelWhoseOutputIsNaNHasTheMetricNaN) {
  const Metrics metrics = metrics_of({kNotMeasured, 1.0}, {0.0, 0.0});
  EXPECT_TRUE(std::isnan(metrics.rmse));
  EXPECT_TRUE(std::isnan(metrics.max_abs));
}

TEST(Metrics, KeepTheirDigitsOnALargeOffset) {
  const Metrics metrics =
      metrics_of({1e9 + 1.0, 1e9 - 1.0, 1e9 + 1.0, 1e9 - 1.0}, {1e9, 1e9, 1e9 + 2.0, 1e9 - 2.0});
  EXPECT_NEAR(metrics.fit_percent, 100.0 * (1.0 - std::sqrt(4.0 / 8.0)), 1e-9);
}

TEST(Metrics, LieBetweenEachOther) {
  EXPECT_TRUE(rc::check([](const std::vector<int>& errors) {
    RC_PRE(!errors.empty());
    MetricsAccumulator accumulator;
    for (const int error : errors) accumulator.add(0.01 * error, 0.0);
    const Metrics metrics = accumulator.metrics();
    RC_ASSERT(metrics.mad <= metrics.rmse * (1.0 + 1e-12));
    RC_ASSERT(metrics.rmse <= metrics.max_abs * (1.0 + 1e-12));
    const double square = metrics.mad * metrics.mad + metrics.std_abs * metrics.std_abs;
    RC_ASSERT(std::abs(std::sqrt(square) - metrics.rmse) <= 1e-9 * (1.0 + metrics.rmse));
  }));
}

TEST(Metrics, RefuseUnequalLengths) {
  MetricsAccumulator accumulator;
  EXPECT_THROW(accumulator.add(std::vector{1.0}, std::vector{1.0, 2.0}), Error);
}

}  // namespace
}  // namespace torsio
