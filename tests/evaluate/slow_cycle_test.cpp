#include "torsio/evaluate/slow_cycle.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "model/linear/linear_coulomb.hpp"
#include "report/model_description.hpp"
#include "support/bench_dataset.hpp"
#include "support/example_model_file.hpp"
#include "support/fitted_families.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

Matrix row(std::vector<double> values) {
  Matrix matrix(1, values.size());
  matrix.values = std::move(values);
  return matrix;
}

/// torque = 0.5 + 600 d + 2 tanh(rate / v), v far below the speed of the cycle.
ModelFile coulomb_spring() {
  LinearCoulomb::Parameters parameters;
  parameters.coefficients.values = row({0.5, 600.0, 0.0, 2.0});
  parameters.rate_feature = 1;
  parameters.rate_scale = 1e-4;
  ModelFile file = test::example_model_file(LinearCoulomb(parameters));
  file.settings.ranges.lowest = {-0.1, -1.0};
  file.settings.ranges.highest = {0.2, 1.0};
  return file;
}

TEST(SlowCycle, FindsStiffnessWidthAndFrictionOfAKnownSpring) {
  const SlowCycle cycle = slow_cycle(coulomb_spring());
  ASSERT_EQ(cycle.reason, "");
  EXPECT_EQ(cycle.lowest_rad, -0.1);
  EXPECT_EQ(cycle.highest_rad, 0.2);
  EXPECT_NEAR(cycle.stiffness_Nm_rad, 600.0, 1.0);
  EXPECT_NEAR(cycle.width_at_zero_Nm, 4.0, 0.01);
  EXPECT_NEAR(cycle.largest_width_Nm, 4.0, 0.01);
  EXPECT_NEAR(cycle.friction_Nm, 2.0, 0.02);
  ASSERT_EQ(cycle.points.size(), 9U);
  for (const SlowCycle::Point& point : cycle.points) {
    EXPECT_NEAR(point.torque_Nm, 0.5 + 600.0 * point.deflection_rad, 0.1);
    EXPECT_NEAR(point.stiffness_Nm_rad, 600.0, 1.0);
    EXPECT_NEAR(point.loop_width_Nm, 4.0, 0.01);
    EXPECT_NEAR(point.friction_Nm, 2.0, 0.01);
  }
  const std::string text = model_description(coulomb_spring(), cycle);
  EXPECT_THAT(text, HasSubstr("stiffness 600 Nm/rad"));
  EXPECT_THAT(text, HasSubstr("loop width 4 Nm at zero deflection"));
  EXPECT_THAT(text, HasSubstr("friction 1.998 Nm"));
}

TEST(SlowCycle, StatesWhyItCannotBeDetermined) {
  const auto reason = [](auto change) {
    ModelFile file = coulomb_spring();
    change(file.settings);
    const SlowCycle cycle = slow_cycle(file);
    EXPECT_THAT(model_description(file, cycle),
                HasSubstr("stiffness, loop width and friction cannot be determined: "));
    return cycle.reason;
  };
  EXPECT_THAT(reason([](auto& settings) { settings.target = "spring_deflection_rad"; }),
              HasSubstr("not a torque"));
  EXPECT_THAT(reason([](auto& settings) { settings.features.inputs[0] = "2 * joint_angle_rad"; }),
              HasSubstr("no input is the deflection"));
  EXPECT_THAT(reason([](auto& settings) { settings.features.inputs[1] = "rate(motor_angle_rad)"; }),
              HasSubstr("motor_angle_rad"));
  EXPECT_THAT(reason([](auto& settings) {
                settings.ranges.lowest[0] = -kOpenRange;
                settings.ranges.highest[0] = kOpenRange;
              }),
              HasSubstr("not known"));
  EXPECT_THAT(reason([](auto& settings) { settings.ranges.lowest[1] = 0.5; }),
              HasSubstr("outside_training_range"));
}

TEST(SlowCycle, HoldsOtherInputsInTheMiddleOfTheirRange) {
  ModelFile file = coulomb_spring();
  file.settings.features.inputs[1] = "support_m";
  file.settings.ranges.lowest[1] = 0.02;
  file.settings.ranges.highest[1] = 0.04;
  const SlowCycle cycle = slow_cycle(file);
  ASSERT_EQ(cycle.reason, "");
  ASSERT_EQ(cycle.held.size(), 1U);
  EXPECT_EQ(cycle.held[0].first, "support_m");
  EXPECT_DOUBLE_EQ(cycle.held[0].second, 0.03);
}

class SlowCycleOfEveryFamily : public testing::TestWithParam<std::string> {};

TEST_P(SlowCycleOfEveryFamily, IsFiniteOrHasAReason) {
  const Dataset dataset = test::bench_dataset();
  const ModelFile file = train_model(dataset,
                                     {.family = GetParam(),
                                      .options = test::quick_options(GetParam()),
                                      .features = resolve_inputs(dataset, {})},
                                     1)
                             .file;
  const SlowCycle cycle = slow_cycle(file);
  // A model of its own past outputs may diverge in a motion that is slower than its training.
  if (cycle.reason == "the model reports diverged during a slow cycle") return;
  EXPECT_EQ(cycle.reason, "") << "each of them is a spring of the deflection";
  EXPECT_TRUE(std::isfinite(cycle.stiffness_Nm_rad));
  EXPECT_TRUE(std::isfinite(cycle.friction_Nm));
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, SlowCycleOfEveryFamily,
                         testing::ValuesIn(test::spring_families()), test::kFamilyName);

TEST(SlowCycle, StopsWhenAskedTo) {
  EXPECT_THROW((void)slow_cycle(coulomb_spring(), [](double, std::string_view) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace torsio
