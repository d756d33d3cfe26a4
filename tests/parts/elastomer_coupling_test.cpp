#include "parts/elastomer_coupling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "parts/second_stage.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kPerDeg = deg_from_rad(1.0);  // Nm/deg in Nm/rad
constexpr double kGain = 1.87e-3;              // paper 003, Eq. 3

constexpr ElastomerCoupling::Parameters kBonded = {
    .stiffness_Nm_rad = 0.3829 * kPerDeg,
    .branches = {.stiffness_Nm_rad = {0.7701 * kPerDeg, 0.5840 * kPerDeg, 0.15 * kPerDeg},
                 .relaxation_s = {6.0003 / 0.7701, 0.2252 / 0.5840, 0.01}},
    .output_Nm = {kGain, -0.649e-7, -0.141e-10},
    .slip = {.constant_Nm = 0.30,
             .share = {0.08 / 0.30, 0.10 / 0.30, 0.12 / 0.30},
             .break_away_rad = {rad_from_deg(0.2), rad_from_deg(0.8), rad_from_deg(2.5)}}};

ElastomerCoupling::Parameters unbonded() {
  auto parameters = kBonded;
  parameters.bonded = false;
  return parameters;
}

ElastomerCoupling::Parameters linear() {
  auto parameters = kBonded;
  parameters.output_Nm = {1.0, 0.0, 0.0};
  parameters.slip.constant_Nm = 0.0;
  return parameters;
}

/// Model (a) of paper 003: no fast branch to speak of, nothing nonlinear.
ElastomerCoupling::Parameters model_a() {
  auto parameters = linear();
  parameters.branches.stiffness_Nm_rad[2] = 1e-6 * kPerDeg;
  return parameters;
}

TEST(CreepChain, FindsTheKelvinVoigtElementsThatThePaperPrints) {
  const CreepChain chain(model_a().stiffness_Nm_rad, model_a().branches);
  EXPECT_NEAR(chain.stiffness() / kPerDeg, 1.737, 1e-3);
  EXPECT_NEAR(chain.element_stiffness()[0] / kPerDeg, 0.564, 1e-3);
  EXPECT_NEAR(chain.element_damping()[0] / kPerDeg, 13.46, 0.01);
  EXPECT_NEAR(chain.element_stiffness()[1] / kPerDeg, 3.803, 4e-3);
  EXPECT_NEAR(chain.element_damping()[1] / kPerDeg, 2.172, 2e-3);
  EXPECT_NEAR(chain.element_stiffness()[0] / chain.element_damping()[0], 0.041902, 1e-5);
  EXPECT_NEAR(chain.element_stiffness()[1] / chain.element_damping()[1], 1.750921, 4e-4);
}

TEST(ElastomerCoupling, HasTheFrequencyResponseOfModelA) {
  struct Point {
    double frequency_Hz, magnitude_Nm_deg, phase_deg;
  };
  for (const Point& point : {Point{0.4, 1.4716, 13.00}, {1.0, 1.6665, 7.64}, {4.0, 1.7320, 2.10}}) {
    ElastomerCoupling coupling(model_a());
    constexpr double kStep_s = 1e-3;
    coupling.set_period(kStep_s);
    coupling.reset();
    const double omega = 2.0 * std::numbers::pi * point.frequency_Hz;
    std::complex<double> sum = 0.0;
    for (int i = 1; i <= 100000; ++i) {  // 90 s of settling, then 10 s of whole periods
      const double turn = omega * kStep_s * i;
      const double torque_Nm = coupling.step(rad_from_deg(1.0) * std::sin(turn), 0.0);
      if (i > 90000) sum += torque_Nm * std::polar(2.0 / 10000, -turn);
    }
    const std::complex<double> response = sum * std::complex<double>(0.0, 1.0);
    EXPECT_NEAR(std::abs(response), point.magnitude_Nm_deg, 1e-3 * point.magnitude_Nm_deg);
    EXPECT_NEAR(deg_from_rad(std::arg(response)), point.phase_deg, 0.01);
  }
}

TEST(ElastomerCoupling, EqualsItsMaxwellFormAtAnyStep) {
  Random random(11);
  for (const double dt_s : {1e-5, 1e-3, 0.1, 10.0}) {
    ElastomerCoupling coupling(linear());
    MaxwellBranches<3> branches(linear().branches);
    coupling.set_period(dt_s);
    branches.set_period(dt_s);
    coupling.reset();
    double last_rad = 0.0;
    for (const double u : random_closed_path(0.1, 5000, random)) {
      const double maxwell_Nm = linear().stiffness_Nm_rad * u + branches.step(u - last_rad);
      ASSERT_NEAR(coupling.step(u, 0.0), maxwell_Nm, 1e-11) << dt_s;
      last_rad = u;
    }
  }
}

TEST(ElastomerCoupling, StepHalvedBringsAQuarterOfTheError) {
  for (const bool bonded : {true, false}) {
    const auto torque_after = [bonded](int steps) {
      auto parameters = kBonded;
      parameters.bonded = bonded;
      parameters.slip.constant_Nm = 0.0;
      ElastomerCoupling coupling(parameters);
      coupling.set_period(1.0 / steps);
      coupling.reset();
      double torque_Nm = 0.0;
      for (int i = 1; i <= steps; ++i)
        torque_Nm = coupling.step(0.06 * std::sin(2.4 * i / steps), 0);
      return torque_Nm;
    };
    const double exact_Nm = torque_after(1 << 16);
    const double coarse_Nm = std::abs(torque_after(512) - exact_Nm);
    const double fine_Nm = std::abs(torque_after(1024) - exact_Nm);
    EXPECT_GT(coarse_Nm, 1e-9);
    EXPECT_NEAR(std::log2(coarse_Nm / fine_Nm), 2.0, 0.2) << bonded;
  }
}

TEST(ElastomerCoupling, OutputCurveIsThePapersWithinItsRangeAndConstantOutside) {
  const ElastomerCoupling coupling(kBonded);
  for (const double w : {-8000.0, -3000.0, -10.0, 0.0, 500.0, 5000.0}) {
    const double paper_Nm = kGain * w - 0.649e-7 * w * w - 0.141e-10 * w * w * w;
    EXPECT_NEAR(coupling.output_torque(kGain * w), paper_Nm, 1e-12);
  }
  constexpr double kPaperOffset_Nm = 0.0309;  // left out: at rest there is no torque
  EXPECT_NEAR(coupling.output_torque(100.0), 6.02 - kPaperOffset_Nm, 1e-3);
  EXPECT_NEAR(coupling.output_torque(-100.0), -11.9 - kPaperOffset_Nm, 0.01);
  EXPECT_EQ(coupling.output_torque(kGain * 5290.0), coupling.output_torque(100.0));
  EXPECT_LT(coupling.output_torque(kGain * 5280.0), coupling.output_torque(100.0));
  EXPECT_EQ(coupling.output_torque(kGain * -8359.0), coupling.output_torque(-100.0));
  EXPECT_GT(coupling.output_torque(kGain * -8350.0), coupling.output_torque(-100.0));
}

TEST(ElastomerCoupling, TakesWorkOnEveryClosedPathAndNeverGivesLossBack) {
  Random random(7);
  for (int i = 0; i < 90; ++i) {
    auto parameters = i % 3 == 0 ? kBonded : unbonded();
    if (i % 3 == 2) parameters.creep_per_cycle = 0.01;
    ElastomerCoupling coupling(parameters);
    const auto path = random_closed_path(rad_from_deg(0.1 + 12.0 * random.uniform()), 8000, random);
    const double dt_s = std::pow(10.0, -5.0 + 3.0 * random.uniform());
    const WorkBook book = walk(coupling, path, dt_s, 3);
    EXPECT_GT(book.work_J, book.stored_J) << "path " << i << ", step " << dt_s;
    // The trapezoids overestimate the work that a lobe returns at its release by up to
    // k du^2 / 8; exactly, there is no gain.
    EXPECT_LE(book.largest_gain_J, 1e-6 * book.throughput_J) << "path " << i << ", step " << dt_s;
  }
}

TEST(ElastomerCoupling, StaticInverseHoldsTheTorqueAfterReset) {
  for (const auto& parameters : {kBonded, unbonded(), linear()}) {
    ElastomerCoupling coupling(parameters);
    coupling.set_period(1e-3);
    for (const double torque_Nm : {-11.0, -5.0, -1e-3, 0.0, 1e-3, 5.0, 5.98}) {
      const double deflection_rad = coupling.deflection(torque_Nm);
      coupling.reset(deflection_rad);
      EXPECT_NEAR(coupling.friction_torque(), torque_Nm, 1e-9);
      for (int i = 0; i < 10; ++i) EXPECT_NEAR(coupling.step(deflection_rad, 0.0), torque_Nm, 1e-9);
    }
  }
}

TEST(ElastomerCoupling, UnbondedLobesLetGoAndCreepBackBeforeTheyCarryAgain) {
  ElastomerCoupling coupling(unbonded());
  constexpr double kStep_s = 1e-3;
  coupling.set_period(kStep_s);
  coupling.reset();
  const double top_rad = rad_from_deg(3.0);
  const auto ramp = [&](double from_rad, double to_rad) {
    double torque_Nm = 0.0;
    for (int i = 1; i <= 100; ++i)
      torque_Nm = coupling.step(from_rad + (to_rad - from_rad) * i / 100.0, 0.0);
    return torque_Nm;
  };
  const auto hold = [&](double at_rad, double time_s) {
    for (double t_s = 0.0; t_s < time_s; t_s += kStep_s) coupling.step(at_rad, 0.0);
  };
  const double fresh_Nm = ramp(0.0, top_rad);
  EXPECT_GT(fresh_Nm, 2.0);
  hold(top_rad, 5.0);
  EXPECT_EQ(ramp(top_rad, rad_from_deg(0.5)), 0.0) << "lost contact above 0";
  EXPECT_EQ(coupling.friction_torque(), 0.0) << "the slip elements hold nothing without load";
  const double soon_Nm = ramp(rad_from_deg(0.5), top_rad);
  EXPECT_LT(soon_Nm, 0.8 * fresh_Nm) << "still crept";
  ramp(top_rad, 0.0);
  hold(0.0, 300.0);
  EXPECT_NEAR(ramp(0.0, top_rad), fresh_Nm, 1e-3) << "crept back";
}

TEST(ElastomerCoupling, UnbondedIsSofterByItsFactor) {
  auto parameters = kBonded;
  parameters.output_Nm = {1.0, 0.0, 0.0};
  const auto stiffness = [&parameters](bool bonded) {
    parameters.bonded = bonded;
    ElastomerCoupling coupling(parameters);
    return 1.0 / coupling.deflection(1.0);
  };
  EXPECT_NEAR(stiffness(true) / stiffness(false), 1.4, 1e-12);
}

TEST(ElastomerCoupling, LoopIsAsWideAsItsSlipElementsAndUnbondedAsTheLoad) {
  for (const bool bonded : {true, false}) {
    auto parameters = linear();
    parameters.slip.constant_Nm = 0.30;
    parameters.bonded = bonded;
    ElastomerCoupling coupling(parameters);
    coupling.set_period(1e6);  // every step is long enough to relax
    const double middle_rad = coupling.deflection(3.0);
    const auto move = [&](double from_rad, double to_rad) {
      double torque_Nm = 0.0;
      for (int i = 1; i <= 1000; ++i)
        torque_Nm = coupling.step(from_rad + (to_rad - from_rad) * i / 1000.0, 0.0);
      return torque_Nm;
    };
    coupling.reset();
    const double rising_Nm = move(0.0, middle_rad);
    move(middle_rad, 2.0 * middle_rad);
    const double falling_Nm = move(2.0 * middle_rad, middle_rad);
    EXPECT_NEAR(rising_Nm - falling_Nm, 2.0 * (bonded ? 0.30 : 0.15), 1e-4) << bonded;
  }
}

TEST(ElastomerCoupling, GlueCreepsByItsShareACycleAndOnlyLosesEnergy) {
  auto parameters = unbonded();
  parameters.creep_per_cycle = 0.003;
  ElastomerCoupling coupling(parameters);
  coupling.set_period(1e-2);
  coupling.reset();
  for (int i = 0; i < 30 * 200; ++i)
    coupling.step(rad_from_deg(8.0) * std::sin(2.0 * std::numbers::pi * i / 200.0), 0.0);
  EXPECT_NEAR(coupling.glue(), std::pow(0.997, 29), 1e-12) << "the 30th ends at its second turn";
  for (int i = 0; i < 1000; ++i) coupling.step(rad_from_deg(0.3) * std::sin(0.1 * i), 0.0);
  EXPECT_NEAR(coupling.glue(), std::pow(0.997, 29), 1e-12) << "too small to be a cycle";
  const double deflection_rad = coupling.deflection(3.0);
  coupling.reset();
  EXPECT_EQ(coupling.glue(), 1.0);
  EXPECT_GT(deflection_rad, coupling.deflection(3.0));
}

TEST(ElastomerCoupling, NoIncrementIsStifferThanTheSteepest) {
  double largest = 0.0;
  for (double deg = -12.0; deg < 4.0; deg += 0.05) {
    ElastomerCoupling coupling(kBonded);
    coupling.reset(rad_from_deg(deg));
    const double before_Nm = coupling.step(rad_from_deg(deg), 0.0);
    largest = std::max(largest, (coupling.step(rad_from_deg(deg) + 1e-7, 0.0) - before_Nm) / 1e-7);
  }
  const double steepest = ElastomerCoupling(kBonded).steepest(6.0);
  EXPECT_LE(largest, steepest * (1.0 + 1e-6));
  EXPECT_GE(largest, 0.999 * steepest);
}

TEST(ElastomerCoupling, RefusesImpossibleParameters) {
  const auto refuses = [](auto&& spoil) {
    auto parameters = kBonded;
    spoil(parameters);
    EXPECT_THROW(ElastomerCoupling{parameters}, Error);
  };
  refuses([](auto& of) { of.stiffness_Nm_rad = 0.0; });
  refuses([](auto& of) { of.branches.stiffness_Nm_rad[0] = 0.0; });
  refuses([](auto& of) { std::swap(of.branches.relaxation_s[0], of.branches.relaxation_s[1]); });
  refuses([](auto& of) { of.output_Nm[2] = 1e-12; });
  refuses([](auto& of) { of.output_Nm[2] = 0.0; });
  refuses([](auto& of) { of.output_Nm[1] = std::nan(""); });
  refuses([](auto& of) { of.output_Nm[0] = 0.0; });
  refuses([](auto& of) { of.slip.load_factor = 0.1; });
  refuses([](auto& of) { of.slip_load_Nm = 0.0; });
  refuses([](auto& of) { of.unbonded_softening = 0.0; });
  refuses([](auto& of) { of.creep_per_cycle = 1.0; });
  refuses([](auto& of) { of.cycle_dead_band_rad = -0.1; });
}

}  // namespace
}  // namespace torsio
