#include "model/grey_box_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/examples/grey_box.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/adaptive_model.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::example;
using test::kNaN;
using testing::HasSubstr;

constexpr double kPeriod_s = 1e-3;

/// An ascending curve, two slip elements, a branch and friction of the rate, all >= 0.
GreyBox::Parameters passive_box() {
  GreyBox::Parameters box = example<GreyBox>().parameters();
  box.terms.friction_knots = {0.0};
  box.coefficients.values = Matrix(1, box.terms.columns());
  box.coefficients.values.values = {-70.0, 0.5, 80.0, 1.0, 1.5, 30.0, 0.0, 0.25, 0.0, 1.2};
  return box;
}

GreyBox::Parameters with_curve(GreyBox::Parameters box, double factor) {
  for (std::size_t k = 0; k < box.coefficients.values.rows; ++k)
    for (std::size_t j = 0; j < box.terms.curve_knots.size(); ++j)
      box.coefficients.values(k, j) *= factor;
  return box;
}

AdaptationSettings unguarded() {
  return {.largest_error = 1e9, .frozen_after_s = 0.0, .comparison_s = 1e6};
}

AdaptiveModel adaptive(const GreyBox::Parameters& box,
                       const AdaptationSettings& settings = unguarded()) {
  return AdaptiveModel({.base = box, .adaptation = settings, .sample_period_s = kPeriod_s});
}

const GreyBox::Parameters& box_of(const AnyModel::Parameters& parameters) {
  return parameters.get<GreyBox::Parameters>();
}

/// Deflection and its rate.
std::array<double, 2> motion(int n) {
  const double t_s = kPeriod_s * n;
  return {0.08 * std::sin(3.0 * t_s) + 0.03 * std::sin(7.3 * t_s),
          0.24 * std::cos(3.0 * t_s) + 0.219 * std::cos(7.3 * t_s)};
}

struct Errors {
  double frozen = 0.0;
  double adapted = 0.0;
};

/// Learns from a joint that is `truth` for `samples`, with noise of 0.05 Nm; then the root mean square
/// errors of the next 5 s, in which nothing is learned.
Errors learned(AdaptiveModel& model, const GreyBox::Parameters& base,
               const GreyBox::Parameters& truth, int samples) {
  GreyBox joint(truth);
  GreyBox frozen(base);
  Random random(4);
  Errors errors;
  constexpr int kScored = 5000;
  for (int n = 0; n < samples + kScored; ++n) {
    const auto features = motion(n);
    const double torque = joint.step(features).value;
    const double before = frozen.step(features).value;
    const double output = model.step(features).value;
    if (n < samples) {
      (void)model.adapter().learn({.value = torque + 0.05 * random.normal()});
      continue;
    }
    errors.frozen += (before - torque) * (before - torque) / kScored;
    errors.adapted += (output - torque) * (output - torque) / kScored;
  }
  return {std::sqrt(errors.frozen), std::sqrt(errors.adapted)};
}

TEST(GreyBoxAdapter, WithoutUpdatesReturnsTheBoxsOwnValueToTheBit) {
  AdaptiveModel model = adaptive(passive_box());
  GreyBox frozen(passive_box());
  for (int n = 0; n < 500; ++n)
    EXPECT_EQ(model.step(motion(n)).value, frozen.step(motion(n)).value);
  EXPECT_EQ(model.adapter().relative_change(), 0.0);
  EXPECT_EQ(box_of(model.adapted()).coefficients, passive_box().coefficients);
}

TEST(GreyBoxAdapter, FollowsAChangeOfStiffnessOfATenthByEitherMethod) {
  for (const double by : {0.9, 1.1})
    for (const AdaptationRule rule : {AdaptationRule::automatic, AdaptationRule::nlms}) {
      AdaptationSettings settings = unguarded();
      settings.rule = rule;
      AdaptiveModel model = adaptive(passive_box(), settings);
      const Errors errors = learned(model, passive_box(), with_curve(passive_box(), by), 30000);
      EXPECT_GT(errors.frozen, 2.0);
      EXPECT_LT(errors.adapted, 0.1 * errors.frozen) << by << ' ' << name(rule);
    }
}

TEST(GreyBoxAdapter, TheAdaptedBoxHasTheOutputsOfTheAdaptiveOne) {
  GreyBox::Parameters scheduled = example<GreyBox>().parameters();
  scheduled.coefficients.scheduled = true;
  scheduled.coefficients.feature = 1;
  scheduled.coefficients.knots = {-0.3, 0.0, 0.2};
  const std::vector<double> row = scheduled.coefficients.values.values;
  scheduled.coefficients.values = Matrix(3, row.size());
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < row.size(); ++j)
      scheduled.coefficients.values(k, j) = (1.0 + 0.1 * static_cast<double>(k * k)) * row[j];
  for (const GreyBox::Parameters& box :
       {passive_box(), example<GreyBox>().parameters(), scheduled}) {
    AdaptiveModel model = adaptive(box);
    (void)learned(model, box, with_curve(box, 1.1), 5000);
    EXPECT_GT(model.adapter().relative_change(), 0.05);
    GreyBox kept(box_of(model.adapted()));
    model.reset();
    for (int n = 0; n < 2000; ++n) {
      const double output = model.step(motion(n)).value;
      EXPECT_NEAR(kept.step(motion(n)).value, output, 1e-11 * (1.0 + std::abs(output)));
    }
  }
}

/// The work that a box takes over a closed path of its deflection.
double work_of_cycles(const GreyBox::Parameters& parameters) {
  GreyBox box(parameters);
  double work = 0.0;
  double last = 0.0;
  for (int n = 0; n < 40000; ++n) {
    const double x = 0.1 * std::sin(6.283185307179586 * n / 10000.0);
    const double value = box.step(std::array{x, 0.0}).value;
    if (n >= 20000) work += value * (x - last);
    last = x;
  }
  return work;
}

TEST(GreyBoxAdapter, APassiveBoxStaysPassiveWhateverItLearns) {
  AdaptationSettings settings = unguarded();
  settings.largest_change = 3.0;  // so that signs and the order of the curve could change
  settings.initial_covariance = 1.0;
  settings.forgetting = 0.99;
  const GreyBox::Parameters base = passive_box();
  AdaptiveModel model = adaptive(base, settings);
  Random random(8);
  for (int n = 0; n < 10000; ++n) {
    const std::array features{0.1 * std::sin(0.003 * n) + 0.02 * random.normal(),
                              0.3 * random.normal()};
    const double output = model.step(features).value;
    // Against the motion: a joint that gives energy.
    (void)model.adapter().learn({.value = output + 60.0 * random.normal() - 300.0 * features[0]});
    if (n % 50 != 0) continue;
    const auto adapted = box_of(model.adapted());
    const Matrix& values = adapted.coefficients.values;
    for (std::size_t j = 1; j < 3; ++j) ASSERT_GE(values(0, j), values(0, j - 1)) << n;
    for (std::size_t j = adapted.terms.first_slip(); j < values.columns; ++j)
      ASSERT_GE(values(0, j), 0.0) << n << ' ' << j;
    if (n % 1000 == 0) {
      ASSERT_GE(work_of_cycles(adapted), -1e-9);
    }
  }
  EXPECT_GT(model.adapter().counts().of(UpdateOutcome::limited), 1000U);
  EXPECT_GT(model.adapter().counts().updates(), 9900U);
}

TEST(GreyBoxAdapter, NoCoefficientLeavesItsBoundsAndNoTermIsAdded) {
  AdaptationSettings settings = unguarded();
  settings.largest_change = 0.05;  // the joint is further away
  const GreyBox::Parameters base = example<GreyBox>().parameters();
  AdaptiveModel model = adaptive(base, settings);
  (void)learned(model, base, with_curve(base, 1.4), 20000);
  const auto adapted = box_of(model.adapted());
  const auto scale_of = [&](std::size_t column) {
    if (column < 3) return 80.0;
    if (column < 7) return 2.0;
    return std::abs(base.coefficients.values(0, column));
  };
  for (std::size_t j = 0; j < base.terms.columns(); ++j)
    EXPECT_LE(std::abs(adapted.coefficients.values(0, j) - base.coefficients.values(0, j)),
              0.05 * scale_of(j) * (1.0 + 1e-12))
        << j;
  EXPECT_EQ(adapted.coefficients.values(0, 8), 0.0);
  EXPECT_NEAR(model.adapter().relative_change(), 0.05, 1e-12);
  EXPECT_GT(model.adapter().counts().of(UpdateOutcome::limited), 100U);
}

TEST(GreyBoxAdapter, ReferencesThatCannotBeTrustedChangeNothing) {
  AdaptationSettings settings{.saturation = 60.0};
  AdaptiveModel model = adaptive(passive_box(), settings);
  const auto outcome_of = [&](int n, const ReferenceSample& reference) {
    (void)model.step(motion(n));
    return model.adapter().learn(reference);
  };
  EXPECT_EQ(outcome_of(0, {.value = kNaN}), UpdateOutcome::reference_not_finite);
  EXPECT_EQ(outcome_of(1, {.value = 1.0, .age_s = 0.1}), UpdateOutcome::reference_stale);
  EXPECT_EQ(outcome_of(2, {.value = 60.0}), UpdateOutcome::reference_saturated);
  // mNm in the place of Nm.
  EXPECT_EQ(outcome_of(700, {.value = 41000.0, .age_s = 0.0}), UpdateOutcome::reference_saturated);
  AdaptiveModel unlimited = adaptive(passive_box(), {});
  (void)unlimited.step(motion(700));
  EXPECT_EQ(unlimited.adapter().learn({.value = 41000.0}), UpdateOutcome::error_too_large);
  EXPECT_TRUE(std::isnan(unlimited.step(std::array{kNaN, 0.0}).value));
  EXPECT_EQ(unlimited.adapter().learn({.value = 1.0}), UpdateOutcome::no_estimate);
  EXPECT_EQ(model.adapter().counts().updates(), 0U);
  EXPECT_EQ(box_of(model.adapted()).coefficients, passive_box().coefficients);
  EXPECT_EQ(box_of(unlimited.adapted()).coefficients, passive_box().coefficients);
}

TEST(GreyBoxAdapter, AStuckReferenceIsStale) {
  AdaptiveModel model = adaptive(passive_box(), {});
  for (int n = 0; n < 1000; ++n) {
    (void)model.step(motion(n));
    EXPECT_EQ(model.adapter().learn({.value = 3.0}) == UpdateOutcome::reference_stale, n >= 200);
    if (n == 200) break;
  }
}

TEST(GreyBoxAdapter, RollsBackWhenTheFrozenBoxWasBetter) {
  AdaptationSettings settings = unguarded();
  settings.comparison_s = 1.0;
  settings.initial_covariance = 10.0;
  settings.forgetting = 0.9;
  settings.trace_cap = 100.0;
  AdaptiveModel model = adaptive(passive_box(), settings);
  GreyBox frozen(passive_box());
  for (int n = 0; n < 1000; ++n) {
    const double base = frozen.step(motion(n)).value;
    const double output = model.step(motion(n)).value;
    // On the other side of the frozen value than what was learned.
    (void)model.adapter().learn({.value = base + (output > base ? -5.0 : 5.0)});
  }
  EXPECT_EQ(model.adapter().counts().roll_backs, 1U);
  EXPECT_LT(model.adapter().relative_change(), settings.largest_change);
}

TEST(GreyBoxAdapter, HugeErrorsLeaveTheCoefficientsFinite) {
  AdaptationSettings settings = unguarded();
  settings.largest_error = 1e300;
  settings.initial_covariance = 1e12;
  for (const AdaptationRule rule : {AdaptationRule::rls, AdaptationRule::nlms}) {
    settings.rule = rule;
    AdaptiveModel model = adaptive(passive_box(), settings);
    for (int n = 0; n < 1000; ++n) {
      (void)model.step(motion(7 * n));
      (void)model.adapter().learn({.value = n % 3 == 0 ? 1e299 : n % 3 == 1 ? -1e299 : 1.0});
      ASSERT_LE(model.adapter().relative_change(), settings.largest_change);
    }
    EXPECT_TRUE(std::isfinite(model.step(motion(1)).value));
  }
}

TEST(GreyBoxAdapter, IsRepeatableAndResetMakesItSo) {
  const auto run = [](AdaptiveModel& model) {
    model.reset();
    (void)learned(model, passive_box(), with_curve(passive_box(), 1.1), 3000);
    return box_of(model.adapted()).coefficients;
  };
  AdaptiveModel first = adaptive(passive_box());
  AdaptiveModel second = adaptive(passive_box());
  const CoefficientSchedule once = run(first);
  EXPECT_EQ(run(second), once);
  AdaptiveModel copied = first;
  copied.adapter().reset();
  EXPECT_EQ(run(copied), once);
}

TEST(GreyBoxAdapter, RefusesWhatItCannotAdapt) {
  EXPECT_THAT(error_message([] { (void)adaptive(passive_box(), {.rule = AdaptationRule::em}); }),
              HasSubstr("expected auto, rls or nlms for a grey box, found em"));
  GreyBox::Parameters empty = passive_box();
  for (double& value : empty.coefficients.values.values) value = 0.0;
  EXPECT_THAT(error_message([&] { (void)adaptive(empty); }),
              HasSubstr("a coefficient that is not 0"));
}

}  // namespace
}  // namespace torsio
