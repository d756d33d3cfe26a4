#include "model/grey_box/grey_box.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// Curve over -1, 0, 1; the coefficients are 0 until a test sets them.
GreyBox::Parameters plain(std::vector<double> thresholds = {}, std::vector<double> friction = {0.0},
                          std::vector<double> time_constants = {}) {
  GreyBox::Parameters parameters;
  parameters.terms = {.curve_knots = {-1.0, 0.0, 1.0},
                      .thresholds = std::move(thresholds),
                      .friction_knots = std::move(friction),
                      .time_constants_s = std::move(time_constants),
                      .rate_scales = {0.0},
                      .sample_period_s = 0.01};
  parameters.coefficients.values = Matrix(1, parameters.terms.columns());
  return parameters;
}

double estimate(GreyBox& box, double x) { return box.step(std::array{x}).value; }

TEST(GreyBox, ItsCurveIsStraightBetweenKnotsAndBeyondThem) {
  GreyBox::Parameters parameters = plain();
  parameters.coefficients.values.values = {-10.0, 0.0, 20.0, 0.0, 0.0};
  GreyBox box(parameters);
  EXPECT_DOUBLE_EQ(estimate(box, -0.5), -5.0);
  EXPECT_DOUBLE_EQ(estimate(box, 0.25), 5.0);
  EXPECT_DOUBLE_EQ(estimate(box, 2.0), 40.0);
  EXPECT_DOUBLE_EQ(estimate(box, -3.0), -30.0);
}

TEST(GreyBox, ASlipElementHoldsUntilItsThresholdAndThenSlides) {
  GreyBox::Parameters parameters = plain({0.1});
  parameters.coefficients.values.values = {0.0, 0.0, 0.0, 4.0, 0.0, 0.0};
  GreyBox box(parameters);
  EXPECT_DOUBLE_EQ(estimate(box, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(estimate(box, 0.05), 2.0);
  EXPECT_DOUBLE_EQ(estimate(box, 0.5), 4.0);
  EXPECT_NEAR(estimate(box, 0.45), 2.0, 1e-12);
  EXPECT_DOUBLE_EQ(estimate(box, 0.0), -4.0);
}

TEST(GreyBox, ItsFrictionGrowsWithTheDeflectionAndIsHeldBeyondTheKnots) {
  GreyBox::Parameters parameters = plain({0.1}, {0.0, 1.0});
  parameters.coefficients.values.values = {0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0};
  GreyBox box(parameters);
  estimate(box, 0.0);
  EXPECT_DOUBLE_EQ(estimate(box, 0.5), 2.0);
  EXPECT_DOUBLE_EQ(estimate(box, 5.0), 3.0);
  EXPECT_DOUBLE_EQ(estimate(box, -5.0), -1.0);
}

TEST(GreyBox, ABranchRelaxesExactlyOnARamp) {
  constexpr double kTimeConstant_s = 0.05;
  constexpr double kRate = 3.0;
  GreyBox::Parameters parameters = plain({}, {0.0}, {kTimeConstant_s});
  parameters.coefficients.values.values = {0.0, 0.0, 0.0, 2.0, 0.0, 0.0};
  GreyBox box(parameters);
  for (int n = 0; n <= 40; ++n) {
    const double t = 0.01 * n;
    EXPECT_NEAR(estimate(box, kRate * t),
                2.0 * kRate * kTimeConstant_s * (1.0 - std::exp(-t / kTimeConstant_s)), 1e-13);
  }
}

TEST(GreyBox, DryFrictionSaturatesAtAnyRateScale) {
  for (const double scale : {0.05, std::numeric_limits<double>::denorm_min()}) {
    GreyBox::Parameters parameters;
    parameters.terms = {.curve_knots = {-1.0, 1.0},
                        .thresholds = {},
                        .friction_knots = {0.0},
                        .time_constants_s = {},
                        .rate_scales = {0.0, scale},
                        .sample_period_s = 0.01};
    parameters.coefficients.values = Matrix(1, parameters.terms.columns());
    parameters.coefficients.values(0, parameters.terms.first_coulomb() + 1) = 3.0;
    GreyBox box(parameters);
    EXPECT_EQ(box.step(std::array{0.0, 0.0}).value, 0.0) << scale;
    EXPECT_DOUBLE_EQ(box.step(std::array{0.0, 10.0}).value, 3.0) << scale;
    EXPECT_DOUBLE_EQ(box.step(std::array{0.0, -10.0}).value, -3.0) << scale;
  }
}

TEST(GreyBox, WithForcesThatAreNotNegativeItGivesNoWorkAway) {
  GreyBox::Parameters parameters = plain({0.02, 0.2}, {0.0}, {0.03, 0.4});
  parameters.coefficients.values.values = {-9.0, 1.0, 8.0, 0.7, 1.5, 2.0, 3.0, 0.0, 0.0};
  Random random(11);
  for (int loop = 0; loop < 100; ++loop) {
    GreyBox box(parameters);
    const double amplitude = random.uniform();
    const double second = random.uniform();
    const auto at = [&](double turns) {
      const double phase = 2.0 * std::numbers::pi * turns;
      return amplitude * (std::sin(phase) + second * std::sin(3.0 * phase));
    };
    constexpr int kSamples = 2000;
    double x = at(0.0);
    double torque = estimate(box, x);
    double work = 0.0;
    double elastic_return = 0.0;
    for (int n = 1; n <= 3 * kSamples; ++n) {
      const double next = at(static_cast<double>(n) / kSamples);
      const double next_torque = estimate(box, next);
      work += 0.5 * (torque + next_torque) * (next - x);
      elastic_return = std::abs(next_torque) * std::abs(next - x);
      x = next;
      torque = next_torque;
    }
    EXPECT_GE(work, -elastic_return) << "loop " << loop;
  }
}

TEST(GreyBox, GoesOnFromAStateThatItIsGiven) {
  GreyBox::Parameters parameters = plain({0.02, 0.2}, {0.0}, {0.3});
  parameters.coefficients.values.values = {-9.0, 1.0, 8.0, 0.7, 1.5, 2.0, 0.0, 0.0};
  GreyBox first(parameters);
  for (int n = 0; n < 50; ++n) estimate(first, 0.3 * std::sin(0.3 * n));
  const std::vector<double> state(first.state().begin(), first.state().end());
  const double x = 0.3 * std::sin(0.3 * 49);
  GreyBox second(parameters);
  second.set_state(state);
  // The first sample has no increment: the branch decays for one more period.
  first.step(std::array{x});
  EXPECT_DOUBLE_EQ(estimate(first, x), (estimate(second, x), estimate(second, x)));
}

TEST(GreyBox, BringsAStateOutOfBoundsToItsBoundAndPassesOverWhatIsNoNumber) {
  GreyBox box(plain({0.02, 0.2}));
  box.set_state(std::array{7.0, -0.5});
  EXPECT_THAT(box.state(), testing::ElementsAre(1.0, -0.5));
  box.set_state(std::array{std::nan(""), 0.25});
  EXPECT_THAT(box.state(), testing::ElementsAre(1.0, 0.25));
}

/// A network whose output is `value` for any input.
Mlp::Parameters constant_network(std::size_t inputs, double value) {
  Mlp::Parameters network;
  network.scaling.inputs.centre.assign(inputs, 0.0);
  network.scaling.inputs.scale.assign(inputs, 1.0);
  network.scaling.target_centre = value;
  network.scaling.target_scale = 1.0;
  DenseLayer layer;
  layer.weights = FloatMatrix(1, inputs);
  layer.bias = {0.0F};
  layer.activation = static_cast<std::size_t>(Activation::linear);
  network.layers = {layer};
  return network;
}

TEST(GreyBox, ItsResidualIsBoundedAndFadesOutBeyondItsTrainingData) {
  GreyBox::Parameters parameters = plain({0.1});
  parameters.residual = {.model = constant_network(2, 5.0),
                         .bound = 2.0,
                         .lowest = {-1.0, -1.0},
                         .highest = {1.0, 1.0}};
  GreyBox box(parameters);
  EXPECT_DOUBLE_EQ(estimate(box, 0.5), 2.0) << "bounded";
  EXPECT_NEAR(estimate(box, 1.1), 1.0, 1e-12) << "half of the border";
  EXPECT_DOUBLE_EQ(estimate(box, 1.3), 0.0) << "beyond it";
}

TEST(GreyBox, InvertsFromWhereItIsWithinItsCurve) {
  GreyBox::Parameters parameters = plain({0.02, 0.2});
  parameters.coefficients.values.values = {-9.0, 1.0, 18.0, 0.7, 1.5, 0.0, 0.0};
  GreyBox box(parameters);
  Random random(5);
  double x = 0.0;
  for (int n = 0; n < 1000; ++n) {
    const double target = -8.0 + 24.0 * random.uniform();
    const Estimate found = box.invert(target, std::array{x});
    ASSERT_EQ(found.fault, Fault::none);
    x = found.value;
    EXPECT_NEAR(estimate(box, x), target, 1e-9);
  }
}

TEST(GreyBox, InvertsFrictionUnderLoadBanksAndAScheduleToTheLastDigits) {
  GreyBox::Parameters parameters;
  parameters.terms = {.curve_knots = {-1.0, -0.2, 0.3, 1.0},
                      .thresholds = {0.02, 0.2},
                      .friction_knots = {-1.0, 0.0, 1.0},
                      .time_constants_s = {},
                      .rate_scales = {0.0, 0.05},
                      .sample_period_s = 0.001,
                      .banks = {{.input = 1,
                                 .thresholds = {0.05},
                                 .force_knots = {-0.5, 0.5},
                                 .product_knots = {-0.5, 0.5},
                                 .product_input = 0}}};
  const std::vector<double> row = {-9.0, -1.0, 3.0, 15.0, 0.5, 0.3, 0.8, 1.0, 0.6,
                                   1.4,  0.0,  0.7, 0.0,  0.4, 0.3, 0.9, 0.2, 0.5};
  Matrix values(2, row.size());
  for (std::size_t j = 0; j < row.size(); ++j) {
    values(0, j) = row[j];
    values(1, j) = 1.2 * row[j];
  }
  for (const bool scheduled : {false, true}) {
    parameters.coefficients = {
        .scheduled = scheduled, .feature = 1, .knots = {-0.3, 0.3}, .values = values};
    if (!scheduled) {
      parameters.coefficients.knots.clear();
      parameters.coefficients.values = Matrix(1, row.size());
      parameters.coefficients.values.values = row;
    }
    GreyBox box(parameters);
    Random random(7);
    for (int n = 0; n < 1000; ++n) {
      const double u = 0.4 * std::sin(0.11 * n);
      const double target = -7.0 + 20.0 * random.uniform();
      const Estimate found = box.invert(target, std::array{0.0, u});
      ASSERT_EQ(found.fault, Fault::none) << n;
      EXPECT_NEAR(box.step(std::array{found.value, u}).value, target, 1e-10) << n;
    }
  }
}

TEST(GreyBox, InvertsTheContinuationOfItsCurveAndReportsATargetBeyondIt) {
  GreyBox::Parameters parameters = plain();
  parameters.coefficients.values.values = {-10.0, 0.0, 20.0, 0.0, 0.0};
  GreyBox box(parameters);
  for (const double target : {50.0, -20.0}) {
    const Estimate beyond = box.invert(target, std::array{0.0});
    EXPECT_EQ(beyond.fault, Fault::none);
    EXPECT_GT(std::abs(beyond.value), 1.0);
    EXPECT_NEAR(estimate(box, beyond.value), target, 1e-9);
  }
  const Estimate found = box.invert(500.0, std::array{0.0});
  EXPECT_EQ(found.value, 1.0);
  EXPECT_EQ(found.fault, Fault::outside_training_range);
}

TEST(GreyBox, RefusesAStructureThatMakesNoSense) {
  const auto refused = [](auto change) {
    GreyBox::Parameters parameters = plain({0.1});
    change(parameters);
    return test::error_message([&] { GreyBox box(parameters); });
  };
  EXPECT_THAT(refused([](auto& p) {
                p.terms.curve_knots = {1.0, 0.0, 2.0};
              }),
              HasSubstr("curve_knots"));
  EXPECT_THAT(refused([](auto& p) { p.terms.curve_knots = {1.0}; }), HasSubstr("curve_knots"));
  EXPECT_THAT(refused([](auto& p) { p.terms.thresholds = {-0.1}; }), HasSubstr("thresholds"));
  EXPECT_THAT(refused([](auto& p) { p.terms.friction_knots.clear(); }),
              HasSubstr("friction_knots"));
  EXPECT_THAT(refused([](auto& p) { p.terms.time_constants_s = {0.0}; }),
              HasSubstr("time_constants_s"));
  EXPECT_THAT(refused([](auto& p) { p.terms.rate_scales = {}; }), HasSubstr("rate_scales"));
  EXPECT_THAT(refused([](auto& p) { p.terms.sample_period_s = 0.0; }),
              HasSubstr("sample_period_s"));
  EXPECT_THAT(refused([](auto& p) { p.coefficients.values = Matrix(1, 3); }),
              HasSubstr("coefficients"));
  EXPECT_THAT(refused([](auto& p) { p.residual = {.model = constant_network(1, 0.0)}; }),
              HasSubstr("residual"));
}

}  // namespace
}  // namespace torsio
