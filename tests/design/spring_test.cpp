#include "torsio/design/spring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "design/preferred_sizes.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

SpringDemand demand_120() {
  return {.torque_Nm = 120.0,
          .angle_rad = 120.0 / deg_from_rad(19.8),
          .largest_diameter_m = 0.080,
          .largest_length_m = 0.120,
          .material = read_materials({}).front(),
          .washers = read_washers({})};
}

TEST(SpringFormulae, AreThoseOfTextbooks) {
  // Solid rod: k = G π d⁴ / (32 L), tau = 16 T / (π d³).
  EXPECT_NEAR(rod_stiffness(0.010, 0.0, 0.1, 80e9), 785.398, 1e-3);
  EXPECT_NEAR(rod_stress(0.010, 0.0, 100.0), 509.296e6, 1e3);
  // Thin tube: J = 2 π r³ t, tau = T / (2 π r² t), within the share of the wall.
  EXPECT_NEAR(rod_stiffness(0.0401, 0.0399, 0.1, 80e9) /
                  (80e9 * 2.0 * 3.14159265 * std::pow(0.020, 3) * 0.1e-3 / 0.1),
              1.0, 1e-4);
  EXPECT_NEAR(
      rod_stress(0.0401, 0.0399, 10.0) / (10.0 / (2.0 * 3.14159265 * 0.020 * 0.020 * 0.1e-3)), 1.0,
      5e-3);
  EXPECT_NEAR(buckling_stress(0.012, 0.01006, 206e9, 0.3), 3831e6, 15e6);
  EXPECT_NEAR(coil_rate(0.003, 0.012, 5.0, 79.3e9), 92.9e3, 50.0);
  // Factor of Wahl for c = 4: 1.40375.
  EXPECT_NEAR(coil_stress(0.003, 0.012, 100.0),
              1.40375 * 8.0 * 100.0 * 0.012 / (3.14159265 * 27e-9), 1e3);
  const BellevilleWasher washer = read_washers({}).back();
  const double angle = 1e-5;
  EXPECT_NEAR(disc_lever_torque(washer, 0.020, 0.3e-3, 2, 6, angle) / angle,
              2.0 * 0.020 * 0.020 * 2.0 * rate(washer, 0.3e-3) / 6.0, 1e-3);
}

TEST(DesignedSpring, RodOf120NmHasTheDimensionsOfTheFormula) {
  const SpringDesign rod = design_spring(demand_120(), SpringKind::rod);
  ASSERT_TRUE(rod.is_feasible);
  EXPECT_NEAR(rod.outer_m, 9.6e-3, 1e-9) << "9.56 mm on the grid";
  EXPECT_NEAR(rod.length_m, 0.0583, 1e-9);
  // The stiffness is that of the rounded length.
  EXPECT_NEAR(rod.stiffness_Nm_rad, rod_stiffness(0.0096, 0.0, 0.0583, 79.3e9), 1e-6);
  EXPECT_NEAR(rod.stiffness_Nm_rad / deg_from_rad(19.8), 1.0, 1e-3);
}

TEST(DesignedSpring, TubeHasTheBoreAndDoesNotBuckle) {
  SpringDemand demand = demand_120();
  demand.bore_m = 0.010;
  const SpringDesign tube = design_spring(demand, SpringKind::tube);
  ASSERT_TRUE(tube.is_feasible);
  EXPECT_GE(tube.inner_m, 0.010 - 1e-9);
  EXPECT_NEAR(tube.outer_m, 0.012, 2e-4);
  EXPECT_NEAR(std::remainder(tube.inner_m, 0.1e-3), 0.0, 1e-9) << "a drill";
  EXPECT_NEAR(tube.stiffness_Nm_rad,
              rod_stiffness(tube.outer_m, tube.inner_m, tube.length_m, 79.3e9), 1e-6);
  EXPECT_NEAR(tube.stiffness_Nm_rad / deg_from_rad(19.8), 1.0, 1e-3);
  EXPECT_LE(rod_stress(tube.outer_m, tube.inner_m, 120.0), 700e6 * (1.0 + 1e-9));
  demand.bore_m = 0.017;  // the wall of 18 mm buckles
  const SpringDesign wide = design_spring(demand, SpringKind::tube);
  EXPECT_FALSE(wide.is_feasible);
  EXPECT_NE(wide.infeasible.find("the bore of 17 mm would have to move to 1"), std::string::npos)
      << wide.infeasible;
}

TEST(DesignedSpring, BucklingStressIsPrintedForThinWallsAlone) {
  SpringDemand demand = demand_120();
  const auto buckling = [&] {
    return spring_report(demand, design_spring(demand, SpringKind::tube))
        .at("spring", "buckling_stress");
  };
  EXPECT_TRUE(std::isnan(buckling().value)) << "thick wall: " << buckling().value;
  EXPECT_NE(buckling().remark.find("yields first"), std::string::npos) << buckling().remark;
  demand.bore_m = 0.0145;
  demand.safety = 1.0;
  demand.largest_length_m = 0.2;
  const DesignReport thin = spring_report(demand, design_spring(demand, SpringKind::tube));
  EXPECT_GE(thin.at("spring", "buckling_stress").value,
            2.0 * thin.at("spring", "shear_stress").value);
}

TEST(DesignedSpring, KindsAreComparedInATable) {
  SpringDemand demand = demand_120();
  demand.largest_diameter_m = 0.2;
  const auto kinds = design_springs(demand);
  ASSERT_EQ(kinds.size(), 4U);
  const SpringDesign lightest = lightest_spring(kinds);
  EXPECT_EQ(lightest.kind, design_lightest_spring(demand).kind);
  const DesignReport report = spring_report(demand, lightest, kinds);
  ASSERT_EQ(report.tables.size(), 1U);
  int chosen = 0;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const DesignAlternative& row = report.tables[0].rows.at(i);
    EXPECT_EQ(row.name, name_of(kinds[i].kind));
    EXPECT_EQ(row.infeasible.empty(), kinds[i].is_feasible);
    chosen += row.is_chosen ? 1 : 0;
    if (!kinds[i].is_feasible) continue;
    EXPECT_GE(row.figures.at(0).value, 1e3 * lightest.mass_kg);
    EXPECT_LE(kinds[i].envelope_m, demand.largest_diameter_m);
    EXPECT_NEAR(row.figures.at(0).value, 1e3 * kinds[i].mass_kg, 1e-9);
  }
  EXPECT_EQ(chosen, 1);
  // Where the kind does not fit, the others are compared, and each reason is there once.
  demand.bore_m = 0.01;
  const auto with_bore = design_springs(demand);
  const std::string text =
      design_text(spring_report(demand, with_bore.front(), with_bore));  // a rod has no bore
  EXPECT_EQ(text.find("rod: infeasible"), text.rfind("rod: infeasible")) << text;
  EXPECT_EQ(text.find("chosen"), std::string::npos) << text;
  demand.bore_m = 0.0;
  demand.largest_diameter_m = 0.08;
  const auto narrow = design_springs(demand);
  EXPECT_NE(narrow[2].infeasible.find(
                "coils: infeasible: the largest diameter of 80 mm would have to move to "),
            std::string::npos)
      << narrow[2].infeasible;
}

TEST(PreferredSizes, WiresAreThoseOfR20AndBoresThoseOfDrills) {
  const auto wires = preferred_wires_mm();
  EXPECT_TRUE(std::ranges::is_sorted(wires));
  // A series R20 rises by 12.2 %; the rounding of R'20 moves each by 2 % at most.
  for (std::size_t i = 1; i < wires.size(); ++i)
    EXPECT_NEAR(wires[i] / wires[i - 1], std::pow(10.0, 1.0 / 20.0), 0.03) << wires[i];
  for (const auto& [wanted_mm, drill_mm] : {std::pair{2.69192, 2.6},
                                            {2.7, 2.7},
                                            {14.3, 14.25},
                                            {31.99, 31.75},
                                            {33.7, 33.5},
                                            {60.9, 60.0},
                                            {0.05, 0.0}})
    EXPECT_NEAR(drill_at_most_m(1e-3 * wanted_mm), 1e-3 * drill_mm, 1e-9) << wanted_mm;
  EXPECT_NEAR(drill_below_m(0.0027), 0.0026, 1e-9);
  EXPECT_NEAR(drill_below_m(0.014), 0.0139, 1e-9);
  EXPECT_NEAR(drill_below_m(0.01425), 0.014, 1e-9);
}

TEST(DesignedSpring, NamesTheLengthThatTheRodWouldNeed) {
  SpringDemand demand = demand_120();
  demand.largest_length_m = 0.040;
  const SpringDesign rod = design_spring(demand, SpringKind::rod);
  EXPECT_FALSE(rod.is_feasible);
  EXPECT_NE(rod.infeasible.find("the largest length of 40 mm would have to move to 58."),
            std::string::npos)
      << rod.infeasible;
}

/// Stiffness of the midline of the simulated static cycle between +- the largest deflection that all
/// cycles reach, with the friction on.
double simulated_secant(const DataSheet& sheet, double angle_rad) {
  const Recording cycle = simulate(sheet, {.experiment = "static-cycle", .with_truth = true});
  const auto& torque = cycle.channel("torque_Nm").values;
  const std::vector<double> twist = measured_twist(sheet, cycle);
  // Mean of rising and falling branch at +- 0.9 of the deflection, of all crossings.
  const auto mean_at = [&](double level) {
    double sum = 0.0;
    int rising = 0;
    double falling_sum = 0.0;
    int falling = 0;
    for (std::size_t i = 1; i < twist.size(); ++i) {
      if (twist[i - 1] < level && twist[i] >= level) {
        sum += torque[i];
        ++rising;
      } else if (twist[i - 1] > level && twist[i] <= level) {
        falling_sum += torque[i];
        ++falling;
      }
    }
    EXPECT_GT(rising, 0);
    EXPECT_GT(falling, 0);
    return 0.5 * (sum / rising + falling_sum / falling);
  };
  const double level = 0.9 * angle_rad;
  return (mean_at(level) - mean_at(-level)) / (2.0 * level);
}

TEST(DesignedSpring, AsASheetHasTheStiffnessOfTheDesignInASimulatedStaticCycle) {
  for (const SpringKind kind : {SpringKind::rod, SpringKind::coils}) {
    SpringDemand demand = demand_120();
    if (kind == SpringKind::coils) demand.largest_diameter_m = 0.2;
    const SpringDesign design = design_spring(demand, kind);
    ASSERT_TRUE(design.is_feasible) << design.infeasible;
    const DataSheet sheet =
        parse_data_sheet(data_sheet_yaml(spring_sheet(demand, design, "joint")), "joint.yaml");
    EXPECT_NEAR(simulated_secant(sheet, demand.angle_rad) / design.stiffness_Nm_rad, 1.0, 0.02)
        << name_of(kind);
  }
}

TEST(DesignedSpring, OfDiscsIsATableInItsSheet) {
  SpringDemand demand = demand_120();
  demand.torque_Nm = 28.0;
  demand.angle_rad = rad_from_deg(5.0);
  demand.largest_diameter_m = 0.15;
  const SpringDesign discs = design_spring(demand, SpringKind::discs);
  ASSERT_TRUE(discs.is_feasible) << discs.infeasible;
  EXPECT_NEAR(discs.stiffness_Nm_rad * demand.angle_rad, 28.0, 1e-6);
  const DataSheet sheet =
      parse_data_sheet(data_sheet_yaml(spring_sheet(demand, discs, "joint")), "joint.yaml");
  EXPECT_NEAR(simulated_secant(sheet, demand.angle_rad) / discs.stiffness_Nm_rad, 1.0, 0.02);
}

TEST(DesignedSpring, CoilsStayPreloadedWithinTheirStress) {
  SpringDemand demand = demand_120();
  demand.torque_Nm = 50.0;
  demand.angle_rad = rad_from_deg(5.0);
  demand.largest_diameter_m = 0.12;
  const SpringDesign coils = design_spring(demand, SpringKind::coils);
  ASSERT_TRUE(coils.is_feasible) << coils.infeasible;
  const DesignReport report = spring_report(demand, coils);
  const auto value = [&](const char* name) { return report.at("spring", name).value; };
  EXPECT_GT(value("preload_travel"), value("travel"));
  EXPECT_LE(value("shear_stress"), 700.0);
  EXPECT_TRUE(std::ranges::count(preferred_wires_mm(), value("wire_diameter")) == 1);
  const double radius = value("radius") * 1e-3;
  EXPECT_NEAR(value("springs") * value("rate") * 1e3 * radius * radius *
                  std::sin(demand.angle_rad) * std::cos(demand.angle_rad),
              50.0, 1e-6);
}

TEST(DesignedSpring, ReportsResolutionAndResonance) {
  const SpringDemand demand = demand_120();
  const SpringDesign rod = design_spring(demand, SpringKind::rod);
  const DesignReport report = spring_report(demand, rod);
  EXPECT_NEAR(report.at("joint", "torque_resolution").value,
              rod.stiffness_Nm_rad * 2.0 * 3.14159265 / 524288.0, 1e-6);
  EXPECT_NEAR(report.at("joint", "resonance").value,
              std::sqrt(rod.stiffness_Nm_rad / 0.15) / (2.0 * 3.14159265), 1e-6);
}

TEST(DesignedSpring, RefusesWhatCannotBe) {
  SpringDemand demand = demand_120();
  demand.bore_m = 0.1;
  EXPECT_THROW((void)design_spring(demand, SpringKind::rod), UsageError);
  demand = demand_120();
  demand.angle_rad = -0.1;
  EXPECT_THROW((void)design_spring(demand, SpringKind::rod), UsageError);
  EXPECT_THROW((void)spring_kind("wire"), UsageError);
}

}  // namespace
}  // namespace torsio
