#include "model/hammerstein_wiener/hammerstein_wiener.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using Parameters = HammersteinWiener::Parameters;

constexpr double kDegree = std::numbers::pi / 180.0;

double step(HammersteinWiener& model, double u) { return model.step({&u, 1}).value; }

double after(HammersteinWiener model, double u, std::size_t steps) {
  double y = 0.0;
  for (std::size_t n = 0; n < steps; ++n) y = step(model, u);
  return y;
}

/// dy/du in Nm/deg about u = 0, at once and after a long time.
double slope_after(const HammersteinWiener& model, std::size_t steps) {
  constexpr double kAside = 1e-3;
  return (after(model, kAside * kDegree, steps) - after(model, -kAside * kDegree, steps)) /
         (2.0 * kAside);
}

// Specification 2: chain gain 2.127; DC .63 (discrete), .62 (8), .434 (10), at once 2.13, 3.66,
// 1.61 Nm/deg. The curves bend: about the rest state C's slope is not that about 0, hence the
// ratio.
TEST(Paper003, HasTheGainsOfTheSpecification) {
  struct Gains {
    Paper003 form;
    double rest;
    double at_once;
  };
  for (const auto& [form, rest, at_once] :
       {Gains{Paper003::discrete, 0.63, 2.13}, Gains{Paper003::tustin, 0.62, 3.66},
        Gains{Paper003::refined, 0.434, 1.61}}) {
    const Parameters p = hammerstein_wiener_of(form);
    const double chain = p.input.values[1] * p.output.values[1];
    EXPECT_NEAR(chain, 2.127, 1e-3);
    EXPECT_NEAR(chain * dc_gain(p.sections), rest, 0.006);
    const ContinuousTransfer continuous = continuous_of(form);
    const double first = form == Paper003::discrete ? p.sections(0, 0) : continuous.numerator[0];
    EXPECT_NEAR(chain * first, at_once, 0.006);
    const double bend = p.output.slope(dc_gain(p.sections) * p.input(0.0)) / p.output.values[1];
    EXPECT_NEAR(slope_after(HammersteinWiener(p), 20'000), chain * bend * dc_gain(p.sections),
                1e-3);
  }
}

TEST(Paper003, IsInDegreesAndNewtonMetres) {
  const HammersteinWiener model(hammerstein_wiener_of(Paper003::refined));
  EXPECT_NEAR(after(model, 0.0, 1), -0.056, 1e-3);  // specification 2: y(0) = -.056 Nm
  EXPECT_NEAR(after(model, 8.0 * kDegree, 20'000), 3.1, 0.1);
  EXPECT_NEAR(after(model, -8.0 * kDegree, 20'000), -3.7, 0.1);
}

TEST(Paper003, IsHeldWhereItsOutputCurveIsMonotone) {
  const Parameters p = hammerstein_wiener_of(Paper003::discrete);
  EXPECT_NEAR(p.lowest, -8358.0, 1.0);
  EXPECT_NEAR(p.highest, 5289.0, 1.0);
  HammersteinWiener model(p);
  EXPECT_NEAR(step(model, 3.0), 6.02, 0.01);  // 172 deg: far beyond
  model.reset();
  EXPECT_NEAR(step(model, -3.0), -11.9, 0.05);
}

Parameters example_parameters() {
  return {.inputs = 1,
          .sample_period_s = 0.01,
          .rest_input = 0.1,
          .input = {.values = {0.3, 2.0, 0.5, -0.1}},
          .sections = sections_of({{1.0, -0.7, 0.2, 0.1}, {1.0, -1.5, 0.8, -0.2}}),
          .output = {.values = {0.2, 3.0, 0.4, 0.1}},
          .lowest = -1.0,
          .highest = 5.0};
}

std::vector<double> outputs(const Parameters& parameters) {
  HammersteinWiener model(parameters);
  Random random(4);
  std::vector<double> all;
  for (int n = 0; n < 500; ++n) all.push_back(step(model, 0.4 * random.normal()));
  return all;
}

TEST(HammersteinWiener, IsItsDifferenceEquation) {
  const Parameters p = example_parameters();
  HammersteinWiener model(p);
  Random random(4);
  const double rest_w = p.input(p.rest_input);
  const double rest_x = rest_w * dc_gain(p.sections);
  std::vector<double> w(3, rest_w);
  std::vector<double> x(3, rest_x);
  for (int n = 0; n < 200; ++n) {
    const double u = 0.4 * random.normal();
    w.push_back(p.input(u));
    const std::size_t k = w.size() - 1;
    x.push_back(w[k] - 0.7 * w[k - 1] + 0.2 * w[k - 2] + 0.1 * w[k - 3] + 1.5 * x[k - 1] -
                0.8 * x[k - 2] + 0.2 * x[k - 3]);
    EXPECT_NEAR(step(model, u), p.output(std::clamp(x[k], p.lowest, p.highest)), 1e-9) << n;
  }
}

TEST(HammersteinWiener, IsTheSameInEveryGauge) {
  const Parameters p = example_parameters();
  const std::vector<double> expected = outputs(p);
  // w -> 3 w + 0.7 and x -> 5 x, which the output curve takes back; 0.7 arrives as DC gain times it.
  Parameters q = p;
  for (double& value : q.input.values) value *= 3.0;
  q.input.values[0] += 0.7;
  for (std::size_t k = 0; k < 3; ++k) q.sections(0, k) *= 5.0 / 3.0;
  const double shift = 0.7 * dc_gain(q.sections);
  q.output.centre = shift;
  q.output.half_range = 5.0;
  q.lowest = 5.0 * p.lowest + shift;
  q.highest = 5.0 * p.highest + shift;
  const std::vector<double> found = outputs(q);
  for (std::size_t n = 0; n < expected.size(); ++n) EXPECT_NEAR(found[n], expected[n], 1e-9) << n;
}

TEST(HammersteinWiener, StaysWhereItRestsAndGoesOnFromAnyState) {
  const Parameters p = example_parameters();
  HammersteinWiener model(p);
  const double rest = p.output(dc_gain(p.sections) * p.input(p.rest_input));
  for (int n = 0; n < 50; ++n) EXPECT_NEAR(step(model, p.rest_input), rest, 1e-12);
  static_assert(HasState<HammersteinWiener>);
  for (int n = 0; n < 20; ++n) step(model, 0.3);
  const std::vector<double> state(model.state().begin(), model.state().end());
  const double expected = step(model, -0.2);
  model.reset();
  model.set_state(state);
  EXPECT_EQ(step(model, -0.2), expected);
  model.set_state(std::vector<double>(state.size(), std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(std::isfinite(step(model, 0.1)));
}

TEST(HammersteinWiener, SurvivesAnInputThatOverflows) {
  HammersteinWiener model(example_parameters());
  HammersteinWiener other = model;
  const double before = step(model, 0.2);
  step(other, 0.2);
  const double u = 1e200;
  const Estimate estimate = model.step({&u, 1});
  EXPECT_EQ(estimate.fault, Fault::model_not_finite);
  EXPECT_EQ(estimate.value, before);
  EXPECT_EQ(step(model, 0.3), step(other, 0.3));
}

TEST(HammersteinWiener, StaysAtTheEndOfItsRangeAndReportsIt) {
  const Parameters p = example_parameters();
  const double gain = dc_gain(p.sections);
  HammersteinWiener model(p);
  Estimate estimate;
  for (const double u : {0.0, 3.0, -3.0}) {  // within, above, below what x may be
    for (int n = 0; n < 200; ++n) estimate = model.step({&u, 1});
    const double x = gain * p.input(u);
    EXPECT_EQ(estimate.fault,
              x >= p.lowest && x <= p.highest ? Fault::none : Fault::outside_training_range);
    EXPECT_NEAR(estimate.value, p.output(std::clamp(x, p.lowest, p.highest)), 1e-9) << u;
  }
  model.reset();
  const double u = 0.1;
  EXPECT_EQ(model.step({&u, 1}).fault, Fault::none);
}

TEST(HammersteinWiener, RefusesWhatItCannotRun) {
  const auto message = [](auto change) {
    Parameters p = example_parameters();
    change(p);
    return test::error_message([&] { HammersteinWiener{p}; });
  };
  EXPECT_EQ(message([](Parameters&) {}), "");
  EXPECT_THAT(message([](Parameters& p) { p.sections(0, 4) = 1.5; }),
              HasSubstr("poles inside the unit circle"));
  EXPECT_THAT(message([](Parameters& p) { p.sample_period_s = 0.0; }),
              HasSubstr("sample_period_s"));
  EXPECT_THAT(message([](Parameters& p) { p.highest = p.lowest; }), HasSubstr("below highest"));
  EXPECT_THAT(message([](Parameters& p) {
                p.output.values = {0.0, 1.0, 1.0};
              }),
              HasSubstr("monotone from lowest to highest"));
  EXPECT_THAT(message([](Parameters& p) { p.input.values[1] = HUGE_VAL; }),
              HasSubstr("finite numbers"));
  EXPECT_THAT(message([](Parameters& p) { p.sections = Sections(); }), HasSubstr("1 to 50 rows"));
}

TEST(StaticCurve, GoesThroughItsKnotsAndOnBeyondThem) {
  const StaticCurve curve{.knots = {-1.0, 0.0, 2.0}, .values = {3.0, 0.0, 1.0}};
  EXPECT_EQ(curve(-1.0), 3.0);
  EXPECT_EQ(curve(0.0), 0.0);
  EXPECT_EQ(curve(1.0), 0.5);
  EXPECT_EQ(curve(-2.0), 6.0);
  EXPECT_EQ(curve(4.0), 2.0);
  EXPECT_EQ(curve.slope(-5.0), -3.0);
  EXPECT_EQ(curve.slope(3.0), 0.5);
}

TEST(StaticCurve, IsTheSumOfItsValuesTimesTheirBasis) {
  const StaticCurve segments{.knots = {-1.0, 0.0, 2.0}, .values = {3.0, 0.5, 1.0}};
  const StaticCurve powers{.values = {0.5, 1.0, -2.0, 0.3}, .centre = 0.4, .half_range = 1.7};
  for (const StaticCurve& curve : {segments, powers}) {
    for (const double x : {-3.0, -1.0, -0.2, 0.0, 1.9, 2.0, 5.0}) {
      double sum = 0.0;
      for (std::size_t i = 0; i < curve.values.size(); ++i)
        sum += curve.values[i] * curve.basis(i, x);
      EXPECT_NEAR(sum, curve(x), 1e-12) << x;
      const double h = 1e-6;
      EXPECT_NEAR(curve.slope(x + h), (curve(x + 2.0 * h) - curve(x)) / (2.0 * h), 1e-5) << x;
    }
  }
}

TEST(StaticCurve, IsMonotoneBetweenItsExtremes) {
  const StaticCurve cubic{.values = {0.0, -3.0, 0.0, 1.0}};  // turns at -1 and 1
  const Interval inner = monotone_part(cubic, {-1.5, 1.5});
  EXPECT_NEAR(inner.lowest, -1.0, 1e-12);
  EXPECT_NEAR(inner.highest, 1.0, 1e-12);
  const Interval outer = monotone_part(cubic, {0.5, 4.0});
  EXPECT_NEAR(outer.lowest, 1.0, 1e-12);
  EXPECT_EQ(outer.highest, 4.0);
  const StaticCurve flat_then_up{.knots = {0.0, 1.0, 2.0, 3.0}, .values = {1.0, 0.0, 1.0, 0.0}};
  const Interval part = monotone_part(flat_then_up, {0.0, 3.0});
  EXPECT_EQ(part.lowest, 1.0);
  EXPECT_EQ(part.highest, 2.0);
}

}  // namespace
}  // namespace torsio
