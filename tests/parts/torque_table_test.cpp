#include "parts/torque_table.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "parts/spring.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"

namespace torsio {
namespace {

using test::kNaN;

const std::vector<TorqueTable::Point> kPoints = {{-0.10, -70.0}, {-0.04, -20.0}, {-0.001, -0.2},
                                                 {0.002, 0.1},   {0.05, 30.0},   {0.09, 80.0}};

TEST(TorqueTable, IsStraightBetweenItsPointsAndBeyondThem) {
  const TorqueTable table(kPoints);
  for (const TorqueTable::Point& point : kPoints)
    EXPECT_NEAR(table.torque(point.deflection_rad), point.torque_Nm, 1e-12);
  EXPECT_NEAR(table.torque(0.026), 0.5 * (0.1 + 30.0), 1e-12);
  EXPECT_NEAR(table.torque(0.10), 80.0 + 0.01 * 50.0 / 0.04, 1e-12);
  EXPECT_NEAR(table.torque(-0.13), -70.0 - 0.03 * 50.0 / 0.06, 1e-12);
  EXPECT_NEAR(table.steepest(), 50.0 / 0.04, 1e-9);
  EXPECT_NEAR(table.flattest(), 0.3 / 0.003, 1e-9);
}

TEST(TorqueTable, EnergyIsTheIntegralOfTheTorque) {
  const TorqueTable table(kPoints);
  for (const double end_rad : {0.001, 0.03, 0.2, -0.0005, -0.02, -0.15}) {
    constexpr int kIntervals = 20000;
    double integral_J = 0.0;
    for (int i = 0; i < kIntervals; ++i)
      integral_J += table.torque(end_rad * (i + 0.5) / kIntervals) * end_rad / kIntervals;
    EXPECT_NEAR(table.energy(end_rad), integral_J, 1e-6 * std::abs(integral_J) + 1e-9) << end_rad;
  }
  EXPECT_EQ(table.energy(0.0), 0.0);
}

TEST(TorqueTable, DeflectionInvertsTheTorque) {
  const TorqueTable table(kPoints);
  for (const double torque_Nm : {-200.0, -70.0, -3.0, -0.1, 0.0, 0.05, 12.0, 80.0, 300.0})
    EXPECT_NEAR(table.torque(table.deflection(torque_Nm)), torque_Nm, 1e-10);
}

TEST(TorqueTable, RefusesWhatIsNoElasticCurve) {
  const auto refusal = [](const std::vector<TorqueTable::Point>& points) {
    return test::error_message([&] { TorqueTable table(points); });
  };
  EXPECT_EQ(refusal(kPoints), "");
  EXPECT_NE(refusal({}).find("2 to 10000 points, found 0"), std::string::npos);
  EXPECT_NE(refusal({{0.0, 0.0}}).find("2 to 10000 points, found 1"), std::string::npos);
  EXPECT_NE(refusal(std::vector<TorqueTable::Point>(10001)).find("found 10001"), std::string::npos);
  EXPECT_NE(refusal({{-0.1, -1.0}, {0.1, 1.0}, {0.1, 2.0}}).find("as point 3"), std::string::npos);
  EXPECT_NE(refusal({{-0.1, -1.0}, {0.0, 0.0}, {0.1, 0.0}}).find("as point 3"), std::string::npos);
  EXPECT_NE(refusal({{0.1, 1.0}, {-0.1, -1.0}}).find("as point 2"), std::string::npos);
  EXPECT_NE(refusal({{0.01, 1.0}, {0.1, 2.0}}).find("both sides of zero"), std::string::npos);
  EXPECT_NE(refusal({{-0.1, 1.0}, {0.1, 2.0}}).find("both sides of zero"), std::string::npos);
  EXPECT_NE(refusal({{-0.1, -1.0}, {kNaN, 2.0}}).find("finite numbers"), std::string::npos);
  EXPECT_NE(refusal({{-1e-320, -1.0}, {0.0, 1e300}}).find("slope"), std::string::npos);
}

TEST(Spring, TakesItsElasticCurveFromATable) {
  const Spring::Parameters parts = {
      .elastic = {.stiffness_Nm_rad = 600.0},
      .table = kPoints,
      .friction = MaxwellSlip<4>::Parameters{.constant_Nm = 1.0,
                                             .share = {0.25, 0.25, 0.25, 0.25},
                                             .break_away_rad = {0.001, 0.002, 0.003, 0.004}}};
  Spring spring(parts);
  EXPECT_TRUE(spring.has_table());
  const TorqueTable table(kPoints);
  double deflection_rad = 0.0;
  for (; deflection_rad < 0.03; deflection_rad += 1e-4) {
    const double torque_Nm = spring.step(deflection_rad, 0.0);
    EXPECT_NEAR(torque_Nm - spring.friction_torque(), table.torque(deflection_rad), 1e-12);
  }
  EXPECT_EQ(spring.elastic_energy(0.03), table.energy(0.03));
  EXPECT_EQ(spring.deflection(25.0), table.deflection(25.0));
  EXPECT_GT(spring.steepest(0.0), table.steepest());
  Spring::Parameters without = parts;
  without.table.clear();
  EXPECT_NEAR(Spring(without).deflection(30.0), 0.05, 1e-9);
}

}  // namespace
}  // namespace torsio
