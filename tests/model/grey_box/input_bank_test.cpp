#include "model/grey_box/input_bank.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "model/grey_box/grey_box.hpp"
#include "model/grey_box_adapter.hpp"
#include "support/error_message.hpp"
#include "support/grey_box_examples.hpp"
#include "torsio/model/adaptive_model.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// A box of two inputs that is 0 but for its bank.
GreyBox::Parameters with_bank(const InputBank& bank, const std::vector<double>& coefficients) {
  GreyBox::Parameters parameters;
  parameters.terms = {.curve_knots = {-1.0, 1.0},
                      .thresholds = {},
                      .friction_knots = {0.0},
                      .time_constants_s = {},
                      .rate_scales = {0.0, 0.0},
                      .sample_period_s = 0.01,
                      .banks = {bank}};
  parameters.coefficients.values = Matrix(1, parameters.terms.columns());
  std::ranges::copy(coefficients, parameters.coefficients.values.values.begin() +
                                      static_cast<std::ptrdiff_t>(parameters.terms.first_bank()));
  return parameters;
}

double estimate(GreyBox& box, double x, double u) { return box.step(std::array{x, u}).value; }

TEST(InputBank, ItsSlipsFollowAnotherInputWithForcesThatDependOnTheFirst) {
  GreyBox box(with_bank({.thresholds = {0.1}, .force_knots = {0.0, 1.0}}, {1.0, 3.0}));
  EXPECT_DOUBLE_EQ(estimate(box, 0.0, 5.0), 0.0) << "nothing has moved";
  EXPECT_NEAR(estimate(box, 0.0, 5.05), 0.5, 1e-12);
  EXPECT_DOUBLE_EQ(estimate(box, 0.5, 6.0), 2.0);
  EXPECT_DOUBLE_EQ(estimate(box, 7.0, 6.0), 3.0) << "held beyond the knots";
  EXPECT_NEAR(estimate(box, 0.0, 5.9), 0.0, 1e-12) << "on the way back";
}

TEST(InputBank, TheSlipsOfARateFollowItsIntegralAndItsZeroOffsetCannotRunAway) {
  GreyBox by_rate(with_bank({.is_integrated = true, .thresholds = {0.02, 0.1}}, {1.0, 2.0}));
  GreyBox by_angle(with_bank({.thresholds = {0.02, 0.1}}, {1.0, 2.0}));
  double angle = 0.3;
  estimate(by_rate, 0.0, 0.0);
  estimate(by_angle, 0.0, angle);
  for (int n = 0; n < 500; ++n) {
    const double rate = 5.0 * std::cos(0.05 * n);
    angle += 0.01 * rate;
    EXPECT_NEAR(estimate(by_rate, 0.0, rate), estimate(by_angle, 0.0, angle), 1e-9);
  }
  for (int n = 0; n < 1000000; ++n) estimate(by_rate, 0.0, 0.001);
  EXPECT_NEAR(estimate(by_rate, 0.0, 0.001), 3.0, 1e-9) << "all slip, and no more";
  estimate(by_rate, 0.0, -0.21 / 0.01);
  EXPECT_NEAR(estimate(by_rate, 0.0, 0.0), -3.0, 1e-9) << "turns at once";
}

TEST(InputBank, ItsCurveIsZeroAtItsOuterKnotsAndItsProductIsASlope) {
  GreyBox curve(with_bank({.curve_knots = {-1.0, 0.0, 1.0, 2.0}}, {4.0, 8.0}));
  EXPECT_DOUBLE_EQ(estimate(curve, 0.0, -1.0), 0.0);
  EXPECT_DOUBLE_EQ(estimate(curve, 0.0, -0.5), 2.0);
  EXPECT_DOUBLE_EQ(estimate(curve, 0.0, 0.5), 6.0);
  EXPECT_DOUBLE_EQ(estimate(curve, 0.0, 1.5), 4.0);
  EXPECT_DOUBLE_EQ(estimate(curve, 0.0, 3.0), 0.0);
  GreyBox product(with_bank({.product_knots = {0.0, 1.0}, .product_input = 0}, {2.0, 6.0}));
  EXPECT_DOUBLE_EQ(estimate(product, 0.5, 3.0), 12.0);
  EXPECT_DOUBLE_EQ(estimate(product, 9.0, 3.0), 18.0);
}

TEST(InputBank, AShortRelaxationOfARateIsAnInertia) {
  constexpr double kTimeConstant_s = 0.01;
  GreyBox box(with_bank({.is_integrated = true, .time_constants_s = {kTimeConstant_s}}, {1.0}));
  double value = 0.0;
  for (int n = 0; n < 100; ++n) value = estimate(box, 0.0, 3.0 * kTimeConstant_s * n);
  EXPECT_NEAR(value, 3.0 * kTimeConstant_s, 1e-12) << "acceleration times the time constant";
}

TEST(InputBank, GoesOnFromAStateAndPassesOverWhatIsNoNumber) {
  const InputBank bank{.thresholds = {0.1, 0.3}, .time_constants_s = {0.05}};
  GreyBox box(with_bank(bank, {1.0, 2.0, 3.0}));
  for (int n = 0; n < 30; ++n) estimate(box, 0.0, 0.4 * std::sin(0.3 * n));
  const std::vector<double> state(box.state().begin(), box.state().end());
  ASSERT_EQ(state.size(), bank.states());
  estimate(box, 0.0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(box.state(), testing::ElementsAreArray(state));
  GreyBox second(with_bank(bank, {1.0, 2.0, 3.0}));
  second.set_state(state);
  EXPECT_THAT(second.state(), testing::ElementsAreArray(state));
  second.set_state(std::array{9.0, std::nan(""), 1.0});
  EXPECT_THAT(second.state(), testing::ElementsAre(1.0, state[1], 1.0));
}

TEST(InputBank, IsInvertedWithTheOtherInputsAsGiven) {
  GreyBox::Parameters parameters = test::example<test::GreyBoxWithBanks>().parameters();
  GreyBox box(parameters);
  for (int n = 0; n < 300; ++n) {
    const double u = 0.3 * std::sin(0.11 * n);
    const double target = 20.0 * std::sin(0.07 * n);
    const Estimate found = box.invert(target, std::array{box.terms().position(), u});
    ASSERT_EQ(found.fault, Fault::none) << n;
    EXPECT_NEAR(estimate(box, found.value, u), target, 0.2)
        << "but for what relaxes within the sample";
  }
}

TEST(InputBank, DeclaresTheTravelOfItsInputAsMemory) {
  const std::array low{-1.0, -2.0};
  const std::array high{1.0, 2.0};
  const InputBank bank{.is_integrated = true, .thresholds = {0.1}, .time_constants_s = {0.05}};
  const ModelMemory memory = GreyBox(with_bank(bank, {-4.0, 3.0})).memory({low, high});
  ASSERT_EQ(memory.slips.size(), 1U);
  EXPECT_DOUBLE_EQ(memory.slips[0].gain, 40.0);
  EXPECT_DOUBLE_EQ(memory.slips[0].travel, 0.2);
  EXPECT_EQ(memory.slips[0].input, 1U);
  EXPECT_DOUBLE_EQ(memory.slips[0].period_s, 0.01);
  ASSERT_EQ(memory.relaxations.size(), 1U);
  EXPECT_DOUBLE_EQ(memory.relaxations[0].gain, 12.0);
  EXPECT_EQ(memory.relaxations[0].input, 1U);
}

TEST(InputBank, IsAdaptedWithTheOtherTerms) {
  const GreyBox::Parameters base = test::example<test::GreyBoxWithBanks>().parameters();
  GreyBox::Parameters truth = base;
  for (std::size_t j = base.terms.first_bank(); j < base.terms.columns(); ++j)
    truth.coefficients.values(0, j) *= 1.3;
  AdaptiveModel model(
      {.base = base,
       .adaptation = {.largest_error = 1e9, .frozen_after_s = 0.0, .comparison_s = 1e6},
       .sample_period_s = 1e-3});
  GreyBox joint(truth);
  GreyBox frozen(base);
  double before = 0.0;
  double after = 0.0;
  for (int n = 0; n < 60000; ++n) {
    const double t_s = 1e-3 * n;
    const std::array features{0.08 * std::sin(3.0 * t_s) + 0.03 * std::sin(7.3 * t_s),
                              0.3 * std::cos(2.0 * t_s) + 0.2 * std::sin(5.1 * t_s)};
    const double torque = joint.step(features).value;
    const double error = frozen.step(features).value - torque;
    const double adapted = model.step(features).value - torque;
    (void)model.adapter().learn({.value = torque});
    if (n < 50000) continue;
    before += error * error;
    after += adapted * adapted;
  }
  EXPECT_LT(after, 0.0625 * before) << "a quarter of the error";
}

TEST(InputBank, RefusesAStructureThatMakesNoSense) {
  const auto refused = [](const std::function<void(InputBank&)>& change) {
    InputBank bank{.thresholds = {0.1}};
    change(bank);
    return test::error_message([&] { bank.check(2, "grey_box: banks/0"); });
  };
  EXPECT_THAT(refused([](auto& b) { b.input = 0; }), HasSubstr("banks/0/input"));
  EXPECT_THAT(refused([](auto& b) { b.input = 2; }), HasSubstr("banks/0/input"));
  EXPECT_THAT(refused([](auto& b) { b.thresholds = {0.0}; }), HasSubstr("thresholds"));
  EXPECT_THAT(refused([](auto& b) { b.force_knots.clear(); }), HasSubstr("force_knots"));
  EXPECT_THAT(refused([](auto& b) { b.curve_knots = {0.0, 1.0}; }), HasSubstr("curve_knots"));
  EXPECT_THAT(refused([](auto& b) { b.product_knots = {1.0}; }), HasSubstr("product_knots"));
  EXPECT_THAT(refused([](auto& b) { b.product_input = 1; }), HasSubstr("product_input"));
  EXPECT_THAT(refused([](auto& b) { b.time_constants_s = {-1.0}; }), HasSubstr("time_constants_s"));
}

}  // namespace
}  // namespace torsio
