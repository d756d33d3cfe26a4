#include "evaluate/drift/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "report/drift.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

const DriftQuantity& quantity(const Drift& drift, const std::string& name) {
  for (const DriftQuantity& each : drift.quantities)
    if (each.name == name) return each;
  throw std::out_of_range(name);
}

// A direction of which the model has an error does not get surer with the length.
TEST(DriftVerdicts, StatesWhichChangeTheModelHidesWhereNoLengthHelps) {
  DriftQuantity friction{
      .name = "friction", .unit = "Nm", .before = 2.0, .tolerance = 0.08, .smallest = 0.2};
  decide(friction, 0.0, {.noise = 0.05, .model = 0.24});
  EXPECT_EQ(friction.verdict, DriftVerdict::undetermined);
  EXPECT_THAT(friction.reason, HasSubstr("hides changes below 16 %, however long"));
  EXPECT_TRUE(std::isinf(friction.times_as_long));
  Drift drift{.quantities = {friction},
              .calibration_rmse = 0.1,
              .rmse = 0.1,
              .zeroed_rmse = 0.1,
              .corrected_rmse = 0.1};
  conclude(drift);
  EXPECT_EQ(drift.advice, DriftAdvice::better_model);
  EXPECT_THAT(drift_text(drift, "torque_Nm"), HasSubstr("not longer recordings"));
}

TEST(DriftVerdicts, TheAdvisedLengthMakesTheIntervalDecide) {
  for (const bool lasts : {true, false})
    for (const double change : {0.0, 0.03, 0.07, 0.12}) {
      DriftQuantity of{
          .name = "friction", .unit = "Nm", .before = 1.0, .tolerance = 0.04, .smallest = 0.1};
      const DriftHalfWidth now{.noise = 0.3, .model = 0.02, .model_lasts = lasts};
      decide(of, change, now);
      ASSERT_EQ(of.verdict, DriftVerdict::undetermined);
      const double longer = 1.01 * of.times_as_long;
      decide(of, change,
             {.noise = now.noise / std::sqrt(longer),
              .model = lasts ? now.model : now.model / std::pow(longer, 0.25)});
      EXPECT_NE(of.verdict, DriftVerdict::undetermined) << change;
    }
}

/// Quantities of a comparison, as far as `separate_gain` uses them.
Drift compared(double scale, double half_width, double before) {
  DriftQuantity both{.name = "stiffness or gain",
                     .unit = "Nm/rad",
                     .before = before,
                     .tolerance = 0.012 * before,
                     .smallest = 0.03 * before};
  decide(both, scale * before, {.noise = half_width * before});
  Drift drift{.quantities = {both},
              .calibration_rmse = 0.1,
              .rmse = 0.1,
              .zeroed_rmse = 0.1,
              .corrected_rmse = 0.1};
  conclude(drift);
  return drift;
}

TEST(DriftVerdicts, AReferenceSeparatesTheGainOfTheSensorFromTheStiffness) {
  Drift gain = compared(0.08, 0.005, 600.0);
  EXPECT_EQ(gain.joint, DriftVerdict::changed);
  separate_gain(gain, compared(0.079, 0.006, 15000.0));
  EXPECT_EQ(quantity(gain, "gain of the torque sensor").verdict, DriftVerdict::changed);
  EXPECT_NEAR(quantity(gain, "gain of the torque sensor").relative, 0.079, 1e-12);
  EXPECT_EQ(quantity(gain, "stiffness").verdict, DriftVerdict::not_changed);
  EXPECT_NEAR(quantity(gain, "stiffness").relative, 0.001, 1e-9);
  EXPECT_NEAR(quantity(gain, "stiffness").highest - quantity(gain, "stiffness").change,
              600.0 * std::hypot(0.005, 0.006), 1e-9);
  EXPECT_EQ(gain.joint, DriftVerdict::not_changed);
  EXPECT_EQ(gain.advice, DriftAdvice::check_sensor);
  EXPECT_THAT(drift_text(gain, "torque_Nm"), HasSubstr("check it before a new calibration"));

  Drift stiffness = compared(-0.08, 0.005, 600.0);
  separate_gain(stiffness, compared(0.001, 0.006, 15000.0));
  EXPECT_EQ(quantity(stiffness, "gain of the torque sensor").verdict, DriftVerdict::not_changed);
  EXPECT_EQ(quantity(stiffness, "stiffness").verdict, DriftVerdict::changed);
  EXPECT_EQ(stiffness.joint, DriftVerdict::changed);
}

TEST(DriftVerdicts, APoorReferenceLeavesTheSumToTheJoint) {
  Drift drift = compared(0.08, 0.005, 600.0);
  separate_gain(drift, compared(0.05, 0.13, 15000.0));
  EXPECT_EQ(quantity(drift, "stiffness").verdict, DriftVerdict::undetermined);
  EXPECT_EQ(quantity(drift, "gain of the torque sensor").verdict, DriftVerdict::undetermined);
  EXPECT_EQ(drift.joint, DriftVerdict::changed);
  Drift without = compared(0.08, 0.005, 600.0);
  Drift unknown = compared(kNotMeasured, kNotMeasured, 15000.0);
  unknown.quantities[0].reason = "too little";
  separate_gain(without, unknown);
  EXPECT_EQ(quantity(without, "stiffness").reason, "too little");
  EXPECT_EQ(without.joint, DriftVerdict::changed);
}

}  // namespace
}  // namespace torsio::test
