#include "torsio/design/clutch.hpp"

#include <gtest/gtest.h>

#include "torsio/core/error.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {
namespace {

ClutchDemand clutch_002() {
  ClutchDemand demand;
  demand.washer = read_washers({}).front();
  return demand;
}

TEST(Clutch, OfPaper002NeedsThePrintedForce) {
  const DesignReport report = design_clutch(clutch_002());
  EXPECT_NEAR(report.at("clutch", "effective_arm").value, 2.45, 1e-9);
  EXPECT_NEAR(report.at("clutch", "axial_force").value, 204.08, 0.005);
  EXPECT_NEAR(report.at("clutch", "axial_force_uniform_wear").value, 208.33, 0.005);
  EXPECT_NEAR(report.at("clutch", "torque_at_least_friction").value, 0.25, 1e-9);
  EXPECT_NEAR(report.at("clutch", "torque_at_flat").value, 1.7126, 5e-4);
  EXPECT_NEAR(report.at("washers", "travel").value, 0.083, 5e-4);
  EXPECT_NEAR(report.at("washers", "rate").value, 2249.0, 1.0);
  EXPECT_NEAR(report.at("washers", "torque_per_10_um").value, 0.055, 5e-4);
}

TEST(Clutch, IsEasierToAdjustWithWashersInSeries) {
  ClutchDemand demand = clutch_002();
  demand.series = 4;
  const DesignReport report = design_clutch(demand);
  EXPECT_NEAR(report.at("washers", "rate").value, 2249.0 / 4.0, 0.5);
  EXPECT_NEAR(report.at("washers", "stack_travel").value, 4.0 * 0.083, 2e-3);
}

TEST(Clutch, NamesWhatWouldCarryTheTorque) {
  ClutchDemand demand = clutch_002();
  demand.slip_Nm = 2.0;
  const DesignReport report = design_clutch(demand);
  EXPECT_FALSE(report.is_feasible);
  EXPECT_NE(report.infeasible.find("from 1 to 2"), std::string::npos) << report.infeasible;
  EXPECT_NE(report.infeasible.find("2 Nm to 1.712 Nm"), std::string::npos) << report.infeasible;
  demand.parallel = 2;
  EXPECT_TRUE(design_clutch(demand).is_feasible);
}

TEST(Belleville, HasTheForceOfTheStandard) {
  const BellevilleWasher washer = read_washers({}).back();
  EXPECT_NEAR(force(washer, 0.6e-3), 1107.0, 1.0);
  EXPECT_NEAR(travel(washer, force(washer, 0.3e-3)), 0.3e-3, 1e-9);
  const double slope = (force(washer, 0.30001e-3) - force(washer, 0.29999e-3)) / 2e-8;
  EXPECT_NEAR(rate(washer, 0.3e-3) / slope, 1.0, 1e-6);
  EXPECT_THROW((void)travel(washer, 5000.0), Error);
}

TEST(Clutch, RefusesWhatCannotBe) {
  ClutchDemand demand = clutch_002();
  demand.inner_m = 0.008;
  EXPECT_THROW((void)design_clutch(demand), UsageError);
  demand = clutch_002();
  demand.slip_Nm = 5e-324;
  EXPECT_THROW((void)design_clutch(demand), UsageError);
  demand = clutch_002();
  demand.least_friction = 0.3;
  EXPECT_THROW((void)design_clutch(demand), UsageError);
  demand = clutch_002();
  demand.washer.cone_height_m = 1e-3;
  EXPECT_THROW((void)design_clutch(demand), UsageError);
}

}  // namespace
}  // namespace torsio
