// The error of the sensor from which a model was learned, as a term of its own in the error bar.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/example_settings.hpp"
#include "support/examples/linear.hpp"
#include "support/numbers.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/estimate/torque_sources.hpp"

namespace torsio {
namespace {

constexpr SensorUncertainty kLoadCell{.constant = 0.4, .relative = 0.03};

Estimator estimator_of_sensor(const SensorUncertainty& sensor) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels = {};
  settings.features.inputs = {"spring_deflection_rad", "joint_angle_rad"};
  settings.ranges = {.lowest = {-1.0, -1.0}, .highest = {1.0, 1.0}, .margin = 0.05};
  settings.disturbances = {.largest_step = {0.1, 0.1}, .largest_travel = 0.1};
  settings.residuals = {.edges = {-1e3, 1e3}, .std_dev = {0.3}};
  settings.target_uncertainty = sensor;
  return {std::move(settings), AnyModel(test::example<Linear>())};
}

/// A motion through the range, beyond it and with a gap.
std::vector<std::array<double, 2>> swept_inputs() {
  std::vector<std::array<double, 2>> raw;
  for (int n = 0; n < 2000; ++n)
    raw.push_back({1.4 * std::sin(0.01 * n), n % 700 == 650 ? test::kNaN : 0.0});
  return raw;
}

TEST(SensorUncertainty, IsTheRootOfTheSumOfSquaresOfItsParts) {
  EXPECT_FALSE(SensorUncertainty{}.is_stated());
  EXPECT_TRUE((SensorUncertainty{.relative = 0.01}).is_stated());
  EXPECT_DOUBLE_EQ((SensorUncertainty{.constant = 3.0, .relative = 0.04}).at(-100.0), 5.0);
  EXPECT_EQ(larger_of({.constant = 1.0, .relative = 0.1}, {.constant = 2.0, .relative = 0.05}),
            (SensorUncertainty{.constant = 2.0, .relative = 0.1}));
}

TEST(SensorUncertainty, IsTakenOutOfAnErrorBarThatContainsIt) {
  for (const double value : {-80.0, 0.0, 3.0})
    for (const double std_dev : {0.01, 0.3, 20.0})
      EXPECT_NEAR(kLoadCell.taken_out_of(std::hypot(std_dev, kLoadCell.at(value)), value), std_dev,
                  1e-11);
  EXPECT_TRUE(std::isnan(kLoadCell.taken_out_of(test::kNaN, 1.0)));
  EXPECT_EQ(kLoadCell.taken_out_of(0.1, 1.0), 0.0) << "an error bar that does not contain it";
  EXPECT_EQ(SensorUncertainty{}.taken_out_of(0.1, 1.0), 0.1);
}

TEST(SensorUncertainty, IsWrittenWithItsUnits) {
  EXPECT_EQ(uncertainty_text({.constant = 0.208, .relative = 0.00583}, "torque_Nm"),
            "sqrt((0.21 Nm)^2 + (0.58 % of the value)^2) (standard uncertainty)");
  EXPECT_EQ(uncertainty_text({.constant = 2.0}, "force_N"), "2 N (standard uncertainty)");
  EXPECT_EQ(uncertainty_text({.relative = 0.01}, "force_N"),
            "1 % of the value (standard uncertainty)");
  EXPECT_EQ(uncertainty_text({}, "force_N"), "");
}

TEST(TargetUncertainty, AddsItsVarianceToEveryErrorBarAndChangesNothingElse) {
  Estimator with = estimator_of_sensor(kLoadCell);
  Estimator without = estimator_of_sensor({});
  std::size_t of_model = 0;
  std::size_t of_others = 0;
  std::size_t unknown = 0;
  for (const std::array<double, 2>& raw : swept_inputs()) {
    const Estimate now = with.step(raw);
    const Estimate plain = without.step(raw);
    ASSERT_EQ(now.value, plain.value);
    ASSERT_EQ(now.fault, plain.fault);
    if (std::isnan(plain.std_dev)) {
      ASSERT_TRUE(std::isnan(now.std_dev));
      ++unknown;
      continue;
    }
    ++(now.fault == Fault::none ? of_model : of_others);
    const double expected = std::sqrt(plain.std_dev * plain.std_dev + 0.4 * 0.4 +
                                      0.03 * 0.03 * plain.value * plain.value);
    ASSERT_NEAR(now.std_dev, expected, 1e-12 * expected);
  }
  EXPECT_GT(of_model, 100U);
  EXPECT_GT(of_others, 100U);
  EXPECT_GT(unknown, 0U);
}

TEST(TargetUncertainty, IsPartOfTheIdentityOfAState) {
  EXPECT_NE(estimator_of_sensor(kLoadCell).state_identity(),
            estimator_of_sensor({}).state_identity());
}

TEST(TargetUncertainty, RefusesNumbersThatAreNegativeOrNotFinite) {
  for (const SensorUncertainty& bad :
       {SensorUncertainty{.constant = -1.0}, SensorUncertainty{.relative = std::nan("")},
        SensorUncertainty{.relative = HUGE_VAL}})
    EXPECT_NE(test::error_message([&] { estimator_of_sensor(bad); }).find("target_uncertainty."),
              std::string::npos);
}

TEST(TargetUncertainty, IsNotInTheErrorBarsOfSourcesThatAreCompared) {
  TorqueSources with(std::vector<SourceModel>{{.torque = estimator_of_sensor(kLoadCell)},
                                              {.torque = estimator_of_sensor(kLoadCell)}});
  Estimator without = estimator_of_sensor({});
  with.set_zero("joint_angle_rad", 0.25);
  without.set_zero("joint_angle_rad", 0.25);
  const std::array<double, 2> raw{0.3, 0.2};
  const Estimate expected = without.step(raw);
  ASSERT_GT(expected.std_dev, 0.0);
  for (const Estimate& each : with.step(raw)) {
    EXPECT_EQ(each.value, expected.value);
    EXPECT_EQ(each.std_dev, expected.std_dev);
  }
}

}  // namespace
}  // namespace torsio
