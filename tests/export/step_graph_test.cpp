// What a graph computes, against torsio's own step, for each family of which there is one.

#include "torsio/export/step_graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "export/exported_families.hpp"
#include "export/graph_interpreter.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/estimator.hpp"

namespace torsio::test {
namespace {

/// A motion with excursions, which a simulator may have, but without gaps and jumps.
std::vector<std::vector<double>> smooth_motion(std::size_t ticks) {
  std::vector<std::vector<double>> raw;
  for (std::size_t n = 0; n < ticks; ++n) {
    const auto t = static_cast<double>(n);
    const std::size_t q = n % 4000;
    double gear_rad = 0.06 * std::sin(0.01 * t);
    const double joint_rad = 0.02 * std::sin(0.0037 * t);
    if (q >= 2500 && q < 3000)
      gear_rad += 0.45 * std::sin((static_cast<double>(q) - 2500.0) / 500.0 * std::numbers::pi);
    raw.push_back({gear_rad, joint_rad});
  }
  return raw;
}

/// @param tolerance as a share of the range of the torque
void expect_equal_graph(const ModelFile& file, GraphPrecision precision, double tolerance,
                        std::size_t ticks = 8000) {
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
  GraphInterpreter graph(step_graph(file, {.precision = precision}));
  ASSERT_EQ(graph.graph().raw_inputs, own.raw_inputs());
  const bool is_single = precision != GraphPrecision::twofold;
  double lowest = 0.0;
  double highest = 0.0;
  double worst = 0.0;
  double worst_bar = 0.0;
  std::size_t in_use = 0;
  std::size_t outside = 0;
  std::size_t other_faults = 0;
  std::size_t other_bars = 0;
  for (std::vector<double> raw : smooth_motion(ticks)) {
    if (precision == GraphPrecision::single)
      for (double& x : raw) x = static_cast<double>(static_cast<float>(x));
    const Estimate expected = own.step(raw);
    const Estimate found = graph.step(raw);
    lowest = std::min(lowest, expected.value);
    highest = std::max(highest, expected.value);
    worst = std::max(worst, std::abs(found.value - expected.value));
    ASSERT_TRUE(std::isfinite(found.value));
    if (found.fault != expected.fault) ++other_faults;
    if (std::isnan(found.std_dev) != std::isnan(expected.std_dev)) ++other_bars;
    if (std::isfinite(expected.std_dev))
      worst_bar =
          std::max(worst_bar, std::abs(found.std_dev - expected.std_dev) / expected.std_dev);
    if (expected.fault == Fault::none) ++in_use;
    if (expected.fault == Fault::outside_training_range) ++outside;
  }
  EXPECT_LT(worst, tolerance * (highest - lowest));
  EXPECT_LT(worst_bar, std::sqrt(tolerance));
  EXPECT_LE(other_faults, is_single ? ticks / 1000 : 0U);
  EXPECT_LE(other_bars, is_single ? ticks / 1000 : 0U);
  EXPECT_GT(in_use, ticks / 20);
  EXPECT_GT(outside, ticks / 100);
}

template <class Family>
class StepGraphs : public testing::Test {};
TYPED_TEST_SUITE(StepGraphs, Exported, ExportedName);

TYPED_TEST(StepGraphs, InDoubleIsTheEstimator) {
  expect_equal_graph(guarded(any_example<TypeParam>()), GraphPrecision::twofold, 1e-6);
}

TYPED_TEST(StepGraphs, InFloatIsNearlyTheEstimator) {
  expect_equal_graph(guarded(any_example<TypeParam>()), GraphPrecision::single, 1e-4);
}

TYPED_TEST(StepGraphs, WithWideFeaturesIsNearerToTheEstimator) {
  expect_equal_graph(guarded(any_example<TypeParam>()), GraphPrecision::mixed, 1e-5);
}

TYPED_TEST(StepGraphs, HasTheWholeLanguageOfItsFeatures) {
  expect_equal_graph(remembering(any_example<TypeParam>()), GraphPrecision::twofold, 1e-6);
}

TYPED_TEST(StepGraphs, TreatsAnExcursionAsAJumpWhereJumpsAreNotKnown) {
  ModelFile file = guarded(any_example<TypeParam>());
  file.settings.disturbances.largest_step.clear();
  expect_equal_graph(file, GraphPrecision::twofold, 1e-6);
}

TYPED_TEST(StepGraphs, HoldsTheLastValueWithoutInputsAndRecovers) {
  const ModelFile file = guarded(any_example<TypeParam>());
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
  GraphInterpreter graph(step_graph(file));
  // A gap that is too long for the estimator to bridge is the same in both.
  std::vector<std::vector<double>> motion = smooth_motion(2400);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t n = 1000; n < 1040; ++n)
    motion[n] = {motion[n][0], n % 2 == 0 ? kNaN : -1.0 / 0.0};
  double range = 0.0;
  double worst = 0.0;
  for (const std::vector<double>& raw : motion) {
    const Estimate expected = own.step(raw);
    const Estimate found = graph.step(raw);
    ASSERT_EQ(name(found.fault), name(expected.fault));
    range = std::max(range, std::abs(expected.value));
    worst = std::max(worst, std::abs(found.value - expected.value));
  }
  EXPECT_LT(worst, 1e-6 * range);
}

TYPED_TEST(StepGraphs, ReportAnotherRateThanTheirs) {
  const ModelFile file = guarded(any_example<TypeParam>());
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
  GraphInterpreter graph(step_graph(file));
  std::size_t tick = 0;
  for (const std::vector<double>& raw : smooth_motion(600)) {
    const bool is_wrong = tick > 300 && tick <= 340;
    own.set_wrong_rate(is_wrong);
    const Estimate expected = own.step(raw);
    const Estimate found = graph.step(raw, is_wrong ? 2e-3 : 1e-3);
    ASSERT_EQ(name(found.fault), name(expected.fault)) << tick;
    ASSERT_NEAR(found.value, expected.value, 1e-5 * (1.0 + std::abs(expected.value))) << tick;
    ASSERT_EQ(std::isnan(found.std_dev), std::isnan(expected.std_dev)) << tick;
    ++tick;
  }
}

TEST(StepGraphOptions, WithoutGuardsTheModelIsAlone) {
  const ModelFile file = guarded(any_example<GreyBox>());
  AnyModel own(file.parameters);
  FeaturePipeline pipeline(file.settings.features, file.settings.sample_rate_Hz);
  GraphInterpreter graph(step_graph(file, {.has_guards = false}));
  for (const std::vector<double>& raw : smooth_motion(4000))
    ASSERT_NEAR(graph.step(raw).value, own.step(pipeline.step(raw)).value, 1e-9);
}

TEST(StepGraphOptions, OtherFamiliesAreRefusedByName) {
  EXPECT_THAT([] { (void)step_graph(guarded(any_example<Dgmm>())); },
              testing::ThrowsMessage<UsageError>(
                  testing::AllOf(testing::HasSubstr("grey_box"), testing::HasSubstr("dgmm"))));
}

}  // namespace
}  // namespace torsio::test
