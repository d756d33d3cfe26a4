#include "model/common/schedule.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

CoefficientSchedule one_column(std::vector<double> knots, std::vector<double> column) {
  CoefficientSchedule schedule{.scheduled = true, .feature = 0, .knots = std::move(knots)};
  schedule.values = Matrix(column.size(), 1);
  schedule.values.values = std::move(column);
  return schedule;
}

double at(const ScheduledCoefficients& coefficients, double s) {
  double value = 0.0;
  coefficients.evaluate({&s, 1}, {&value, 1});
  return value;
}

TEST(Schedule, HasTheSlopesOfAHandCalculation) {
  // Widths 1 2 1 2, secants 1 1.5 0 -1: inside (5 + 4) / (5/1 + 4/1.5), at the ends three points.
  const std::vector<double> slopes =
      monotone_slopes(std::vector{0.0, 1.0, 3.0, 4.0, 6.0}, std::vector{1.0, 2.0, 5.0, 5.0, 3.0});
  const std::vector expected{5.0 / 6.0, 27.0 / 23.0, 0.0, 0.0, -5.0 / 3.0};
  ASSERT_EQ(slopes.size(), expected.size());
  for (std::size_t k = 0; k < slopes.size(); ++k) EXPECT_NEAR(slopes[k], expected[k], 1e-15);
}

TEST(Schedule, LimitsItsEndSlopes) {
  const std::vector knots{0.0, 1.0, 3.0};
  EXPECT_EQ(monotone_slopes(knots, std::vector{0.0, 1.0, -17.0}).front(), 3.0) << "13/3 cut to 3";
  EXPECT_EQ(monotone_slopes(knots, std::vector{0.0, 1.0, 19.0}).front(), 0.0) << "-5/3 cut to 0";
}

TEST(Schedule, IsTheHermiteCubicBetweenItsKnots) {
  const ScheduledCoefficients coefficients(
      one_column({0.0, 1.0, 3.0, 4.0, 6.0}, {1.0, 2.0, 5.0, 5.0, 3.0}), 1, "test");
  EXPECT_NEAR(at(coefficients, 0.5), 1.5 + 0.125 * (5.0 / 6.0 - 27.0 / 23.0), 1e-15);
  EXPECT_NEAR(at(coefficients, 2.0), 3.5 + 0.125 * 2.0 * (27.0 / 23.0), 1e-14);
  EXPECT_NEAR(at(coefficients, 5.5), 5.0 * 0.15625 + 3.0 * 0.84375 + 2.0 * 0.140625 * 5.0 / 3.0,
              1e-14);
}

TEST(Schedule, IsExactAtItsKnotsAndHeldOutside) {
  const ScheduledCoefficients coefficients(one_column({-1.0, 0.5, 2.0}, {3.0, 7.0, 4.0}), 1,
                                           "test");
  EXPECT_EQ(at(coefficients, -1.0), 3.0);
  EXPECT_EQ(at(coefficients, 0.5), 7.0);
  EXPECT_EQ(at(coefficients, 2.0), 4.0);
  EXPECT_EQ(at(coefficients, -50.0), 3.0);
  EXPECT_EQ(at(coefficients, 50.0), 4.0);
  EXPECT_EQ(at(coefficients, std::numeric_limits<double>::quiet_NaN()), 3.0);
}

TEST(Schedule, OneKnotIsAConstant) {
  const ScheduledCoefficients coefficients(one_column({2.0}, {5.0}), 1, "test");
  for (const double s : {-1.0, 2.0, 9.0}) EXPECT_EQ(at(coefficients, s), 5.0);
}

TEST(Schedule, TwoKnotsAreAStraightLine) {
  const ScheduledCoefficients coefficients(one_column({1.0, 3.0}, {10.0, 20.0}), 1, "test");
  EXPECT_NEAR(at(coefficients, 1.5), 12.5, 1e-13);
}

TEST(Schedule, NeverLeavesTheKnotsBesideAndKeepsTheirOrder) {
  EXPECT_TRUE(rc::check([] {
    const auto steps = *rc::gen::container<std::vector<int>>(*rc::gen::inRange<std::size_t>(1, 8),
                                                             rc::gen::inRange(1, 1000));
    std::vector<double> knots{-3.0};
    for (const int step : steps) knots.push_back(knots.back() + 0.01 * step);
    const auto heights =
        *rc::gen::container<std::vector<int>>(knots.size(), rc::gen::inRange(-1000, 1000));
    const std::vector<double> values(heights.begin(), heights.end());
    const ScheduledCoefficients coefficients(one_column(knots, values), 1, "test");
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      const double sign = values[k + 1] >= values[k] ? 1.0 : -1.0;
      double before = values[k];
      for (int i = 1; i <= 50; ++i) {
        const double s = knots[k] + (knots[k + 1] - knots[k]) * i / 50.0;
        const double here = at(coefficients, s);
        RC_ASSERT(sign * (here - before) >= -1e-9);
        before = here;
      }
    }
  }));
}

TEST(Schedule, WithoutSchedulingReadsNoFeature) {
  CoefficientSchedule schedule;
  schedule.values = Matrix(1, 2);
  schedule.values.values = {4.0, -2.0};
  const ScheduledCoefficients coefficients(schedule, 1, "test");
  std::vector<double> out(2);
  coefficients.evaluate({}, out);
  EXPECT_EQ(out, (std::vector<double>{4.0, -2.0}));
}

TEST(Schedule, CountsOnlyColumnsThatAreTerms) {
  CoefficientSchedule schedule{.scheduled = true, .feature = 1, .knots = {0.0, 1.0}};
  schedule.values = Matrix(2, 3);
  schedule.values.values = {1.0, 0.0, 0.0,  //
                            2.0, 0.0, 3.0};
  EXPECT_EQ(ScheduledCoefficients(schedule, 2, "test").fitted_count(), 4U);
}

TEST(Schedule, RefusesWhatItCannotEvaluate) {
  const auto refused = [](const CoefficientSchedule& schedule) {
    EXPECT_THROW(ScheduledCoefficients(schedule, 1, "test"), Error);
  };
  refused(one_column({1.0, 1.0}, {0.0, 0.0}));
  refused(one_column({2.0, 1.0}, {0.0, 0.0}));
  refused(one_column({0.0, 1.0}, {0.0, kNotMeasured}));
  refused(one_column({0.0, kNotMeasured}, {0.0, 1.0}));
  refused(one_column({0.0, 1.0, 2.0}, {0.0, 1.0}));
  refused(one_column({}, {}));
  CoefficientSchedule other_input = one_column({0.0, 1.0}, {0.0, 1.0});
  other_input.feature = 1;
  refused(other_input);
  CoefficientSchedule unscheduled_knots = one_column({0.0}, {1.0});
  unscheduled_knots.scheduled = false;
  refused(unscheduled_knots);
}

}  // namespace
}  // namespace torsio
