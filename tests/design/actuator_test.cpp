#include "torsio/design/actuator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/deflection_controller.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

namespace torsio {
namespace {

constexpr double kTurn = 6.283185307179586;

ActuatorDemand demand_of(double continuous_Nm, double peak_Nm, double speed_deg_s,
                         double link_inertia_kg_m2) {
  ActuatorDemand demand{.continuous_Nm = continuous_Nm,
                        .peak_Nm = peak_Nm,
                        .speed_rad_s = rad_from_deg(speed_deg_s),
                        .deflection_rad = rad_from_deg(5.0),
                        .bandwidth_rad_s = 8.0 * kTurn,
                        .link_inertia_kg_m2 = link_inertia_kg_m2};
  demand.envelope.largest_diameter_m = 0.15;
  demand.envelope.largest_length_m = 0.2;
  demand.envelope.material = read_materials({}).front();
  demand.envelope.washers = read_washers({});
  return demand;
}

TEST(DesignedActuator, MeetsItsDemandInSimulationOrNamesTheLimit) {
  // From a wrist to a hip.
  const std::vector<ActuatorDemand> demands{
      demand_of(5, 8, 60, 0.01),   demand_of(8, 16, 90, 0.03),   demand_of(12, 25, 60, 0.05),
      demand_of(20, 40, 120, 0.1), demand_of(30, 60, 60, 0.15),  demand_of(45, 90, 60, 0.3),
      demand_of(70, 140, 60, 0.6), demand_of(110, 200, 40, 1.0), demand_of(150, 300, 40, 2.0),
      demand_of(200, 400, 40, 3.0)};
  int met = 0;
  for (const ActuatorDemand& demand : demands) {
    SCOPED_TRACE(demand.peak_Nm);
    const ActuatorDesign design = design_actuator(demand, read_drives({}), "joint");
    if (!design.is_feasible) {
      EXPECT_NE(design.infeasible.find("would have to move to"), std::string::npos);
      continue;
    }
    ++met;
    const DataSheet sheet =
        parse_data_sheet(data_sheet_yaml(design.candidates[design.chosen].sheet), "joint.yaml");
    const DriveTrial trial = try_drive(sheet, demand.continuous_Nm);
    EXPECT_GE(trial.speed_rad_s, demand.speed_rad_s);
    EXPECT_GE(trial.peak_Nm, demand.peak_Nm);
    EXPECT_LT(trial.stator_K, trial.derating_K);
    EXPECT_GT(trial.copper_K, trial.stator_K);
    // The loop that tune-loop proposes reaches the bandwidth of the demand with its margins.
    const DeflectionController loop(
        {.joint = series_elastic_joint(sheet),
         .bandwidth_rad_s = design.candidates[design.chosen].tune_Hz * kTurn},
        1000.0);
    EXPECT_GE(loop.cutoff_rad_s(), demand.bandwidth_rad_s);
    EXPECT_GE(loop.margins_of(loop.gains(), JointOutput::free).gain, 2.0);
    EXPECT_GE(loop.margins_of(loop.gains(), JointOutput::locked).phase_rad, rad_from_deg(30.0));
  }
  EXPECT_GE(met, 8);
}

TEST(DesignedActuator, NamesTheLimitThatBinds) {
  ActuatorDemand demand = demand_of(100, 150, 600, 0.5);
  const ActuatorDesign fast = design_actuator(demand, read_drives({}), "joint");
  EXPECT_FALSE(fast.is_feasible);
  EXPECT_NE(
      fast.infeasible.find("speed at the continuous torque binds: the 600 deg/s would have to "
                           "move to "),
      std::string::npos)
      << fast.infeasible;
  demand = demand_of(45, 90, 60, 0.3);
  demand.impedance_Nm_rad = 1000.0;
  const std::string stiff = design_actuator(demand, read_drives({}), "joint").infeasible;
  EXPECT_NE(stiff.find("passive stiffness up to 1 Hz binds"), std::string::npos) << stiff;
  demand.impedance_Nm_rad = 0.0;
  demand.softest_Nm_rad = 1.0;
  const std::string soft = design_actuator(demand, read_drives({}), "joint").infeasible;
  EXPECT_NE(soft.find("softest impedance at 1 Hz binds"), std::string::npos) << soft;
  demand.impedance_Nm_rad = 0.5;
  EXPECT_THROW((void)design_actuator(demand, read_drives({}), "joint"), UsageError);
  demand = demand_of(1000, 1500, 10, 0.5);
  EXPECT_FALSE(design_actuator(demand, read_drives({}), "joint").is_feasible);
}

TEST(DesignedActuator, IsTheLightestAndObeysACollisionLimit) {
  ActuatorDemand demand = demand_of(30, 60, 60, 0.15);
  const ActuatorDesign free = design_actuator(demand, read_drives({}), "joint");
  ASSERT_TRUE(free.is_feasible);
  for (const DriveCandidate& each : free.candidates)
    EXPECT_TRUE(!each.is_feasible() || each.mass_kg >= free.candidates[free.chosen].mass_kg);
  demand.collision_N = 10.0;
  const ActuatorDesign limited = design_actuator(demand, read_drives({}), "joint");
  EXPECT_FALSE(limited.is_feasible);
  EXPECT_NE(limited.infeasible.find("collision force"), std::string::npos) << limited.infeasible;
}

TEST(DesignedActuator, RefusesWhatContradictsItself) {
  EXPECT_THROW((void)design_actuator(demand_of(30, 20, 60, 0.1), read_drives({}), "joint"),
               UsageError);
  EXPECT_THROW((void)design_actuator(demand_of(30, 60, -5, 0.1), read_drives({}), "joint"),
               UsageError);
  ActuatorDemand light = demand_of(30, 60, 60, 0.15);
  light.link_inertia_kg_m2 = 1e-9;
  EXPECT_THROW((void)design_actuator(light, read_drives({}), "joint"), UsageError);
}

TEST(DesignedActuator, HasAParetoPicture) {
  const ActuatorDemand demand = demand_of(30, 60, 60, 0.15);
  const ActuatorDesign design = design_actuator(demand, read_drives({}), "joint");
  const DesignReport report = actuator_report(demand, design);
  ASSERT_EQ(report.pictures.size(), 3U);
  const auto& pareto = std::get<XyFigure>(report.pictures.front());
  EXPECT_EQ(pareto.title, "Drives for the demand");
  const XySeries& front = pareto.series[1];
  ASSERT_FALSE(front.x.empty());
  EXPECT_TRUE(std::ranges::is_sorted(front.x) && std::ranges::is_sorted(front.y));
}

}  // namespace
}  // namespace torsio
