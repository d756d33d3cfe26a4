#include "fit/common/guards.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/linear/fit_linear.hpp"
#include "support/example_data.hpp"

namespace torsio {
namespace {

using test::deflection_and_rate;
using test::oscillation;
using test::training_data_of;

using Row = std::span<const double>;

TEST(Guards, RangesAreThoseOfUsableSamples) {
  Matrix features(4, 2);
  features.values = {1.0, -5.0, 2.0, 7.0, 99.0, -99.0, 0.0, 6.0};
  auto data = training_data_of(deflection_and_rate(), features, [](Row) { return 0.0; });
  data.sequences[0].use[2] = 0;
  const FeatureRanges ranges = feature_ranges(data);
  EXPECT_EQ(ranges.lowest, (std::vector{0.0, -5.0}));
  EXPECT_EQ(ranges.highest, (std::vector{2.0, 7.0}));
}

TEST(Guards, TheFallbackIsLeastSquaresOnAllInputsThatAreNoRates) {
  Random random(5);
  const std::vector<InputInfo> inputs = {{.expression = "x"}, {.expression = "y"}};
  const auto data = training_data_of(inputs, oscillation(4000), [&](Row x) {
    return 1.0 + 100.0 * x[0] + 2.0 * x[1] + 0.25 * random.normal();
  });
  const LinearFallback fallback = linear_fallback(data);
  EXPECT_NEAR(fallback.intercept, 1.0, 0.03);
  ASSERT_EQ(fallback.slope.size(), 2U);
  EXPECT_NEAR(fallback.slope[0], 100.0, 0.5);
  EXPECT_NEAR(fallback.slope[1], 2.0, 0.1);
  EXPECT_NEAR(fallback.residual_std, 0.25, 0.01);
}

TEST(Guards, TheFallbackLeavesRatesOut) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(4000),
                                     [](Row x) { return 1.0 + 100.0 * x[0] + 2.0 * x[1]; });
  const LinearFallback fallback = linear_fallback(data);
  EXPECT_EQ(fallback.slope[1], 0.0);
  EXPECT_NEAR(fallback.slope[0], 100.0, 5.0);
  EXPECT_GT(fallback.residual_std, 0.5) << "what the rate would have explained is spread";
}

TEST(Guards, TheFallbackIsTheMeanWhereEveryInputIsARate) {
  const auto data = training_data_of({{.expression = "rate(x)", .is_rate = true}},
                                     Matrix(100, 1, 3.0), [](Row) { return 4.0; });
  EXPECT_NEAR(linear_fallback(data).intercept, 4.0, 1e-12);
  EXPECT_EQ(linear_fallback(data).slope, std::vector{0.0});
}

AnyModel spring(double stiffness) {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 3);
  parameters.coefficients.values(0, 1) = stiffness;
  return Linear(parameters);
}

TEST(Guards, TheResidualTableContainsTheSpreadByRegionOfTheOutput) {
  Random random(6);
  const auto data = training_data_of(deflection_and_rate(), oscillation(8000), [&](Row x) {
    return 100.0 * x[0] + (x[0] > 0.0 ? 2.0 : 0.5) * random.normal();
  });
  const ResidualTable table = residual_table(spring(100.0), data);
  ASSERT_EQ(table.std_dev.size(), kMaxResidualRegions);
  ASSERT_EQ(table.edges.size(), table.std_dev.size() + 1);
  EXPECT_TRUE(std::ranges::is_sorted(table.edges));
  for (std::size_t i = 0; i < table.std_dev.size(); ++i) {
    const bool below = table.edges[i + 1] <= 0.0;
    if (!below && table.edges[i] < 0.0) continue;
    EXPECT_NEAR(table.std_dev[i], below ? 0.5 : 2.0, below ? 0.08 : 0.3) << "region " << i;
  }
}

TEST(Guards, ABiasCountsAsSpread) {
  const auto data = training_data_of(deflection_and_rate(), oscillation(1000),
                                     [](Row x) { return 100.0 * x[0] + 0.75; });
  for (const double each : residual_table(spring(100.0), data).std_dev)
    EXPECT_NEAR(each, 0.75, 1e-12);
}

TEST(Guards, TheResidualTableIsEmptyWithoutEvidenceAndNeverZero) {
  const auto target = [](Row x) { return 100.0 * x[0]; };
  const auto few = training_data_of(deflection_and_rate(), oscillation(49), target);
  EXPECT_TRUE(residual_table(spring(100.0), few).std_dev.empty());
  EXPECT_TRUE(residual_table(spring(100.0), few).edges.empty());
  const auto exact = training_data_of(deflection_and_rate(), oscillation(200), target);
  for (const double each : residual_table(spring(100.0), exact).std_dev) EXPECT_GT(each, 0.0);
}

TEST(Guards, RegionsNeverSplitEqualOutputs) {
  Matrix features(1000, 2);
  for (std::size_t n = 0; n < 1000; ++n) features(n, 0) = n < 700 ? 0.0 : 0.1;
  const auto data = training_data_of(deflection_and_rate(), features, [](Row) { return 0.0; });
  const ResidualTable table = residual_table(spring(100.0), data);
  EXPECT_EQ(table.edges, (std::vector{0.0, 5.0, 10.0}));
  EXPECT_EQ(table.std_dev.back(), 10.0);
  EXPECT_LT(table.std_dev.front(), 1e-9);
}

TEST(Guards, TheLargerOfTwoTablesIsThatAtEachValue) {
  const ResidualTable first{.edges = {-10.0, 0.0, 10.0}, .std_dev = {1.0, 3.0}};
  const ResidualTable second{.edges = {-2.0, 2.0, 4.0}, .std_dev = {2.0, 5.0}};
  const ResidualTable both = larger_of(first, second);
  EXPECT_EQ(both.edges, (std::vector{-10.0, -2.0, 0.0, 2.0, 4.0, 10.0}));
  EXPECT_EQ(both.std_dev, (std::vector{2.0, 2.0, 3.0, 5.0, 5.0}));
  EXPECT_EQ(larger_of(first, {}).std_dev, first.std_dev);
  EXPECT_EQ(larger_of({}, second).edges, second.edges);
}

TEST(Guards, FillTheSettingsAndPreferValidationData) {
  const TrainingData training = test::noisy_spring();
  TrainingData validation = training;
  for (double& target : validation.sequences[0].target) target += 5.0;
  const AnyModel model = Linear(fit_linear(training, {}).parameters);
  const FeatureSpec spec{.inputs = {"a", "b"}, .definitions = {}};
  const EstimatorSettings own = guarded_settings(spec, training, model);
  const EstimatorSettings other = guarded_settings(spec, training, model, &validation);
  EXPECT_EQ(own.features, spec);
  EXPECT_EQ(own.target, "torque_Nm");
  EXPECT_EQ(own.sample_rate_Hz, 1000.0);
  EXPECT_EQ(own.ranges.highest, feature_ranges(training).highest);
  EXPECT_EQ(own.fallback.slope, linear_fallback(training).slope);
  EXPECT_GT(std::ranges::min(other.residuals.std_dev), std::ranges::max(own.residuals.std_dev));
}

TEST(Guards, WidenErrorBarsFromTrainingToWhatTheFitHeldOut) {
  const TrainingData training = test::noisy_spring();
  const AnyModel model = Linear(fit_linear(training, {}).parameters);
  const FeatureSpec spec{.inputs = {"a", "b"}, .definitions = {}};
  const auto mean_square = [&](const TrainingData* validation, double held_out_rmse) {
    const ResidualTable table =
        guarded_settings(spec, training, model, validation, {.rmse = held_out_rmse}).residuals;
    double sum = 0.0;
    for (const double std_dev : table.std_dev) sum += std_dev * std_dev;
    return sum / static_cast<double>(table.std_dev.size());
  };
  const double own = mean_square(nullptr, kNotMeasured);
  const double wider = 3.0 * std::sqrt(own);
  EXPECT_NEAR(mean_square(nullptr, wider), 9.0 * own, 1e-9 * own);
  EXPECT_EQ(mean_square(nullptr, 0.1 * wider), own) << "never narrower";
  EXPECT_EQ(mean_square(&training, wider), own) << "validation records have priority";
}

}  // namespace
}  // namespace torsio
