#include "torsio/evaluate/attribution.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "evaluate/shapley.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/polynomial.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "support/fitted_families.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

constexpr double kBias = 2.0;
constexpr std::array kSlopes{600.0, -3.0, 0.0};

/// y = 2 + 600 x_0 - 3 x_1 + 0 x_2
Linear spring() {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 4);
  parameters.coefficients.values.values = {kBias, kSlopes[0], kSlopes[1], kSlopes[2]};
  return Linear(parameters);
}

/// Curves 1 + 5 u -+ 2 for the two directions of x_0, u = x_0 / 0.1, and 4 x_1.
Polynomial hysteresis() {
  Polynomial::Parameters parameters;
  parameters.degree = 1;
  parameters.by_direction = true;
  parameters.dead_band = 0.004;
  parameters.half_range = 0.1;
  parameters.coefficients.values = Matrix(1, 6);
  parameters.coefficients.values.values = {-1.0, 5.0, 3.0, 5.0, 0.0, 4.0};
  return Polynomial(parameters);
}

/// A winding spring, its rate, and noise that nothing depends on.
TrainingData spring_data(std::size_t samples = 3000) {
  const Matrix two = test::oscillation(samples);
  Random random(4);
  Matrix features(samples, 3);
  for (std::size_t n = 0; n < samples; ++n) {
    features(n, 0) = two(n, 0);
    features(n, 1) = two(n, 1);
    features(n, 2) = random.normal();
  }
  return test::training_data_of({{.expression = "deflection"},
                                 {.expression = "rate", .is_rate = true},
                                 {.expression = "x_1"}},
                                std::move(features), [](std::span<const double> x) {
                                  return kBias + kSlopes[0] * x[0] + kSlopes[1] * x[1];
                                });
}

double mean_of_input(const TrainingData& data, std::size_t input) {
  const Matrix& features = data.sequences.front().features;
  double sum = 0.0;
  for (std::size_t n = 0; n < features.rows; ++n) sum += features(n, input);
  return sum / static_cast<double>(features.rows);
}

TEST(ShapleyValues, ShareAGameOfGlovesAsTextbooksDo) {
  // Players 0 and 1 hold a left glove each, player 2 a right one; a pair is worth 1.
  const std::vector<double> pairs{0, 0, 0, 0, 0, 1, 1, 1};
  const std::vector<double> shapley = shapley_values(pairs);
  EXPECT_NEAR(shapley[0], 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(shapley[1], 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(shapley[2], 4.0 / 6.0, 1e-15);
}

TEST(ShapleyValues, AddUpShareEquallyAndGiveADummyNothing) {
  constexpr std::size_t kPlayers = 5;
  Random random(11);
  std::vector<double> values(std::size_t{1} << kPlayers);
  for (std::size_t s = 0; s < values.size(); ++s) {
    const std::size_t swapped = (s & ~std::size_t{3}) | (s & 1U) << 1U | (s >> 1U & 1U);
    // Players 0 and 1 may be swapped; player 4 changes nothing.
    values[s] = swapped < s           ? values[swapped]
                : (s >> 4U & 1U) != 0 ? values[s & 15U]
                                      : random.normal();
  }
  const std::vector<double> shapley = shapley_values(values);
  EXPECT_NEAR(shapley[0], shapley[1], 1e-15);
  EXPECT_EQ(shapley[4], 0.0);
  EXPECT_NEAR(std::accumulate(shapley.begin(), shapley.end(), 0.0), values.back() - values.front(),
              1e-14);
  EXPECT_THROW((void)shapley_values(std::vector<double>(6)), Error);
}

TEST(ShapleyValues, HalveAnInteraction) {
  // v(S) = mean of x y over what is absent; x = 3, y = 5, their means 1 and 2, mean of products 4.
  const std::vector<double> shapley = shapley_values(std::vector<double>{4, 3 * 2, 1 * 5, 3 * 5});
  EXPECT_DOUBLE_EQ(shapley[0], 0.5 * ((6.0 - 4.0) + (15.0 - 5.0)));
  EXPECT_DOUBLE_EQ(shapley[1], 0.5 * ((5.0 - 4.0) + (15.0 - 6.0)));
}

TEST(Attribute, OfALinearModelIsSlopeTimesDistanceFromTheMean) {
  const TrainingData data = spring_data();
  // A background of all samples has the means of the data.
  const Attribution attribution = attribute(spring(), data, {.windows = 50, .background = 100000});
  EXPECT_EQ(attribution.window_samples, 1U);
  EXPECT_TRUE(attribution.window_is_long_enough);
  EXPECT_EQ(attribution.background, 3000U);
  ASSERT_EQ(attribution.explained.size(), 50U);
  for (const ExplainedWindow& window : attribution.explained) {
    const std::span<const double> x = data.sequences.front().features.row(window.sample);
    for (std::size_t j = 0; j < 3; ++j)
      EXPECT_NEAR(window.shapley[j], kSlopes[j] * (x[j] - mean_of_input(data, j)), 1e-10);
    EXPECT_EQ(window.shapley[2], 0.0);
  }
  EXPECT_LT(attribution.additivity_error, 1e-10);
  double shares = 0.0;
  for (const InputAttribution& input : attribution.inputs) shares += input.share;
  EXPECT_NEAR(shares, 1.0, 1e-12);
}

TEST(Attribute, GivesEqualInputsEqualSharesAndADummyNone) {
  TrainingData data = spring_data();
  Matrix& features = data.sequences.front().features;
  for (std::size_t n = 0; n < features.rows; ++n) features(n, 1) = features(n, 0);
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 4);
  parameters.coefficients.values.values = {0.0, 7.0, 7.0, 0.0};
  const Attribution attribution = attribute(Linear(parameters), data);
  EXPECT_NEAR(attribution.inputs[0].share, 0.5, 1e-12);
  EXPECT_NEAR(attribution.inputs[1].share, 0.5, 1e-12);
  EXPECT_EQ(attribution.inputs[2].mean_abs_shapley, 0.0);
  EXPECT_EQ(attribution.inputs[2].rmse_increase, 0.0);
}

TEST(Attribute, ReplacesWholeWindowsOfAModelWithMemory) {
  TrainingData data = test::noisy_spring(1500);
  const Memory memory = memory_samples(hysteresis(), data, 1);
  EXPECT_GT(memory.samples, 4U);
  EXPECT_FALSE(memory.is_longer);
  const Attribution attribution =
      attribute(hysteresis(), data, {.windows = 20, .background = 100000});
  ASSERT_EQ(attribution.window_samples, memory.samples);
  const std::size_t length = memory.samples;
  const Matrix& x = data.sequences.front().features;
  // The model is a sum of a part with memory of x_0 and of 4 x_1, so that each is its own share.
  const auto curve_at = [&](std::size_t end) {
    Polynomial model = hysteresis();
    double value = 0.0;
    for (std::size_t n = end + 1 - length; n <= end; ++n)
      value = model.step(std::array{x(n, 0), 0.0}).value;
    return value;
  };
  double mean_curve = 0.0;
  double mean_rate = 0.0;
  const auto ends = static_cast<double>(x.rows + 1 - length);
  for (std::size_t end = length - 1; end < x.rows; ++end) {
    mean_curve += curve_at(end) / ends;
    mean_rate += x(end, 1) / ends;
  }
  for (const ExplainedWindow& window : attribution.explained) {
    EXPECT_NEAR(window.shapley[0], curve_at(window.sample) - mean_curve, 1e-10);
    EXPECT_NEAR(window.shapley[1], 4.0 * (x(window.sample, 1) - mean_rate), 1e-10);
  }
}

TEST(Attribute, ShufflesWhatTheModelNeeds) {
  const TrainingData data = spring_data();
  const Attribution attribution = attribute(spring(), data, {.repeats = 4});
  EXPECT_LT(attribution.rmse, 1e-10) << "the model is the truth";
  EXPECT_EQ(attribution.block_samples, 150U) << "20 blocks of 3000 samples";
  EXPECT_GT(attribution.inputs[0].rmse_increase, 10.0);
  EXPECT_GT(attribution.inputs[0].rmse_increase, attribution.inputs[1].rmse_increase);
  EXPECT_GT(attribution.inputs[1].rmse_increase, 0.1);
  EXPECT_EQ(attribution.inputs[2].rmse_increase, 0.0);
  EXPECT_GT(attribution.inputs[0].rmse_increase_std, 0.0);
}

TEST(Attribute, DependsOnTheSeedButNotOnTheThreads) {
  const TrainingData data = test::noisy_spring(1500);
  const auto values = [&](std::uint64_t seed, std::size_t threads) {
    const Attribution attribution =
        attribute(hysteresis(), data, {.windows = 30, .seed = seed, .threads = threads});
    std::vector<double> all{attribution.expected_value, attribution.rmse};
    for (const InputAttribution& input : attribution.inputs)
      all.insert(all.end(), {input.mean_abs_shapley, input.rmse_increase, input.rmse_increase_std});
    return all;
  };
  EXPECT_EQ(values(1, 1), values(1, 3));
  EXPECT_NE(values(1, 1), values(2, 1));
}

class AttributeEveryFamily : public testing::TestWithParam<std::string> {};

TEST_P(AttributeEveryFamily, FindsThatItIsASpring) {
  const TrainingData data = test::noisy_spring();
  const FamilyInfo& family = find_family(GetParam());
  const Options options(family.options, test::quick_options(family.name));
  const AnyModel model = family.fit(data, options, {.seed = 1}).model;
  const Attribution attribution = attribute(model, data, {.windows = 20, .background = 10});
  EXPECT_LT(attribution.additivity_error, 1e-9);
  EXPECT_GT(attribution.inputs[0].share, 0.5);
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, AttributeEveryFamily,
                         testing::ValuesIn(test::spring_families()), test::kFamilyName);

TEST(Attribute, PassesOverFeaturesThatAreNotFinite) {
  TrainingData data = spring_data();
  Sequence& sequence = data.sequences.front();
  for (std::size_t n = 0; n < 3000; n += 7) {
    sequence.features(n, 1) = std::numeric_limits<double>::quiet_NaN();
    sequence.use[n] = 0;
  }
  const Attribution attribution = attribute(spring(), data, {.windows = 40});
  for (const ExplainedWindow& window : attribution.explained)
    EXPECT_TRUE(std::isfinite(window.shapley[1]));
  EXPECT_TRUE(std::isfinite(attribution.inputs[1].rmse_increase));
}

TEST(Attribute, RefusesWhatItCannotDo) {
  const TrainingData data = spring_data(200);
  EXPECT_THROW((void)attribute(spring(), data, {.windows = 0}), UsageError);
  EXPECT_THROW((void)attribute(hysteresis(), data), Error) << "two inputs, not three";
  EXPECT_NE(test::error_message([&] {
              (void)attribute(spring(), data, {.window_samples = 201});
            }).find("no recording contains a window of 201 samples"),
            std::string::npos);
  EXPECT_THROW((void)attribute(spring(), data, {}, [](double, std::string_view) { return false; }),
               Cancelled);
  TrainingData unmeasured = data;
  for (double& target : unmeasured.sequences.front().target) target = std::nan("");
  unmeasured.sequences.front().use.assign(200, 0);
  EXPECT_THROW((void)attribute(spring(), unmeasured), Error);

  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 14);
  parameters.coefficients.values.values.assign(14, 1.0);
  TrainingData wide = test::training_data_of(std::vector<InputInfo>(13, {.expression = "x_1"}),
                                             Matrix(100, 13), [](auto) { return 0.0; });
  EXPECT_NE(
      test::error_message([&] { (void)attribute(Linear(parameters), wide); }).find("at most 12"),
      std::string::npos);
}

TEST(Memory, IsOneSampleWhereThereIsNone) {
  EXPECT_EQ(memory_samples(spring(), spring_data(), 1).samples, 1U);
}

TEST(Memory, IsLongerThanTheRecordIfNothingEndsIt) {
  // The first input creeps and never turns, so that its direction stays as it was long ago.
  TrainingData data = test::noisy_spring(400);
  for (std::size_t n = 0; n < 400; ++n)
    data.sequences.front().features(n, 0) = n < 100 ? 1e-3 * static_cast<double>(100 - n) : 0.0;
  const Memory memory = memory_samples(hysteresis(), data, 1);
  EXPECT_TRUE(memory.is_longer);
  const Attribution attribution = attribute(hysteresis(), data, {.windows = 5, .background = 5});
  EXPECT_FALSE(attribution.window_is_long_enough);
}

}  // namespace
}  // namespace torsio
