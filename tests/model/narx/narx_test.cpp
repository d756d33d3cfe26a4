#include "model/narx/narx.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/examples/narx.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TEST(Narx, IsItsDifferenceEquation) {
  auto model = test::example<Narx<Linear>>();
  const Matrix features = test::example_features(60, 2);
  std::vector<double> y{1.0, 1.0};  // as it starts
  for (std::size_t n = 0; n < features.rows; ++n) {
    const auto now = features.row(n);
    const auto before = features.row(n == 0 ? 0 : n - 1);
    const double expected = 0.5 + 200.0 * now[0] + 0.25 * now[1] + 100.0 * before[0] +
                            0.1 * before[1] + 0.6 * y.back() - 0.1 * y[y.size() - 2];
    const Estimate estimate = model.step(now);
    ASSERT_NEAR(estimate.value, expected, 1e-12 * (1.0 + std::abs(expected))) << n;
    ASSERT_TRUE(std::isnan(estimate.std_dev));
    y.push_back(estimate.value);
  }
}

TEST(Narx, TakesAMeasurementForItsLastOutput) {
  auto corrected = test::example<Narx<Linear>>();
  auto free = corrected;
  const std::vector<double> features{0.01, 0.0};
  (void)corrected.step(features);
  (void)free.step(features);
  const double first = free.step(features).value;
  corrected.correct(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(corrected.step(features).value, first);
  corrected.correct(first + 10.0);
  EXPECT_NEAR(corrected.step(features).value, free.step(features).value + 6.0, 1e-12);
  corrected.reset(7.0);
  EXPECT_NEAR(corrected.step(features).value, 0.5 + 300.0 * 0.01 + 0.5 * 7.0, 1e-12);
}

TEST(Narx, StaysAtTheEndOfItsRangeAndReportsIt) {
  auto parameters = test::example<Narx<Linear>>().parameters();
  parameters.lowest = -200.0;
  parameters.highest = 200.0;
  parameters.model.coefficients.values.values.back() = 0.6;  // 0.6 + 0.6 > 1: it diverges
  Narx<Linear> model(parameters);
  const std::vector<double> push{0.1, 0.0};
  Estimate estimate;
  for (int n = 0; n < 100; ++n) estimate = model.step(push);
  EXPECT_EQ(estimate.value, 200.0);
  EXPECT_EQ(estimate.fault, Fault::diverged);
  const std::vector<double> beyond{1e308, 1e308};
  estimate = model.step(beyond);
  estimate = model.step(beyond);
  EXPECT_TRUE(std::isfinite(estimate.value));
  EXPECT_EQ(estimate.fault, Fault::diverged);
  model.reset();
  EXPECT_EQ(model.step(std::vector<double>{0.0, 0.0}).fault, Fault::none);
}

TEST(Narx, RefusesLagsAndRangesThatMakeNoSense) {
  const auto good = test::example<Narx<Linear>>().parameters();
  const auto complaint = [&](const auto& spoil) {
    auto parameters = good;
    spoil(parameters);
    return test::error_message([&] { Narx<Linear>{parameters}; });
  };
  EXPECT_THAT(complaint([](auto& p) { p.output_lags = 3; }),
              HasSubstr("narx_linear: expected an inner model of as many inputs as lags make"));
  EXPECT_THAT(complaint([](auto& p) { p.output_lags = 0; }), HasSubstr("1 to 1000 output lags"));
  EXPECT_THAT(complaint([](auto& p) { p.inputs = 0; }),
              HasSubstr("an input that the inner model has"));
  EXPECT_THAT(complaint([](auto& p) { p.inputs = std::size_t{1} << 63U; }),
              HasSubstr("an input that the inner model has"));
  EXPECT_THAT(complaint([](auto& p) { p.lowest = 6000.0; }), HasSubstr("lowest < highest"));
  EXPECT_THAT(complaint([](auto& p) { p.start = 6000.0; }), HasSubstr("start between them"));
  EXPECT_THAT(complaint([](auto& p) { p.sample_period_s = 0.0; }),
              HasSubstr("a positive sample_period_s"));
}

}  // namespace
}  // namespace torsio
