#include "torsio/estimate/estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kInfinity;
using test::kNaN;
using testing::HasSubstr;

/// Outputs `gain` times its input plus the number of ticks so far, or a fixed estimate.
class Scripted {
 public:
  struct Parameters {
    double gain = 10.0;
    Estimate output = {.value = 0.0};
    bool is_fixed = false;  ///< outputs `output`
    std::size_t inputs = 1;
  };
  explicit Scripted(const Parameters& parameters) : parameters_(parameters) {}
  [[nodiscard]] Parameters parameters() const { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.inputs; }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return 1; }
  [[nodiscard]] int ticks() const noexcept { return ticks_; }
  void reset() noexcept { ticks_ = 0; }
  Estimate step(Features features) noexcept {
    ++ticks_;
    if (parameters_.is_fixed) return parameters_.output;
    return {.value = parameters_.gain * features[0]};
  }

 private:
  Parameters parameters_;
  int ticks_ = 0;
};

using ScriptedEstimator = BasicEstimator<Scripted>;

/// One input that needs no settling, trained on -1..1.
EstimatorSettings scripted_settings(const std::string& input = "gear_angle_rad") {
  return {.features = {.inputs = {input}, .definitions = {}},
          .sample_rate_Hz = 1000.0,
          .target = "torque_Nm",
          .zeroed_channels = {},
          .ranges = {.lowest = {-1.0}, .highest = {1.0}, .margin = 0.05},
          .fallback = {.intercept = 0.5, .slope = {7.0}, .residual_std = 3.0},
          .residuals = {}};
}

Estimate step(ScriptedEstimator& estimator, double value) { return estimator.step({{value}}); }

ScriptedEstimator with_output(const Estimate& estimate) {
  return {scripted_settings(), Scripted({.output = estimate, .is_fixed = true})};
}

std::string refusal(const EstimatorSettings& bad, std::size_t inputs = 1) {
  return error_message([&] { ScriptedEstimator(bad, Scripted({.inputs = inputs})); });
}

TEST(Estimator, ReturnsTheOutputOfItsModel) {
  ScriptedEstimator estimator(scripted_settings(), Scripted({}));
  EXPECT_THAT(estimator.raw_inputs(), testing::ElementsAre("gear_angle_rad"));
  const Estimate estimate = step(estimator, 0.25);
  EXPECT_EQ(estimate.value, 2.5);
  EXPECT_EQ(estimate.fault, Fault::none);
  EXPECT_TRUE(std::isnan(estimate.std_dev)) << "no evidence, no error bar";
}

TEST(Estimator, HoldsTheLastGoodValueWhileAnInputIsMissing) {
  ScriptedEstimator estimator(scripted_settings(), Scripted({}));
  EXPECT_EQ(step(estimator, kNaN).value, 0.0) << "nothing to hold yet";
  step(estimator, 0.5);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    const Estimate held = step(estimator, bad);
    EXPECT_EQ(held.value, 5.0);
    EXPECT_EQ(held.fault, Fault::input_not_finite);
    EXPECT_TRUE(std::isnan(held.std_dev));
  }
  EXPECT_EQ(step(estimator, 0.1).fault, Fault::none);
}

TEST(Estimator, RefusesAnotherNumberOfInputs) {
  ScriptedEstimator estimator(scripted_settings(), Scripted({}));
  step(estimator, 0.5);
  const Estimate none = estimator.step({});
  const Estimate two = estimator.step(std::array{0.1, 0.2});
  EXPECT_EQ(none.fault, Fault::input_count_wrong);
  EXPECT_EQ(two.fault, Fault::input_count_wrong);
  EXPECT_EQ(two.value, 5.0);
  EXPECT_EQ(estimator.model().ticks(), 1);
}

TEST(Estimator, RunsOnAcrossAShortGapAndStartsAfreshAfterALongOne) {
  ScriptedEstimator estimator(scripted_settings("lag(gear_angle_rad, 3)"), Scripted({}));
  while (!estimator.is_settled()) step(estimator, 0.5);
  ASSERT_EQ(step(estimator, 0.5).fault, Fault::none);
  for (int i = 0; i < 10; ++i) step(estimator, kNaN);  // 10 ms: the longest gap
  EXPECT_EQ(step(estimator, 0.5).fault, Fault::none);
  const int ticks = estimator.model().ticks();
  for (int i = 0; i < 11; ++i) step(estimator, kNaN);
  EXPECT_EQ(estimator.model().ticks(), ticks) << "the model is not stepped without inputs";
  EXPECT_EQ(step(estimator, 0.5).fault, Fault::warming_up);
  EXPECT_EQ(estimator.model().ticks(), 1) << "the model's memory started afresh too";
}

TEST(Estimator, RecoversFromInputsThatPoisonItsFilters) {
  ScriptedEstimator estimator(scripted_settings("lowpass(gear_angle_rad * gear_angle_rad, 100Hz)"),
                              Scripted({}));
  while (!estimator.is_settled()) step(estimator, 0.5);
  const double before = step(estimator, 0.5).value;
  const Estimate overflow = step(estimator, 1e200);
  EXPECT_EQ(overflow.fault, Fault::input_not_finite);
  EXPECT_EQ(overflow.value, before);
  EXPECT_EQ(step(estimator, 0.5).fault, Fault::warming_up);
  while (!estimator.is_settled()) step(estimator, 0.5);
  EXPECT_NEAR(step(estimator, 0.5).value, before, 1e-9);
}

TEST(Estimator, ReturnsTheFallbackWhileItWarmsUp) {
  ScriptedEstimator estimator(scripted_settings("lag(gear_angle_rad, 3)"), Scripted({}));
  const Estimate first = step(estimator, 0.5);
  EXPECT_EQ(first.fault, Fault::warming_up);
  EXPECT_EQ(first.value, 0.5 + 7.0 * 0.5);
  EXPECT_EQ(first.std_dev, 3.0);
  EXPECT_FALSE(estimator.is_settled());
}

TEST(Estimator, ReturnsTheFallbackOutsideTheTrainingRange) {
  ScriptedEstimator estimator(scripted_settings(), Scripted({}));
  const Estimate outside = step(estimator, 1.11);
  EXPECT_EQ(outside.fault, Fault::outside_training_range);
  EXPECT_DOUBLE_EQ(outside.value, 0.5 + 7.0 * 1.11);
  EXPECT_TRUE(std::isnan(outside.std_dev)) << "the fallback was not measured there";
  EXPECT_EQ(step(estimator, -1.11).fault, Fault::outside_training_range);
}

TEST(Estimator, HandsOverToTheFallbackAcrossTheBorder) {
  const double model = 10.0;
  ScriptedEstimator estimator = with_output({.value = model, .std_dev = 2.0});
  EXPECT_EQ(step(estimator, 1.0).value, model) << "the model alone, up to the range's end";
  EXPECT_EQ(step(estimator, 1.0).std_dev, 2.0);
  for (const double weight : {0.1, 0.5, 0.9}) {
    for (const double side : {-1.0, 1.0}) {
      const double x = side * (1.0 + 0.1 * weight);
      const double fallback = 0.5 + 7.0 * x;
      const double apart = model - fallback;
      const Estimate blend = step(estimator, x);
      EXPECT_EQ(blend.fault, Fault::none);
      EXPECT_NEAR(blend.value, (1.0 - weight) * model + weight * fallback, 1e-4);
      EXPECT_NEAR(
          blend.std_dev,
          std::sqrt((1.0 - weight) * 4.0 + weight * 9.0 + weight * (1.0 - weight) * apart * apart),
          1e-4);
    }
  }
}

/// A spring that extrapolates linearly.
class Continuing : public Scripted {
 public:
  using Scripted::Scripted;
  static constexpr FamilyTraits kTraits{.continues = true};
};

/// Deflection and its rate, trained on -1..1 and -2..2, with steps of at most 1.
template <class Model>
BasicEstimator<Model> of_a_motion(const Estimate& output) {
  EstimatorSettings with_rate = scripted_settings();
  with_rate.features.inputs = {"gear_angle_rad", "motor_speed_rad_s"};
  with_rate.ranges = {.lowest = {-1.0, -2.0}, .highest = {1.0, 2.0}, .margin = 0.05};
  with_rate.fallback.slope = {7.0, 0.0};
  with_rate.disturbances.largest_step = {1.0, 100.0};
  return {with_rate, Model({.output = output, .is_fixed = true, .inputs = 2})};
}

TEST(Estimator, UsesTheModelAtARateBeyondItsRangeAndReportsIt) {
  auto estimator = of_a_motion<Scripted>({.value = 10.0, .std_dev = 2.0});
  EXPECT_EQ(estimator.step({{0.5, 2.0}}).fault, Fault::none);
  const Estimate twice = estimator.step({{0.5, 4.0}});
  EXPECT_EQ(twice.fault, Fault::outside_training_range);
  EXPECT_EQ(twice.value, 10.0);
  EXPECT_NEAR(twice.std_dev, 2.0 * (1.0 + 2.0 * 0.5), 1e-6) << "half a width beyond";
  EXPECT_EQ(estimator.step({{0.5, -60.0}}).value, 10.0) << "however fast";
  EXPECT_EQ(estimator.step({{0.5, 0.0}}).fault, Fault::none);
}

TEST(Estimator, UsesAModelThatContinuesUpToOneWidthBeyondItsRange) {
  auto estimator = of_a_motion<Continuing>({.value = 10.0, .std_dev = 2.0});
  const Estimate beyond = estimator.step({{2.0, 0.0}});
  EXPECT_EQ(beyond.fault, Fault::outside_training_range);
  EXPECT_EQ(beyond.value, 10.0);
  const double fallback = 0.5 + 7.0 * 2.0;
  EXPECT_NEAR(beyond.std_dev, std::hypot(2.0 * (1.0 + 2.0 * 0.5), 0.5 * (10.0 - fallback)), 1e-6);
  const Estimate far = estimator.step({{3.2, 0.0}});
  EXPECT_EQ(far.value, 0.5 + 7.0 * 3.2) << "the fallback beyond the width and the border";
  EXPECT_TRUE(std::isnan(far.std_dev));
  auto other = of_a_motion<Scripted>({.value = 10.0, .std_dev = 2.0});
  EXPECT_EQ(other.step({{2.0, 0.0}}).value, fallback) << "a model that does not continue";
}

TEST(Estimator, DoesNotUseAModelThatContinuesAfterAJump) {
  auto estimator = of_a_motion<Continuing>({.value = 10.0, .std_dev = 2.0});
  EXPECT_EQ(estimator.step({{-0.9, 0.0}}).value, 10.0);
  for (int n = 0; n < 10; ++n) {
    const Estimate held = estimator.step({{1.5, 0.0}});
    EXPECT_EQ(held.value, 10.0) << "for 10 ms it may return";
    EXPECT_EQ(held.fault, Fault::outside_training_range);
  }
  const Estimate jumped = estimator.step({{1.5, 0.0}});
  EXPECT_EQ(jumped.value, 0.5 + 7.0 * 1.5);
  EXPECT_TRUE(std::isnan(jumped.std_dev));
  EXPECT_EQ(estimator.step({{1.4, 0.0}}).value, 0.5 + 7.0 * 1.4) << "until it is inside again";
}

TEST(Estimator, ReturnsNoErrorBarForABlendWithoutEvidence) {
  ScriptedEstimator estimator = with_output({.value = 10.0});
  EXPECT_TRUE(std::isnan(step(estimator, 1.05).std_dev));
  EstimatorSettings no_evidence = scripted_settings();
  no_evidence.fallback.residual_std = kNaN;
  ScriptedEstimator other(no_evidence,
                          Scripted({.output = {.value = 1.0, .std_dev = 2.0}, .is_fixed = true}));
  EXPECT_TRUE(std::isnan(step(other, 1.05).std_dev));
}

TEST(Estimator, StaysFiniteWhenModelAndFallbackAreFurtherApartThanTheLargestNumber) {
  EstimatorSettings far = scripted_settings();
  far.fallback = {.intercept = -1e308, .slope = {0.0}, .residual_std = 1.0};
  ScriptedEstimator estimator(
      far, Scripted({.output = {.value = 1e308, .std_dev = 1.0}, .is_fixed = true}));
  const Estimate middle = step(estimator, 1.05);
  EXPECT_LT(std::abs(middle.value), 1e304);
  EXPECT_FALSE(std::isinf(middle.std_dev));
}

/// Trained on a range of any place, width and margin in each of two features.
EstimatorSettings any_two_ranges() {
  const auto in = [](double low, double high) {
    return low + (high - low) * 1e-3 * *rc::gen::inRange(0, 1001);
  };
  EstimatorSettings two = scripted_settings();
  two.features.inputs = {"gear_angle_rad", "joint_angle_rad"};
  two.ranges = {.lowest = {in(-5.0, 5.0), in(-5.0, 5.0)}, .highest = {}, .margin = in(0.01, 0.3)};
  for (const double lowest : two.ranges.lowest) two.ranges.highest.push_back(lowest + in(0.1, 4.0));
  two.fallback = {.intercept = 100.0, .slope = {in(-9.0, 9.0), in(-9.0, 9.0)}, .residual_std = 3.0};
  return two;
}

RC_GTEST_PROP(Estimator, ItsValueJumpsInNoFeature, ()) {
  const EstimatorSettings two = any_two_ranges();
  ScriptedEstimator estimator(two, Scripted({.inputs = 2}));
  const auto border = [&](std::size_t i) {
    return two.ranges.margin * (two.ranges.highest[i] - two.ranges.lowest[i]);
  };
  const std::size_t moving = *rc::gen::inRange<std::size_t>(0, 2);
  const std::size_t still = 1 - moving;
  std::array<double, 2> x{};
  x[still] = two.ranges.highest[still] + 0.1 * *rc::gen::inRange(-10, 15) * border(still);
  const double from = two.ranges.lowest[moving] - 2.0 * border(moving);
  const double to = two.ranges.highest[moving] + 2.0 * border(moving);
  const double stride = 1e-3 * border(moving);
  x[moving] = from;
  double before = estimator.step(x).value;
  // Over one border the blend turns from the one into the other, less than 500 apart; both are
  // themselves less steep than 10.
  const double most = 1.1 * (500.0 * 1e-3 + 10.0 * stride);
  for (int i = 1; from + i * stride < to; ++i) {
    x[moving] = from + i * stride;
    const double value = estimator.step(x).value;
    RC_ASSERT(std::abs(value - before) <= most);
    before = value;
  }
}

RC_GTEST_PROP(Estimator, TheModelAloneAnswersWithinTheRange, ()) {
  const EstimatorSettings two = any_two_ranges();
  ScriptedEstimator estimator(two, Scripted({.inputs = 2}));
  std::array<double, 2> x{};
  for (std::size_t i = 0; i < 2; ++i)
    x[i] =
        std::lerp(two.ranges.lowest[i], two.ranges.highest[i], 1e-3 * *rc::gen::inRange(0, 1001));
  RC_ASSERT(estimator.step(x).value == 10.0 * x[0]);
}

TEST(Estimator, AllowsRoundingWhereAFeatureWasConstantInTraining) {
  EstimatorSettings constant = scripted_settings();
  constant.ranges.lowest = constant.ranges.highest = {0.033};
  ScriptedEstimator estimator(constant, Scripted({}));
  const auto value_is_the_models = [&](double x) { return step(estimator, x).value == 10.0 * x; };
  EXPECT_TRUE(value_is_the_models(0.033));
  EXPECT_TRUE(value_is_the_models(0.033 * (1.0 + 1e-12)));
  EXPECT_TRUE(value_is_the_models(static_cast<double>(0.033F))) << "it came as a float32";
  EXPECT_EQ(step(estimator, 0.034).fault, Fault::outside_training_range);
  EXPECT_EQ(step(estimator, 0.033 * (1.0 + 1e-6)).fault, Fault::outside_training_range);
}

TEST(Estimator, JumpsNotEvenWhereAFeatureWasConstantInTraining) {
  for (const double trained_at : {0.0, 0.033, -300.0}) {
    EstimatorSettings constant = scripted_settings();
    constant.ranges.lowest = constant.ranges.highest = {trained_at};
    constant.fallback = {.intercept = 50.0, .slope = {0.0}};
    ScriptedEstimator estimator(constant, Scripted({.output = {.value = 10.0}, .is_fixed = true}));
    const double reach = 4e-7 * (trained_at == 0.0 ? 1.0 : std::abs(trained_at));
    double before = step(estimator, trained_at - reach).value;
    EXPECT_EQ(before, 50.0);
    for (int i = -999; i <= 1000; ++i) {
      const double value = step(estimator, trained_at + reach * 1e-3 * i).value;
      ASSERT_LT(std::abs(value - before), 0.4) << trained_at << ", step " << i;
      before = value;
    }
    EXPECT_EQ(step(estimator, trained_at).value, 10.0);
    EXPECT_EQ(before, 50.0);
  }
}

/// Adds up its inputs: a memory that never ends.
class Summing : public Scripted {
 public:
  using Scripted::Scripted;
  [[nodiscard]] ModelMemory memory(const InputRanges& /*ranges*/) const {
    return {.slips = {{.gain = 1.0, .travel = 0.5}}};
  }
  void reset() noexcept { sum_ = 0.0; }
  Estimate step(Features features) noexcept {
    sum_ += features[0];
    return {.value = sum_, .std_dev = 0.1};
  }

 private:
  double sum_ = 0.0;
};

EstimatorSettings with_steps(double largest_step) {
  EstimatorSettings guarded = scripted_settings();
  guarded.disturbances.largest_step = {largest_step};
  return guarded;
}

TEST(Estimator, AJumpAndBackIsAGapThatIsInterpolated) {
  BasicEstimator<Summing> estimator(with_steps(0.1), Summing(Scripted::Parameters{}));
  ASSERT_EQ(estimator.step({{0.25}}).value, 0.25);
  for (const double jump : {-0.9, 1e6}) {
    const Estimate jumped = estimator.step({{jump}});
    EXPECT_EQ(jumped.fault, Fault::outside_training_range);
    EXPECT_TRUE(std::isnan(jumped.std_dev));
  }
  const Estimate back = estimator.step({{0.1}});
  EXPECT_EQ(back.fault, Fault::none);
  EXPECT_NEAR(back.value, 0.25 + 0.2 + 0.15 + 0.1, 1e-12);
}

TEST(Estimator, ANewLevelIsUsedOnceItHasLastedAndLeavesDoubt) {
  BasicEstimator<Summing> estimator(with_steps(0.1), Summing(Scripted::Parameters{}));
  ASSERT_EQ(estimator.step({{0.2}}).value, 0.2);
  for (int n = 0; n < 10; ++n)
    EXPECT_EQ(estimator.step({{-0.9}}).fault, Fault::outside_training_range);
  EXPECT_EQ(estimator.step({{-0.9}}).fault, Fault::recovering);
  double sum = 0.2 - 0.9;
  Estimate last;
  for (int n = 1; n < 16; ++n) {
    last = estimator.step({{-0.9 + 0.1 * n}});
    sum += -0.9 + 0.1 * n;
  }
  EXPECT_EQ(last.fault, Fault::none) << "the travel erases what was missed";
  EXPECT_NEAR(last.value, sum, 1e-12);
  EXPECT_NEAR(last.std_dev, 7.0 * 1.1, 0.01) << "one of the two levels is wrong";
}

TEST(Estimator, AnotherZeroInTheRunIsAJump) {
  BasicEstimator<Summing> estimator(with_steps(0.1), Summing(Scripted::Parameters{}));
  estimator.set_zero("gear_angle_rad", 0.0);
  ASSERT_EQ(estimator.step({{0.2}}).fault, Fault::none);
  estimator.set_zero("gear_angle_rad", 0.0);
  EXPECT_EQ(estimator.step({{0.2}}).fault, Fault::none) << "the same zero";
  estimator.set_zero("gear_angle_rad", 0.5);
  EXPECT_EQ(estimator.step({{0.2}}).fault, Fault::recovering);
}

TEST(Estimator, MissingTicksAreInterpolatedForAMemory) {
  BasicEstimator<Summing> estimator(with_steps(0.1), Summing(Scripted::Parameters{}));
  estimator.step({{0.0}});
  for (int n = 0; n < 4; ++n) estimator.step({{kNaN}});
  const Estimate after = estimator.step({{0.5}});
  EXPECT_EQ(after.fault, Fault::none);
  EXPECT_NEAR(after.value, 0.1 + 0.2 + 0.3 + 0.4 + 0.5, 1e-12);
  estimator.miss(2.0);
  EXPECT_NEAR(estimator.step({{0.2}}).value, 1.5 + 0.4 + 0.3 + 0.2, 1e-12) << "a late tick";
}

TEST(Estimator, AContinuousExcursionEntersTheMemoryOnlyUpToTheBorder) {
  BasicEstimator<Summing> estimator(with_steps(0.5), Summing(Scripted::Parameters{}));
  estimator.step({{0.9}});
  const Estimate outside = estimator.step({{1.5}});
  EXPECT_EQ(outside.fault, Fault::outside_training_range);
  EXPECT_DOUBLE_EQ(outside.value, 0.5 + 7.0 * 1.5);
  const Estimate back = estimator.step({{1.0}});
  EXPECT_EQ(back.fault, Fault::recovering) << "0.4 beyond the border";
  double sum = 0.9 + 1.1 + 1.0;
  Estimate inside;
  for (int n = 1; n < 18; ++n) {
    inside = estimator.step({{1.0 - 0.1 * n}});
    sum += 1.0 - 0.1 * n;
  }
  EXPECT_EQ(inside.fault, Fault::none);
  EXPECT_NEAR(inside.value, sum, 1e-5);
  EXPECT_NEAR(inside.std_dev, 0.1, 1e-6);
}

TEST(Estimator, AModelWithoutDeclaredMemoryIsResetAndWarmsUpAfterAJump) {
  struct Hidden : Summing {
    using Summing::Summing;
    [[nodiscard]] static ModelMemory memory(const InputRanges& /*ranges*/) {
      return {.is_declared = false};
    }
  };
  EstimatorSettings guarded = with_steps(0.1);
  guarded.disturbances.warm_up_s = 0.003;
  BasicEstimator<Hidden> estimator(guarded, Hidden(Scripted::Parameters{}));
  estimator.step({{0.25}});
  for (int n = 0; n < 10; ++n) estimator.step({{0.9}});
  int ticks = 0;
  Estimate now{.fault = Fault::recovering};
  while (now.fault == Fault::recovering && ticks < 10) {
    now = estimator.step({{0.9}});
    ++ticks;
  }
  EXPECT_EQ(now.fault, Fault::none);
  EXPECT_GE(ticks, 3);
  EXPECT_NEAR(now.value, 0.9 * ticks, 1e-12) << "it was reset";
  guarded.disturbances.warm_up_s = kNaN;
  BasicEstimator<Hidden> unknown(guarded, Hidden(Scripted::Parameters{}));
  unknown.step({{0.25}});
  for (int n = 0; n < 100000; ++n) unknown.step({{0.9}});
  EXPECT_EQ(unknown.step({{0.9}}).fault, Fault::recovering);
  unknown.reset();
  EXPECT_EQ(unknown.step({{0.25}}).fault, Fault::none);
}

TEST(Estimator, AShortGapAllowsALargerStep) {
  BasicEstimator<Summing> estimator(with_steps(0.1), Summing(Scripted::Parameters{}));
  estimator.step({{0.0}});
  for (int i = 0; i < 3; ++i) estimator.step({{kNaN}});
  EXPECT_EQ(estimator.step({{0.7}}).fault, Fault::none) << "0.2 in each of four periods";
  EXPECT_EQ(estimator.step({{0.0}}).fault, Fault::outside_training_range);
}

TEST(Estimator, RefusesDisturbanceGuardsThatDoNotFit) {
  EstimatorSettings bad = scripted_settings();
  bad.disturbances.largest_step = {0.1, 0.2};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.disturbances.largest_step"));
  bad.disturbances.largest_step = {-0.1};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.disturbances.largest_step[0]"));
  bad.disturbances = {.largest_step = {}, .warm_up_s = -1.0};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.disturbances.warm_up_s"));
}

TEST(Estimator, ReturnsTheFallbackWhenTheModelFails) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    ScriptedEstimator estimator = with_output({.value = bad, .std_dev = 0.1});
    const Estimate estimate = step(estimator, 0.5);
    EXPECT_EQ(estimate.fault, Fault::model_not_finite);
    EXPECT_EQ(estimate.value, 4.0);
    EXPECT_EQ(estimate.std_dev, 3.0);
    EXPECT_EQ(estimator.model().ticks(), 0) << "a memory full of NaN is emptied";
  }
}

TEST(Estimator, PassesOnTheFaultOfTheModel) {
  ScriptedEstimator estimator =
      with_output({.value = 1.0, .novelty = 9.0, .fault = Fault::outside_training_range});
  const Estimate estimate = step(estimator, 0.5);
  EXPECT_EQ(estimate.fault, Fault::outside_training_range);
  EXPECT_EQ(estimate.value, 4.0);
  EXPECT_EQ(estimate.novelty, 9.0);
}

TEST(Estimator, TakesTheErrorBarFromTheResidualsOfTheNearestRegion) {
  EstimatorSettings with_table = scripted_settings();
  with_table.residuals = {.edges = {-5.0, 0.0, 5.0}, .std_dev = {1.0, 2.0}};
  ScriptedEstimator estimator(with_table, Scripted({}));
  EXPECT_EQ(step(estimator, -1.0).std_dev, 1.0);
  EXPECT_EQ(step(estimator, -0.1).std_dev, 1.0);
  EXPECT_EQ(step(estimator, 0.0).std_dev, 2.0);
  EXPECT_EQ(step(estimator, 1.0).std_dev, 2.0);
}

TEST(Estimator, NeverReturnsAnErrorBarOfZero) {
  EstimatorSettings zeros = scripted_settings();
  zeros.residuals = {.edges = {0.0, 1.0}, .std_dev = {0.0}};
  zeros.fallback.residual_std = 0.0;
  ScriptedEstimator sure(zeros,
                         Scripted({.output = {.value = 1.0, .std_dev = 0.0}, .is_fixed = true}));
  EXPECT_TRUE(std::isnan(step(sure, 0.5).std_dev));
  ScriptedEstimator failing(zeros, Scripted({.output = {.value = kNaN}, .is_fixed = true}));
  EXPECT_TRUE(std::isnan(step(failing, 0.5).std_dev));
  ScriptedEstimator own = with_output({.value = 1.0, .std_dev = 0.25});
  EXPECT_EQ(step(own, 0.5).std_dev, 0.25) << "the model's own comes first";
}

TEST(Estimator, HoldsTheLastValueWhenTheFallbackOverflows) {
  EstimatorSettings steep = scripted_settings();
  steep.fallback.slope = {1e308};
  ScriptedEstimator estimator(steep, Scripted({}));
  step(estimator, 0.5);
  const Estimate estimate = step(estimator, 1e10);
  EXPECT_EQ(estimate.fault, Fault::outside_training_range);
  EXPECT_EQ(estimate.value, 5.0);
}

RC_GTEST_PROP(Estimator, ItsValueIsFiniteForAnyBits, (const std::vector<std::uint64_t>& bits)) {
  ScriptedEstimator estimator(scripted_settings("lowpass(rate(gear_angle_rad), 50Hz)"),
                              Scripted({}));
  for (const std::uint64_t pattern : bits)
    RC_ASSERT(std::isfinite(step(estimator, std::bit_cast<double>(pattern)).value));
}

TEST(Estimator, RepeatsItsRunAfterReset) {
  ScriptedEstimator estimator(scripted_settings("lowpass(gear_angle_rad, 20Hz)"), Scripted({}));
  const auto run = [&] {
    std::vector<double> values;
    for (int i = 0; i < 300; ++i) {
      const double raw = i % 70 == 69 ? kNaN : std::sin(0.05 * i);
      values.push_back(step(estimator, raw).value);
    }
    return values;
  };
  const auto first = run();
  estimator.reset();
  EXPECT_EQ(run(), first);
}

TEST(Estimator, CopiesShareNoState) {
  ScriptedEstimator one(scripted_settings("lag(gear_angle_rad, 1)"), Scripted({}));
  step(one, 0.5);
  ScriptedEstimator other = one;
  step(one, 0.7);
  EXPECT_EQ(step(one, 0.0).value, 7.0);
  EXPECT_EQ(step(other, 0.0).value, 5.0);
}

TEST(Estimator, SubtractsAZero) {
  ScriptedEstimator estimator(scripted_settings(), Scripted({}));
  estimator.set_zero("gear_angle_rad", 0.2);
  EXPECT_DOUBLE_EQ(step(estimator, 0.5).value, 3.0);
  EXPECT_THROW(estimator.set_zero("gear_angle_rad", kNaN), UsageError);
  EXPECT_THROW(estimator.set_zero("elbow_rad", 0.0), UsageError);
}

/// Trained on records whose zero was taken from each.
EstimatorSettings zeroed_settings(const std::string& input = "gear_angle_rad") {
  EstimatorSettings zeroed = scripted_settings(input);
  zeroed.zeroed_channels = {"gear_angle_rad"};
  zeroed.residuals = {.edges = {-10.0, 10.0}, .std_dev = {1.0}};
  return zeroed;
}

TEST(Estimator, IsNotToBeUsedBeforeItsZeroIsSet) {
  ScriptedEstimator estimator(zeroed_settings(), Scripted({}));
  EXPECT_THAT(estimator.unset_zeros(), testing::ElementsAre("gear_angle_rad"));
  for (int i = 0; i < 3; ++i) {
    const Estimate estimate = step(estimator, 0.5);
    EXPECT_EQ(estimate.fault, Fault::zero_not_set);
    EXPECT_EQ(estimate.value, 5.0);
    EXPECT_TRUE(std::isnan(estimate.std_dev)) << "off by an unknown amount";
  }
  estimator.set_zero("gear_angle_rad", 0.2);
  EXPECT_THAT(estimator.unset_zeros(), testing::IsEmpty());
  const Estimate estimate = step(estimator, 0.5);
  EXPECT_EQ(estimate.fault, Fault::none);
  EXPECT_DOUBLE_EQ(estimate.value, 3.0);
  EXPECT_EQ(estimate.std_dev, 1.0);
}

TEST(Estimator, RequiresEveryZeroThatTrainingTook) {
  EstimatorSettings two = zeroed_settings("gear_angle_rad - joint_angle_rad");
  two.zeroed_channels = {"gear_angle_rad", "joint_angle_rad"};
  ScriptedEstimator estimator(two, Scripted({}));
  estimator.set_zero("joint_angle_rad", 0.0);
  EXPECT_EQ(estimator.step(std::array{0.2, 0.1}).fault, Fault::zero_not_set);
  EXPECT_THROW(estimator.set_zero("gear_angle_rad", kNaN), UsageError);
  EXPECT_EQ(estimator.step(std::array{0.2, 0.1}).fault, Fault::zero_not_set);
  estimator.set_zero("gear_angle_rad", 0.0);
  EXPECT_EQ(estimator.step(std::array{0.2, 0.1}).fault, Fault::none);
}

TEST(Estimator, KeepsItsZeroOverAReset) {
  ScriptedEstimator estimator(zeroed_settings(), Scripted({}));
  estimator.reset();
  EXPECT_EQ(step(estimator, 0.5).fault, Fault::zero_not_set);
  estimator.set_zero("gear_angle_rad", 0.2);
  estimator.reset();
  EXPECT_EQ(step(estimator, 0.5).fault, Fault::none);
  EXPECT_DOUBLE_EQ(step(estimator, 0.5).value, 3.0);
}

TEST(Estimator, ReportsAMissingZeroAfterTheInputsAndBeforeTheWarmUpAndTheRange) {
  ScriptedEstimator estimator(zeroed_settings("lag(gear_angle_rad, 1)"), Scripted({}));
  EXPECT_EQ(step(estimator, kNaN).fault, Fault::input_not_finite);
  EXPECT_EQ(step(estimator, 5.0).fault, Fault::zero_not_set) << "the filters have not settled";
  const Estimate outside = step(estimator, 5.0);
  EXPECT_EQ(outside.fault, Fault::zero_not_set);
  EXPECT_EQ(outside.value, 35.5) << "the fallback's, as it would be with a zero";
  ScriptedEstimator failing(zeroed_settings(),
                            Scripted({.output = {.value = kNaN}, .is_fixed = true}));
  EXPECT_EQ(step(failing, 0.5).fault, Fault::zero_not_set);
  EXPECT_EQ(step(failing, 0.5).value, 4.0);
}

TEST(Estimator, RefusesSettingsThatDoNotFitTheModel) {
  EXPECT_THAT(
      refusal(scripted_settings(), 2),
      HasSubstr("inputs: expected 2, as many as the model takes, found 1 (gear_angle_rad)"));
  EstimatorSettings bad = scripted_settings();
  bad.ranges.lowest = {};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.ranges.lowest: expected 1 values, found 0"));
  bad = scripted_settings();
  bad.fallback.slope = {1.0, 2.0};
  EXPECT_THAT(refusal(bad), HasSubstr("fallback.slope: expected 1 values, found 2"));
  bad = scripted_settings();
  bad.target = "torque";
  EXPECT_THAT(refusal(bad), HasSubstr("target: expected a channel name that ends in its unit"));
  bad = scripted_settings();
  bad.residuals = {.edges = {0.0, 1.0}, .std_dev = {1.0, 2.0}};
  EXPECT_THAT(refusal(bad), HasSubstr("residuals.edges: expected 3 values, found 2"));
  bad = scripted_settings();
  bad.zeroed_channels = {"joint_angle_rad"};
  EXPECT_THAT(
      refusal(bad),
      HasSubstr("zeroed_channels: expected some of gear_angle_rad, found 'joint_angle_rad'"));
}

TEST(Estimator, RefusesGuardsThatWouldLetEverythingThrough) {
  EstimatorSettings bad = scripted_settings();
  bad.ranges.lowest = {kNaN};
  EXPECT_THAT(refusal(bad),
              HasSubstr("guards.ranges.lowest[0]: expected a finite number, found nan"));
  bad = scripted_settings();
  bad.ranges.highest = {kInfinity};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.ranges.highest[0]: expected a finite number"));
  bad = scripted_settings();
  bad.ranges = {.lowest = {-1e308}, .highest = {1e308}, .margin = 1.0};
  EXPECT_THAT(refusal(bad), HasSubstr("guards.ranges with margin[0]: expected a finite number"));
  bad = scripted_settings();
  bad.ranges.margin = kNaN;
  EXPECT_THAT(refusal(bad),
              HasSubstr("guards.ranges.margin: expected a finite number, at least 0"));
  bad = scripted_settings();
  std::swap(bad.ranges.lowest, bad.ranges.highest);
  EXPECT_THAT(refusal(bad),
              HasSubstr("guards.ranges of gear_angle_rad: expected lowest <= highest"));
}

TEST(Estimator, RefusesNumbersThatAreNotFinite) {
  EstimatorSettings bad = scripted_settings();
  bad.fallback.slope = {kInfinity};
  EXPECT_THAT(refusal(bad), HasSubstr("fallback.slope[0]: expected a finite number, found inf"));
  bad = scripted_settings();
  bad.fallback.residual_std = -1.0;
  EXPECT_THAT(refusal(bad), HasSubstr("fallback.residual_std: expected a number, at least 0"));
  bad = scripted_settings();
  bad.residuals = {.edges = {0.0, 0.0}, .std_dev = {1.0}};
  EXPECT_THAT(refusal(bad), HasSubstr("residuals.edges: expected ascending numbers"));
  bad.residuals = {.edges = {0.0, 1.0}, .std_dev = {kInfinity}};
  EXPECT_THAT(refusal(bad), HasSubstr("residuals.std_dev[0]: expected a number, at least 0"));
  bad = scripted_settings();
  bad.sample_rate_Hz = kNaN;
  EXPECT_NE(refusal(bad), "");
}

}  // namespace
}  // namespace torsio
