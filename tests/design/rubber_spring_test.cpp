#include "torsio/design/rubber_spring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/clutch.hpp"

namespace torsio {
namespace {

/// The demand of paper 002.
RubberSpringDemand demand_002() {
  return {.torque_Nm = 0.5,
          .angle_rad = rad_from_deg(15.0),
          .shear_modulus_Pa = shear_modulus_of_hardness(60.0)};
}

TEST(RubberSpring, HasTheStiffnessAndStressOfThePrintedRing) {
  const RubberRing ring{0.010, 0.0082, 0.004};
  EXPECT_NEAR(stiffness(ring, shear_modulus_of_hardness(60.0)), 1.93593, 1e-5);
  EXPECT_NEAR(shear_stress(ring, 0.5), 580980.0, 10.0);
  EXPECT_NEAR(objective(ring, demand_002()), 659.479, 1e-3);
  EXPECT_NEAR(stiffness_tolerance(ring, demand_002()), 0.175, 5e-4);
}

// The simulated sensor of that name follows from section II of the paper alone.
TEST(RubberSpring, OfTheDesignedSensorIsThePrintedRingAndItsClutchThePrintedDisks) {
  const DataSheet sheet = data_sheet("rubber-clutch:designed");
  const RubberRing ring{0.010, 0.0082, 0.004};
  EXPECT_NEAR(std::get<RubberSheet>(sheet.second).stiffness_Nm_rad.value,
              stiffness(ring, shear_modulus_of_hardness(60.0)), 1e-4);
  EXPECT_EQ(std::get<RubberSheet>(sheet.second).asymmetry_Nm_rad.value, 0.0);
  EXPECT_NEAR(std::get<ClutchSheet>(sheet.first).static_torque_Nm.value,
              204.0 * effective_arm({}, 0.2), 1e-4);
}

TEST(RubberSpring, OfPaper002IsTheShortestAndWidestRing) {
  const RubberSpringDesign design = design_rubber_spring(demand_002());
  ASSERT_TRUE(design.is_feasible);
  EXPECT_NEAR(design.exact.outer_m, 0.010, 1e-9);
  EXPECT_NEAR(design.exact.inner_m, 8.23326e-3, 1e-8);
  EXPECT_NEAR(design.exact.length_m, 0.004, 1e-9);
  EXPECT_NEAR(design.objective, 648.4908, 1e-4);
  EXPECT_NEAR(design.rounded.inner_m, 8.2e-3, 1e-9);
  ASSERT_EQ(design.active.size(), 3U);
  EXPECT_NEAR(design.active[0].multiplier, 801.6, 0.1);
  EXPECT_EQ(design.active[1].name, "largest outer radius");
  EXPECT_NEAR(design.active[1].multiplier, -191.1, 0.1);
  EXPECT_EQ(design.active[2].name, "least length");
  EXPECT_NEAR(design.active[2].multiplier, 362.5, 0.1);
}

TEST(RubberSpring, IsLimitedByTheStressWhereItMayBeShort) {
  RubberSpringDemand demand = demand_002();
  demand.least_length_m = 0.002;
  const RubberSpringDesign design = design_rubber_spring(demand);
  EXPECT_NEAR(design.exact.outer_m, 0.010, 1e-9);
  EXPECT_NEAR(design.exact.inner_m, 8.5932e-3, 1e-7);
  EXPECT_NEAR(design.exact.length_m, 3.3652e-3, 1e-7);
  EXPECT_NEAR(design.objective, 443.142, 1e-3);
  EXPECT_EQ(design.active.back().name, "stress (2)");
  // In cm^3/Nm the volume has a thousandth of the weight, and the optimum is another.
  demand.weight_volume = 0.8e-3;
  const RubberSpringDesign in_cm3 = design_rubber_spring(demand);
  EXPECT_NEAR(in_cm3.exact.outer_m, 8.708e-3, 1e-6);
  EXPECT_NEAR(in_cm3.exact.length_m, 2.930e-3, 1e-6);
}

TEST(RubberSpring, IsNoWorseThanAnyRingOfAGridWithinTheBounds) {
  RubberSpringDemand demand = demand_002();
  demand.least_length_m = 0.002;
  demand.weight_length = 100.0;
  const double best = design_rubber_spring(demand).objective;
  const double wanted = demand.torque_Nm / demand.angle_rad;
  for (double outer = 6e-3; outer <= 10e-3; outer += 0.05e-3)
    for (double length = 2e-3; length <= 10e-3; length += 0.05e-3) {
      // r2 from the stiffness, so that the ring is feasible but for the bounds
      const double fourth =
          std::pow(outer, 4) - wanted * 2.0 * length / (3.14159265358979 * demand.shear_modulus_Pa);
      if (fourth < 0.0) continue;
      const RubberRing ring{outer, std::pow(fourth, 0.25), length};
      if (ring.outer_m - ring.inner_m < demand.least_wall_m) continue;
      if (shear_stress(ring, demand.torque_Nm) > demand.allowed_stress_Pa) continue;
      EXPECT_GE(objective(ring, demand), best - 1e-9) << outer << " " << length;
    }
}

TEST(RubberSpring, NamesTheBoundThatWouldHaveToMove) {
  RubberSpringDemand demand = demand_002();
  demand.largest_outer_m = 0.008;
  const RubberSpringDesign design = design_rubber_spring(demand);
  EXPECT_FALSE(design.is_feasible);
  EXPECT_NE(
      design.infeasible.find("the largest outer radius of 8 mm would have to move to 8.574 mm"),
      std::string::npos)
      << design.infeasible;
}

TEST(RubberSpring, MeetsAConstraintThatCouplesRadiusAndLength) {
  RubberSpringDemand demand = demand_002();
  demand.constraints = {"length >= 0.6 * outer_radius"};
  const RubberSpringDesign design = design_rubber_spring(demand);
  ASSERT_TRUE(design.is_feasible);
  // The objective falls with the outer radius: both bounds are active.
  EXPECT_NEAR(design.exact.outer_m, 0.010, 1e-9);
  EXPECT_NEAR(design.exact.length_m, 0.006, 1e-9);
  EXPECT_NEAR(stiffness(design.exact, demand.shear_modulus_Pa), 0.5 / demand.angle_rad, 1e-9);
  ASSERT_EQ(design.active.size(), 3U);
  const ActiveConstraint& active = design.active.back();
  EXPECT_EQ(active.name, demand.constraints[0]);
  // The multiplier is the change of the objective with the slack that is demanded.
  RubberSpringDemand tighter = demand;
  tighter.constraints = {"length >= 0.6 * outer_radius + 1e-6"};
  EXPECT_NEAR((design_rubber_spring(tighter).objective - design.objective) / 1e-6,
              active.multiplier, 2e-3 * active.multiplier);
  // One that the free optimum meets changes nothing.
  demand.constraints = {"wall <= 5mm", "volume <= 500 * 1mm^3"};
  EXPECT_EQ(design_rubber_spring(demand).objective, design_rubber_spring(demand_002()).objective);
}

TEST(RubberSpring, IsNoWorseThanAnyRingOfAGridThatMeetsTheConstraints) {
  RubberSpringDemand demand = demand_002();
  demand.constraints = {"strain * 4 <= 1 + outer_radius / 20mm",
                        "inner_radius >= 3mm + length / 8"};
  const RubberSpringDesign design = design_rubber_spring(demand);
  ASSERT_TRUE(design.is_feasible);
  const double c =
      2.0 * demand.torque_Nm / demand.angle_rad / (std::numbers::pi * demand.shear_modulus_Pa);
  for (double outer = 0.002; outer <= demand.largest_outer_m; outer += 0.05e-3)
    for (double length = demand.least_length_m; length <= demand.largest_length_m;
         length += 0.02e-3) {
      const double inner = std::pow(std::max(std::pow(outer, 4) - c * length, 0.0), 0.25);
      const RubberRing ring{outer, inner, length};
      const double strain = shear_stress(ring, demand.torque_Nm) / demand.shear_modulus_Pa;
      const bool is_met = 4.0 * strain <= 1.0 + outer / 0.020 && inner >= 0.003 + length / 8.0 &&
                          shear_stress(ring, demand.torque_Nm) <= demand.allowed_stress_Pa &&
                          outer - inner >= demand.least_wall_m;
      if (!is_met) continue;
      EXPECT_GE(objective(ring, demand), design.objective * (1.0 - 1e-6)) << outer;
    }
}

TEST(RubberSpring, NamesAConstraintThatNoRingMeets) {
  RubberSpringDemand demand = demand_002();
  demand.constraints = {"volume <= 100 * 1mm^3"};
  const RubberSpringDesign design = design_rubber_spring(demand);
  EXPECT_FALSE(design.is_feasible);
  EXPECT_NE(design.infeasible.find("'volume <= 100 * 1mm^3' would have to be relaxed by at least "
                                   "3.048e-07"),
            std::string::npos)
      << design.infeasible;
  for (const char* wrong : {"length", "length = 3mm", "length <= 3mm <= wall", "lenght <= 3mm",
                            "lag(length, 1) <= 3mm", "length <= (3mm", "length <="}) {
    SCOPED_TRACE(wrong);
    demand.constraints = {wrong};
    EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
  }
}

TEST(RubberSpring, TakesAMeasuredFactorIntoTheStiffness) {
  RubberSpringDemand demand = demand_002();
  demand.correction = 1.25;
  const RubberSpringDesign design = design_rubber_spring(demand);
  EXPECT_NEAR(stiffness(design.exact, 1.25 * demand.shear_modulus_Pa), 0.5 / demand.angle_rad,
              1e-9);
  EXPECT_GT(design.exact.inner_m, 8.24e-3);
}

TEST(RubberSpring, RoundsToAGridWithinTheBounds) {
  RubberSpringDemand demand = demand_002();
  demand.least_length_m = 0.00404;
  const RubberSpringDesign design = design_rubber_spring(demand);
  ASSERT_TRUE(design.is_feasible);
  EXPECT_GE(design.rounded.length_m, demand.least_length_m);
  EXPECT_LE(design.rounded.outer_m, demand.largest_outer_m + 1e-12);
}

TEST(RubberSpring, ComparesItselfWithTableIOfThePaper) {
  int printed = 0;
  for (const PublishedTorqueSensor& sensor : torque_sensors_002()) {
    if (!(sensor.ratio_cm3_Nm > 0.0)) continue;
    ++printed;
    EXPECT_NEAR(sensor.volume_cm3 / sensor.torque_Nm, sensor.ratio_cm3_Nm, 0.005) << sensor.name;
  }
  EXPECT_EQ(printed, 5);
  EXPECT_NEAR(sensor_volume_cm3({0.010, 0.0082, 0.004}), 12.744, 1e-9);
}

TEST(RubberSpring, RefusesWhatCannotBe) {
  EXPECT_THROW((void)shear_modulus_of_hardness(29.0), UsageError);
  EXPECT_THROW((void)shear_modulus_of_hardness(94.0), UsageError);
  RubberSpringDemand demand = demand_002();
  demand.least_length_m = 0.02;
  EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
  demand = demand_002();
  demand.least_inner_m = 0.0095;
  EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
  demand = demand_002();
  demand.safety = 0.5;
  EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
  demand = demand_002();
  demand.hardness_tolerance = std::nan("");
  EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
  demand = demand_002();
  demand.torque_Nm = -1.0;
  EXPECT_THROW((void)design_rubber_spring(demand), UsageError);
}

}  // namespace
}  // namespace torsio
