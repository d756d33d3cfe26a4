#include "parts/elastic_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr ElasticCurve::Parameters kTwoStages = {.stiffness_Nm_rad = 570.0,
                                                 .half_gap_rad = 2.6e-4,
                                                 .asymmetry = 0.03,
                                                 .stage_rad = 0.0873,
                                                 .stage_stiffness_Nm_rad = 1146.0};

double slope(const ElasticCurve& curve, double deflection_rad) {
  constexpr double kStep = 1e-7;
  return (curve.torque(deflection_rad + kStep) - curve.torque(deflection_rad - kStep)) /
         (2.0 * kStep);
}

TEST(ElasticCurve, HasTheSlopesOfItsStages) {
  const ElasticCurve curve(kTwoStages);
  EXPECT_NEAR(slope(curve, 0.05), 570.0 * 1.03, 1e-3);
  EXPECT_NEAR(slope(curve, -0.05), 570.0 * 0.97, 1e-3);
  EXPECT_NEAR(slope(curve, 0.12), 570.0 * 1.03 + 1146.0, 1e-3);
  EXPECT_NEAR(slope(curve, -0.12), 570.0 * 0.97 + 1146.0, 1e-3);
}

TEST(ElasticCurve, IsSlackInTheMiddleOfItsPlay) {
  const ElasticCurve curve(kTwoStages);
  EXPECT_EQ(curve.torque(0.0), 0.0);
  EXPECT_LT(slope(curve, 0.0), 1e-3);
  EXPECT_NEAR(curve.torque(0.02), 570.0 * 1.03 * (0.02 - 2.6e-4), 1e-9);
}

TEST(ElasticCurve, IsContinuousWhereThePlayEnds) {
  const ElasticCurve curve(kTwoStages);
  const double edge = 20.0 * 2.6e-4;
  EXPECT_NEAR(curve.torque(std::nextafter(edge, 0.0)), curve.torque(edge), 1e-12);
}

TEST(ElasticCurve, EnergyIsTheIntegralOfTheTorque) {
  const ElasticCurve curve(kTwoStages);
  for (const double end : {1e-4, 3e-4, 0.01, 0.087, 0.15, -2e-4, -0.02, -0.14}) {
    constexpr int kIntervals = 20000;
    double integral_J = 0.0;
    for (int i = 0; i < kIntervals; ++i) {
      integral_J += curve.torque(end * (i + 0.5) / kIntervals) * end / kIntervals;
    }
    EXPECT_NEAR(curve.energy(end), integral_J, 1e-6 * integral_J + 1e-12) << end;
  }
}

TEST(ElasticCurve, DeflectionInvertsTheTorque) {
  const ElasticCurve curve(kTwoStages);
  for (const double torque_Nm : {-90.0, -20.0, -0.01, 0.3, 49.0, 120.0}) {
    EXPECT_NEAR(curve.torque(curve.deflection(torque_Nm)), torque_Nm, 1e-9);
  }
}

TEST(ElasticCurve, RefusesImpossibleParameters) {
  EXPECT_THROW(ElasticCurve({.stiffness_Nm_rad = 0.0}), Error);
  EXPECT_THROW(ElasticCurve({.stiffness_Nm_rad = std::nan("")}), Error);
  EXPECT_THROW(ElasticCurve({.stiffness_Nm_rad = 1.0, .half_gap_rad = -1e-3}), Error);
  EXPECT_THROW(ElasticCurve({.stiffness_Nm_rad = 1.0, .asymmetry = 1.0}), Error);
  EXPECT_THROW(ElasticCurve({.stiffness_Nm_rad = 1.0, .stage_rad = std::nan("")}), Error);
}

}  // namespace
}  // namespace torsio
