#include "fit/narx/fit_narx.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "fit/common/fitted.hpp"
#include "fit/common/model_run.hpp"
#include "model/linear/linear.hpp"
#include "model/narx/narx.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// y_k = 0.3 u_k + 0.2 u_{k-1} + 1.6 y_{k-1} - 0.7 y_{k-2}, and noise on what is measured of it.
TrainingData second_order(std::size_t samples, double noise, std::uint64_t seed) {
  Random random(seed);
  TrainingData data{.inputs = {{"u_1"}}, .target = "y_1", .sample_rate_Hz = 50.0, .sequences = {}};
  Sequence sequence{.recording = "a",
                    .features = Matrix(samples, 1),
                    .target = std::vector<double>(samples),
                    .use = std::vector<std::uint8_t>(samples, 1)};
  std::vector<double> y(samples, 0.0);
  double u = 0.0;
  for (std::size_t n = 0; n < samples; ++n) {
    u = 0.9 * u + random.normal();
    sequence.features(n, 0) = u;
    if (n >= 2)
      y[n] = 0.3 * u + 0.2 * sequence.features(n - 1, 0) + 1.6 * y[n - 1] - 0.7 * y[n - 2];
    sequence.target[n] = y[n] + noise * random.normal();
  }
  data.sequences.push_back(std::move(sequence));
  return data;
}

const ArxOptions kTrueOrder{.lags = {.inputs = 1, .outputs = 2}};

TEST(FitArx, FindsTheDifferenceEquationWithoutNoise) {
  const auto fitted = fit_arx(second_order(400, 0.0, 1), kTrueOrder);
  const std::vector<double> expected{0.0, 0.3, 0.2, 1.6, -0.7};
  const auto& found = fitted.parameters.model.coefficients.values.values;
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t j = 0; j < expected.size(); ++j) EXPECT_NEAR(found[j], expected[j], 1e-9) << j;
}

TEST(FitArx, IsBiasedByNoiseUntilItIsRefined) {
  const TrainingData data = second_order(4000, 0.5, 2);
  auto plain = kTrueOrder;
  plain.is_refined = false;
  const auto error_of = [](const Fitted<Narx<Linear>>& fitted) {
    return std::abs(fitted.parameters.model.coefficients.values.values[3] - 1.6);
  };
  EXPECT_GT(error_of(fit_arx(data, plain)), 0.1);
  EXPECT_LT(error_of(fit_arx(data, kTrueOrder)), 0.02);
}

TEST(FitArx, RefinesAcrossAGapInTheTarget) {
  TrainingData data = second_order(3000, 0.2, 3);
  Sequence& sequence = data.sequences.front();
  for (std::size_t n = 1000; n < 1200; ++n) {
    sequence.target[n] = std::numeric_limits<double>::quiet_NaN();
    sequence.use[n] = 0;
  }
  EXPECT_NEAR(fit_arx(data, kTrueOrder).parameters.model.coefficients.values.values[3], 1.6, 0.03);
}

TEST(NarxData, CombinesInputsTheirLagsAndPastOutputs) {
  TrainingData data = second_order(10, 0.0, 1);
  data.sequences[0].target[5] = std::numeric_limits<double>::quiet_NaN();
  data.sequences[0].use[5] = 0;
  const TrainingData made = narx_data(data, {.inputs = 1, .outputs = 2});
  ASSERT_EQ(made.input_count(), 4U);
  EXPECT_EQ(made.inputs[1].expression, "lag(u_1, 1)");
  EXPECT_EQ(made.inputs[3].expression, "lag(y_1, 2)");
  const Sequence& from = data.sequences[0];
  const Sequence& to = made.sequences[0];
  EXPECT_EQ(to.use, (std::vector<std::uint8_t>{0, 0, 1, 1, 1, 0, 0, 0, 1, 1}));
  EXPECT_EQ(to.features(4, 0), from.features(4, 0));
  EXPECT_EQ(to.features(4, 1), from.features(3, 0));
  EXPECT_EQ(to.features(4, 2), from.target[3]);
  EXPECT_EQ(to.features(4, 3), from.target[2]);
  EXPECT_THAT(test::error_message([&] { (void)narx_data(data, {.inputs = 20, .outputs = 1}); }),
              HasSubstr("longer than the lags of 20 samples"));
  EXPECT_THROW((void)narx_data(data, {.inputs = 0, .outputs = 0}), UsageError);
}

FittedModel fit_named(const char* family, const TrainingData& data,
                      const std::map<std::string, std::string>& options, std::uint64_t seed = 1) {
  const FamilyInfo& info = find_family(family);
  return info.fit(data, Options(info.options, options), {.seed = seed});
}

TEST(FitNarx, RoundsOfFreeRunNeverEndWorseInFreeRunThanOneStepAhead) {
  const TrainingData data = second_order(2000, 0.5, 4);
  const auto rmse = [&](const char* training) {
    return evaluate(fit_named("narx_mlp", data,
                              {{"training", training}, {"layers", "8"}, {"epochs", "10"}})
                        .model,
                    data)
        .rmse;
  };
  EXPECT_LE(rmse("free_run"), 1.001 * rmse("one_step"));
}

TEST(FitNarx, NoiseIsOfTheSeed) {
  const TrainingData data = second_order(600, 0.1, 5);
  const std::map<std::string, std::string> noise{
      {"training", "noise"}, {"components", "20"}, {"feedback_noise", "0.1"}};
  const auto fit = [&](std::uint64_t seed) {
    return evaluate(fit_named("narx_dgmm", data, noise, seed).model, data).rmse;
  };
  EXPECT_EQ(fit(1), fit(1));
  EXPECT_NE(fit(1), fit(2));
}

TEST(FitNarx, FindsTheDifferenceEquationAsAVariationalGaussianProcess) {
  const TrainingData data = second_order(1000, 0.02, 6);
  const FittedModel fitted = fit_named("narx_parametric_gp_variational", data,
                                       {{"kernel", "linear_ard"},
                                        {"inducing_points", "10"},
                                        {"input_lags", "1"},
                                        {"training", "one_step"}});
  EXPECT_EQ(fitted.model.family(), "narx_parametric_gp");
  EXPECT_GT(evaluate(fitted.model, second_order(1000, 0.0, 7)).fit_percent, 95.0);
}

TEST(FitNarx, RefusesWhatItCannotDo) {
  const TrainingData data = second_order(600, 0.1, 5);
  EXPECT_THROW((void)fit_named("narx_mlp", data, {{"training", "daily"}}), UsageError);
  EXPECT_THROW((void)fit_named("narx_mlp", data, {{"members", "3"}, {"epochs", "1"}}), UsageError);
  TrainingData constant = data;
  for (double& value : constant.sequences[0].target) value = 1.0;
  EXPECT_THROW((void)fit_named("arx", constant, {}), Error);
  const TrainingData brief = second_order(40, 0.1, 5);
  for (const char* family : {"arx", "narx_dgmm", "narx_polynomial"})
    EXPECT_THAT(test::error_message([&] { (void)fit_named(family, brief, {}); }),
                HasSubstr("too short to evaluate a free run"))
        << family;
}

}  // namespace
}  // namespace torsio
