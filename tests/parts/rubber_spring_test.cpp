#include "parts/rubber_spring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "parts/second_stage.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kPositive = 0.5 / rad_from_deg(12.4);  // secants at 0.5 Nm, specification 4.4
constexpr double kNegative = 0.5 / rad_from_deg(11.3);
constexpr double kStiffness = 0.5 * (kPositive + kNegative);
constexpr std::array<double, 3> kRelaxation_s = {2.0, 0.3, 0.03};

constexpr RubberSpring::Parameters kRubber = {
    .stiffness_Nm_rad = kStiffness,
    .asymmetry_Nm_rad = 0.5 * (kPositive - kNegative),
    .blend_rad = rad_from_deg(2.0),
    .elastic_share = 0.964,
    .branches = {.stiffness_Nm_rad = {0.05 * kStiffness, 0.05 * kStiffness, 0.05 * kStiffness},
                 .relaxation_s = kRelaxation_s},
    .slip = {.constant_Nm = 0.018,
             .share = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0},
             .break_away_rad = {rad_from_deg(0.4), rad_from_deg(1.2), rad_from_deg(3.0)}}};

RubberSpring without_slip() {
  auto parameters = kRubber;
  parameters.slip.constant_Nm = 0.0;
  return RubberSpring(parameters);
}

TEST(RubberSpring, MeetsTheMeasuredSecantsInTheSlowTest) {
  RubberSpring rubber(kRubber);
  for (const double end_deg : {12.4, -11.3}) {
    rubber.set_period(1.0);
    rubber.reset();
    double torque_Nm = 0.0;
    for (int i = 1; i <= 100000; ++i) torque_Nm = rubber.step(rad_from_deg(end_deg) * i * 1e-5, 0);
    EXPECT_NEAR(std::abs(torque_Nm), 0.5, 1e-4) << end_deg;
  }
}

TEST(RubberSpring, EachBranchRelaxesByItsOwnExponential) {
  for (std::size_t alone = 0; alone < 3; ++alone) {
    auto parameters = kRubber;
    parameters.slip.constant_Nm = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      if (i != alone) parameters.branches.stiffness_Nm_rad[i] = 0.0;
    }
    const double stiffness = parameters.branches.stiffness_Nm_rad[alone];
    const double relaxation_s = kRelaxation_s[alone];
    const double rate_rad_s = 0.7;
    const double ramp_s = 0.1;
    for (const int steps : {1, 7, 1000}) {
      RubberSpring rubber(parameters);
      rubber.set_period(ramp_s / steps);
      for (int i = 1; i <= steps; ++i) rubber.step(rate_rad_s * ramp_s * i / steps, rate_rad_s);
      // A ramp from rest: z = k T v (1 - exp(-t / T)), then a hold.
      const double top_Nm =
          stiffness * relaxation_s * rate_rad_s * (1.0 - std::exp(-ramp_s / relaxation_s));
      EXPECT_NEAR(rubber.friction_torque(), top_Nm, 1e-13) << alone << ", " << steps << " steps";
      EXPECT_NEAR(rubber.friction_energy(), 0.5 * top_Nm * top_Nm / stiffness, 1e-13);
      for (int i = 0; i < steps; ++i) rubber.step(rate_rad_s * ramp_s, 0.0);
      EXPECT_NEAR(rubber.friction_torque(), top_Nm * std::exp(-ramp_s / relaxation_s), 1e-13);
    }
  }
}

TEST(RubberSpring, StepHalvedBringsAQuarterOfTheError) {
  const auto torque_after = [](int steps) {
    RubberSpring rubber = without_slip();
    rubber.set_period(1.0 / steps);
    double torque_Nm = 0.0;
    for (int i = 1; i <= steps; ++i) torque_Nm = rubber.step(0.1 * std::sin(7.0 * i / steps), 0.0);
    return torque_Nm;
  };
  const double exact_Nm = torque_after(1 << 16);
  const double coarse_Nm = std::abs(torque_after(64) - exact_Nm);
  const double fine_Nm = std::abs(torque_after(128) - exact_Nm);
  EXPECT_GT(coarse_Nm, 1e-8);
  EXPECT_NEAR(std::log2(coarse_Nm / fine_Nm), 2.0, 0.1);
}

TEST(RubberSpring, ElasticEnergyIsTheIntegralOfTheCurve) {
  const RubberSpring rubber(kRubber);
  for (const double end_deg : {-20.0, -2.0, -0.05, 0.03, 0.0401, 1.0, 12.4, 60.0}) {
    const double end_rad = rad_from_deg(end_deg);
    constexpr int kPanels = 2000;
    double simpson_J = 0.0;
    for (int i = 0; i < kPanels; ++i) {
      const double from = end_rad * i / kPanels;
      const double width = end_rad / kPanels;
      simpson_J += width / 6.0 *
                   (rubber.elastic_torque(from) + 4.0 * rubber.elastic_torque(from + 0.5 * width) +
                    rubber.elastic_torque(from + width));
    }
    EXPECT_NEAR(rubber.elastic_energy(end_rad), simpson_J, 1e-11 * simpson_J) << end_deg;
  }
  EXPECT_EQ(rubber.elastic_energy(0.0), 0.0);
}

TEST(RubberSpring, TakesWorkOnEveryClosedPathAndNeverGivesLossBack) {
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    RubberSpring rubber(kRubber);
    const auto path = random_closed_path(rad_from_deg(0.1 + 12.0 * random.uniform()), 4000, random);
    const double dt_s = std::pow(10.0, -5.0 + 3.0 * random.uniform());
    const WorkBook book = walk(rubber, path, dt_s, 3);
    EXPECT_GT(book.work_J, book.stored_J) << "path " << i << ", step " << dt_s;
    EXPECT_LE(book.largest_gain_J, 1e-9 * book.throughput_J) << "path " << i << ", step " << dt_s;
    EXPECT_NEAR(book.work_J - book.stored_J, book.friction_loss_J, 1e-4 * book.throughput_J);
  }
}

TEST(RubberSpring, StaticInverseHoldsTheTorqueAfterReset) {
  RubberSpring rubber(kRubber);
  rubber.set_period(1e-3);
  for (const double torque_Nm : {-2.0, -0.5, -1e-3, 0.0, 1e-3, 0.5, 2.0}) {
    const double deflection_rad = rubber.deflection(torque_Nm);
    rubber.reset(deflection_rad);
    EXPECT_NEAR(rubber.step(deflection_rad, 0.0), torque_Nm, 1e-12);
    EXPECT_EQ(rubber.friction_energy(), 0.0);
  }
}

TEST(RubberSpring, NoIncrementIsStifferThanTheSteepest) {
  double largest = 0.0;
  for (double deg = -6.0; deg < 6.0; deg += 0.05) {
    RubberSpring rubber(kRubber);
    rubber.reset(rad_from_deg(deg));
    const double before_Nm = rubber.step(rad_from_deg(deg), 0.0);
    largest = std::max(largest, (rubber.step(rad_from_deg(deg) + 1e-7, 0.0) - before_Nm) / 1e-7);
  }
  const double steepest = RubberSpring(kRubber).steepest(0.5);
  EXPECT_LE(largest, steepest * (1.0 + 1e-6));
  EXPECT_GE(largest, 0.999 * steepest);
}

TEST(RubberSpring, RefusesImpossibleParameters) {
  const auto refuses = [](auto&& spoil) {
    auto parameters = kRubber;
    spoil(parameters);
    EXPECT_THROW(RubberSpring{parameters}, Error);
  };
  refuses([](auto& of) { of.stiffness_Nm_rad = 0.0; });
  refuses([](auto& of) { of.asymmetry_Nm_rad = 0.9 * of.stiffness_Nm_rad; });
  refuses([](auto& of) { of.asymmetry_Nm_rad = std::nan(""); });
  refuses([](auto& of) { of.blend_rad = 0.0; });
  refuses([](auto& of) { of.elastic_share = -0.1; });
  refuses([](auto& of) { of.branches.relaxation_s[1] = 0.0; });
  refuses([](auto& of) { of.branches.stiffness_Nm_rad[2] = -1.0; });
  refuses([](auto& of) { of.slip.break_away_rad[0] = 0.0; });
}

}  // namespace
}  // namespace torsio
