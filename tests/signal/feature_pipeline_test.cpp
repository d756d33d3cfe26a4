#include "torsio/signal/feature_pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;
using Names = std::vector<std::string>;

FeaturePipeline pipeline(Names inputs, std::vector<ChannelDefinition> definitions = {}) {
  return {{.inputs = std::move(inputs), .definitions = std::move(definitions)}, kRate_Hz};
}

// The value of an expression of x and y (first and second of `raw`, if it uses them).
double value(const std::string& expression, std::vector<double> raw = {}) {
  FeaturePipeline features = pipeline({expression});
  EXPECT_EQ(features.raw_inputs().size(), raw.size()) << expression;
  return features.step(raw)[0];
}

TEST(Expression, BindsAsInMathematics) {
  EXPECT_EQ(value("1 + 2 * 3"), 7.0);
  EXPECT_EQ(value("(1 + 2) * 3"), 9.0);
  EXPECT_EQ(value("8 - 4 - 2"), 2.0);
  EXPECT_EQ(value("8 / 4 / 2"), 1.0);
  EXPECT_EQ(value("2 ^ 3 ^ 2"), 512.0);
  EXPECT_EQ(value("-3 ^ 2"), -9.0);
  EXPECT_EQ(value("2 ^ -1"), 0.5);
  EXPECT_EQ(value("2 * -3"), -6.0);
  EXPECT_EQ(value("--x", {4.0}), 4.0);
  EXPECT_EQ(value("+x", {4.0}), 4.0);
  EXPECT_EQ(value("x - y * x", {4.0, 0.5}), 2.0);
  EXPECT_EQ(value("x ^ 2", {-1.5}), 2.25);
  EXPECT_EQ(value("x ^ 3", {2.0}), 8.0);
}

TEST(Expression, ComputesSineCosineAndArcTangent) {
  EXPECT_DOUBLE_EQ(value("sin(x)", {0.5}), std::sin(0.5));
  EXPECT_DOUBLE_EQ(value("cos(x)", {0.5}), std::cos(0.5));
  EXPECT_DOUBLE_EQ(value("atan(100 * x)", {-0.02}), std::atan(-2.0));
  EXPECT_DOUBLE_EQ(value("sin(30deg)"), 0.5);
}

TEST(Expression, StopFollowsChangesUpToItsThreshold) {
  FeaturePipeline features = pipeline({"stop(x, 0.5)"});
  const auto step = [&](double x) { return features.step(std::vector{x})[0]; };
  EXPECT_EQ(step(10.0), 0.0);  // the first value has no predecessor
  EXPECT_EQ(step(10.25), 0.25);
  EXPECT_EQ(step(12.0), 0.5);
  EXPECT_EQ(step(11.75), 0.25);
  EXPECT_EQ(step(-3.0), -0.5);
  EXPECT_TRUE(std::isnan(step(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(step(-2.75), -0.25);  // the value that was not finite left no trace
  features.reset();
  EXPECT_EQ(step(5.0), 0.0);
  EXPECT_EQ(value("stop(3, 0.5)"), 0.0);
}

TEST(Expression, DahlFrictionApproachesItsLevelOverADistance) {
  FeaturePipeline features = pipeline({"dahl(x, 0.5)"});
  const auto step = [&](double x) { return features.step(std::vector{x})[0]; };
  EXPECT_EQ(step(3.0), 0.0);
  EXPECT_DOUBLE_EQ(step(3.25), 1.0 - std::exp(-0.5));
  // The path counts, not the number of its samples.
  EXPECT_DOUBLE_EQ(step(3.5), 1.0 - std::exp(-1.0));
  EXPECT_EQ(step(3.5), 1.0 - std::exp(-1.0));
  EXPECT_DOUBLE_EQ(step(3.25), -1.0 + (2.0 - std::exp(-1.0)) * std::exp(-0.5));
  EXPECT_TRUE(std::isnan(step(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_NEAR(step(-100.0), -1.0, 1e-12);
}

TEST(Expression, TheBoundOfAnUnknownStateShrinksWithTheMotion) {
  FeaturePipeline features =
      pipeline({"stop(x, 0.5)", "dahl(x, 0.25)", "2 * stop(x, 0.5)", "rate(stop(x, 0.5))", "x"});
  const auto errors = [&](double x) {
    static_cast<void>(features.step(std::vector{x}));
    return std::vector(features.state_errors().begin(), features.state_errors().end());
  };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  EXPECT_THAT(errors(0.0), testing::ElementsAre(0.5, 1.0, 1.0, kNone, 0.0));
  // The state is 0.2 and has been between -0.5 and 0.5: it is between -0.3 and 0.5 now.
  EXPECT_THAT(errors(0.2),
              testing::Pointwise(testing::DoubleEq(), {0.5, std::exp(-0.8), 1.0, kNone, 0.0}));
  EXPECT_THAT(errors(1.0), testing::Each(0.0));
}

TEST(Expression, FrictionHasSettledAfterAMotionThatForgetsItsStart) {
  FeaturePipeline features = pipeline({"stop(x, 0.5)", "dahl(x, 0.25)"});
  const auto settles_at = [&](double x) {
    static_cast<void>(features.step(std::vector{x}));
    return features.is_settled();
  };
  EXPECT_FALSE(settles_at(0.0));
  EXPECT_FALSE(settles_at(0.4));
  EXPECT_FALSE(settles_at(0.0)) << "a path of 0.8 is enough for the second one only";
  EXPECT_TRUE(settles_at(-0.6));
  features.reset();
  EXPECT_FALSE(features.is_settled());
  EXPECT_TRUE(pipeline({"x"}).is_settled());
}

TEST(Expression, ReadsNumbersInEveryKnownUnit) {
  EXPECT_EQ(value("1.5e-3"), 0.0015);
  EXPECT_EQ(value(".5"), 0.5);
  EXPECT_EQ(value("10Hz"), 10.0);
  EXPECT_EQ(value("2 kHz"), 2000.0);
  EXPECT_DOUBLE_EQ(value("50ms"), 0.05);
  EXPECT_DOUBLE_EQ(value("180deg"), std::numbers::pi);
  EXPECT_DOUBLE_EQ(value("60deg_s"), std::numbers::pi / 3.0);
  EXPECT_DOUBLE_EQ(value("20degC"), 293.15);
}

TEST(Expression, HasItsFunctions) {
  EXPECT_EQ(value("sign(x)", {-0.2}), -1.0);
  EXPECT_EQ(value("sign(x)", {0.0}), 0.0);
  EXPECT_EQ(value("sign(x)", {7.0}), 1.0);
  EXPECT_EQ(value("tanh(x / 0.3)", {0.15}), std::tanh(0.5));
  EXPECT_EQ(value("abs(x)", {-2.5}), 2.5);
  EXPECT_EQ(value("sqrt(x)", {2.25}), 1.5);
  EXPECT_EQ(value("exp(x)", {1.5}), std::exp(1.5));
  EXPECT_EQ(value("min(x, y)", {1.0, 2.0}), 1.0);
  EXPECT_EQ(value("max(x, y)", {1.0, 2.0}), 2.0);
  EXPECT_EQ(value(" min (\tx ,\n3 ) ", {5.0}), 3.0);
}

TEST(Expression, KeepsANanThatItMade) {
  EXPECT_TRUE(std::isnan(value("sign(x / y)", {0.0, 0.0})));
  EXPECT_TRUE(std::isnan(value("min(x / y, 1)", {0.0, 0.0})));
  EXPECT_TRUE(std::isnan(value("min(1, x / y)", {0.0, 0.0})));
  EXPECT_TRUE(std::isnan(value("max(x / y, 1)", {0.0, 0.0})));
  EXPECT_TRUE(std::isnan(value("max(1, x / y)", {0.0, 0.0})));
}

TEST(FeaturePipeline, RequiresTheChannelsOfTheDefinitionsInOrderOfAppearance) {
  const FeaturePipeline features =
      pipeline({"joint_angle_rad", "twist_rad", "lowpass(rate(twist_rad), 10Hz)"},
               {{"twist_rad", "gear_angle_rad - joint_angle_rad"},
                {"gear_angle_rad", "motor_angle_rad / ratio_1"},
                {"ratio_1", "51"},
                {"unused_rad", "other_rad * 2"}});
  EXPECT_EQ(features.raw_inputs(), (Names{"joint_angle_rad", "motor_angle_rad"}));
  EXPECT_EQ(features.feature_count(), 3U);
}

TEST(FeaturePipeline, SubstitutesDefinitionsAsIfInParentheses) {
  FeaturePipeline features = pipeline({"2 * sum_rad"}, {{"sum_rad", "x_rad + y_rad"}});
  EXPECT_EQ(features.step(std::vector{1.0, 3.0})[0], 8.0);
}

TEST(FeaturePipeline, SubtractsZerosFromRawChannels) {
  FeaturePipeline features = pipeline({"x_rad * y_rad"});
  features.set_zero("y_rad", 0.5);
  EXPECT_EQ(features.step(std::vector{2.0, 3.0})[0], 5.0);
  features.reset();
  EXPECT_EQ(features.step(std::vector{2.0, 3.0})[0], 5.0);
  features.set_zero("y_rad", 1.0);
  EXPECT_EQ(features.step(std::vector{2.0, 3.0})[0], 4.0);
  EXPECT_THROW(features.set_zero("z_rad", 1.0), UsageError);
  EXPECT_THROW(features.set_zero("x_rad", std::nan("")), UsageError);
}

TEST(FeaturePipeline, DelaysByWholeSamplesAndHoldsTheOldestUntilThen) {
  FeaturePipeline features = pipeline({"lag(x, 3)", "lag(x, 0)", "lag(x, 1)"});
  EXPECT_EQ(features.settling_samples(), 4U);
  for (int round = 0; round < 2; ++round) {
    for (int n = 0; n < 20; ++n) {
      const std::span<const double> values = features.step(std::vector{10.0 + n});
      EXPECT_EQ(values[0], 10.0 + std::max(n - 3, 0));
      EXPECT_EQ(values[1], 10.0 + n);
      EXPECT_EQ(values[2], 10.0 + std::max(n - 1, 0));
      EXPECT_EQ(features.is_settled(), n >= 3);
    }
    features.reset();
    EXPECT_FALSE(features.is_settled());
  }
}

TEST(FeaturePipeline, DelaysByATimeThatIsAWholeNumberOfSamples) {
  FeaturePipeline features = pipeline({"lag(x, 3)", "lag(x, 3ms)", "lag(x, 0.0030000000001s)"});
  for (int n = 0; n < 20; ++n) {
    const std::span<const double> values = features.step(std::vector{10.0 + n});
    EXPECT_EQ(values[1], values[0]);
    EXPECT_EQ(values[2], values[0]);
  }
}

TEST(FeaturePipeline, SettlesWhenItsSlowestChainHas) {
  const std::size_t filter = Lowpass(10.0, kRate_Hz).settling_samples();
  EXPECT_EQ(pipeline({"x", "tanh(x * 3)"}).settling_samples(), 0U);
  EXPECT_TRUE(pipeline({"x"}).is_settled());
  EXPECT_EQ(pipeline({"rate(x)"}).settling_samples(), 2U);
  EXPECT_EQ(pipeline({"lowpass(x, 10Hz)"}).settling_samples(), filter);
  EXPECT_EQ(pipeline({"lowpass(rate(x), 10Hz)"}).settling_samples(), filter + 1);
  EXPECT_EQ(pipeline({"x", "lowpass(rate(x), 10Hz) + lag(x, 5)"}).settling_samples(), filter + 1);
  EXPECT_EQ(pipeline({"lag(rate(rate(x)), 5)"}).settling_samples(), 8U);
  EXPECT_EQ(pipeline({"lag(3, 5) + lowpass(2, 1Hz) + rate(7) + x"}).settling_samples(), 0U);
}

TEST(FeaturePipeline, EstimatesTheRateOfARampOnceSettled) {
  FeaturePipeline features = pipeline({"lowpass(rate(x), 10Hz)"});
  double slope = 0.0;
  for (int n = 0; !features.is_settled(); ++n) slope = features.step(std::vector{0.002 * n})[0];
  EXPECT_NEAR(slope, 2.0, 0.02);
}

TEST(FeaturePipeline, FiltersAlikeAtEverySampleRate) {
  const FeatureSpec spec{.inputs = {"lowpass(x, 10Hz)"}, .definitions = {}};
  FeaturePipeline slow(spec, 500.0);
  FeaturePipeline fast(spec, 4000.0);
  for (int n = 0; n < 500; ++n) {
    const auto signal = [](double time_s) {
      return std::sin(2.0 * std::numbers::pi * 3.0 * time_s);
    };
    const double at_slow = slow.step(std::vector{signal(n / 500.0)})[0];
    double at_fast = 0.0;
    for (int k = 0; k < 8; ++k) {
      const double value = fast.step(std::vector{signal((8 * n + k) / 4000.0)})[0];
      if (k == 0) at_fast = value;
    }
    EXPECT_NEAR(at_slow, at_fast, 0.003) << n;
  }
}

TEST(FeaturePipeline, DistinguishesFeaturesThatAreRates) {
  const std::vector<std::pair<std::string, bool>> cases{
      {"x_rad", false},
      {"rate(x_rad)", true},
      {"lowpass(rate(x_rad - y_rad), 10Hz)", true},
      {"joint_speed_rad_s", true},
      {"belt_speed_m_s * 3 - rate(x_m)", true},
      {"tanh(speed_rad_s / 0.3)", true},
      {"x_rad * rate(x_rad)", false},
      {"max(speed_rad_s, x_rad)", false},
      {"3", false},
      {"torque_Nm_s", false},
      {"named_rad_s", true},
      {"threshold_rad_s * x_rad", false},
      {"threshold_rad_s", false},
  };
  Names inputs;
  for (const auto& [expression, expected] : cases) inputs.push_back(expression);
  const FeaturePipeline features =
      pipeline(inputs, {{"named_rad_s", "0.1 * ticks_1"}, {"threshold_rad_s", "0.3"}});
  for (std::size_t i = 0; i < cases.size(); ++i)
    EXPECT_EQ(features.is_rate(i), cases[i].second) << cases[i].first;
}

TEST(FeaturePipeline, IsNotPoisonedByAValueThatWasNotFinite) {
  FeaturePipeline disturbed =
      pipeline({"lowpass(x / y, 10Hz)", "lowpass(rate(x / y), 10Hz)", "lag(x / y, 4)"});
  for (int n = 0; n < 2000; ++n) {
    const double y = n == 500 ? 0.0 : 1.0;  // x / y is infinite in one sample
    const std::span<const double> values = disturbed.step(std::vector{1.0 + 1e-3 * n, y});
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_EQ(std::isfinite(values[i]), i == 2 ? n != 504 : n != 500 && (i == 0 || n != 501))
          << n;
  }
  const std::span<const double> values = disturbed.step(std::vector{3.0, 1.0});
  EXPECT_NEAR(values[0], 3.0, 0.05);
  EXPECT_NEAR(values[1], 1.0, 1e-6);
}

TEST(FeaturePipeline, RefusesASampleRateThatIsNone) {
  for (const double rate_Hz : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(FeaturePipeline({.inputs = {"x"}, .definitions = {}}, rate_Hz), UsageError);
}

TEST(ChannelsOf, ListsEachChannelOnce) {
  EXPECT_EQ(channels_of("rate(b_rad) * a_rad - lowpass(b_rad, 900kHz) + 3deg"),
            (Names{"b_rad", "a_rad"}));
  EXPECT_EQ(channels_of("1 + 2"), Names{});
  EXPECT_THROW((void)channels_of("a +"), Error);
}

TEST(AtSampleRate, KeepsLagsAsLongInTimeAsTheyWere) {
  const FeatureSpec spec{.inputs = {"x_rad", "lag(rate(lag( x_rad,8 )), 4) + lag(y, 10ms)"},
                         .definitions = {{"y", "lag(max(x_rad, 1), 12)"}}};
  const FeatureSpec slower = at_sample_rate(spec, 200.0, 50.0);
  EXPECT_EQ(slower.inputs, (Names{"x_rad", "lag(rate(lag( x_rad, 2)), 1) + lag(y, 10ms)"}));
  EXPECT_EQ(slower.definitions[0].expression, "lag(max(x_rad, 1), 3)");
  EXPECT_THROW((void)at_sample_rate({.inputs = {"lag(x_rad, 2)"}, .definitions = {}}, 200.0, 50.0),
               Error);
  EXPECT_THROW(
      (void)at_sample_rate({.inputs = {"lag(x_rad, 2 * 4)"}, .definitions = {}}, 200.0, 50.0),
      Error);
}

TEST(SplitInputs, SplitsOnCommasOutsideParentheses) {
  EXPECT_EQ(split_inputs("a, lowpass(b, 10Hz) ,\tmax(c, min(d, e))\n"),
            (Names{"a", "lowpass(b, 10Hz)", "max(c, min(d, e))"}));
  EXPECT_EQ(split_inputs("a"), Names{"a"});
  EXPECT_EQ(split_inputs("  "), Names{});
  EXPECT_EQ(split_inputs("a,,b,"), (Names{"a", "", "b", ""}));
}

}  // namespace
}  // namespace torsio
