#include "torsio/control/deflection_controller.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "spring_joint.hpp"
#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;
using test::SpringJoint;
using Actuation = DeflectionController::Actuation;

constexpr std::array kWithoutClutch = {"dfki-28", "dfki-50", "dfki-120", "dfki-300", "elastomer"};

DeflectionController::Settings deflection_settings(const char* actuator) {
  return {.joint = series_elastic_joint(data_sheet(actuator))};
}

// With P, D and feed-forward alone: J δ'' + (b + D) δ' + (K + P) δ = (K + P) δ*.
TEST(DeflectionController, FollowsAStepAsTheSecondOrderSystemDoes) {
  constexpr double kFast_Hz = 100'000.0;
  constexpr double kStep_rad = 1e-3;
  DeflectionController::Settings settings = deflection_settings("dfki-50");
  settings.joint.drive.current_time_constant_s = 1e-6;
  settings.joint.drive.viscous_Nms_rad = 0.0;
  settings.integral_1_s = 0.0;
  settings.rate_cutoff_Hz = 20'000.0;
  settings.damping = 0.5;
  DeflectionController controller(settings, kFast_Hz);
  SpringJoint joint(settings.joint, JointOutput::locked);
  const double damped = 50.0 * std::sqrt(0.75);
  for (int n = 0; n < 30'000; ++n) {
    const double t = n / kFast_Hz;
    const double expected =
        kStep_rad *
        (1.0 - std::exp(-25.0 * t) * (std::cos(damped * t) + 25.0 / damped * std::sin(damped * t)));
    ASSERT_NEAR(joint.deflection_rad(), expected, 4e-3 * kStep_rad) << t;
    joint.step(controller.step(kStep_rad, joint.deflection_rad()).command, 1.0 / kFast_Hz);
  }
}

TEST(DeflectionController, FollowsASineOfItsCutoffWithTheRootOfAHalf) {
  for (const char* actuator : kWithoutClutch) {
    SCOPED_TRACE(actuator);
    const auto settings = deflection_settings(actuator);
    DeflectionController controller(settings, kRate_Hz);
    const double rad_s = controller.cutoff_rad_s();
    EXPECT_NEAR(std::abs(controller.tracking(rad_s)), std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(std::abs(controller.tracking(1e-3)), 1.0, 1e-3);
    SpringJoint joint(settings.joint, JointOutput::locked);
    double largest_rad = 0.0;
    for (int n = 0; n < 20'000; ++n) {
      const double wanted_rad = 1e-3 * std::sin(rad_s * n / kRate_Hz);
      joint.step(controller.step(wanted_rad, joint.deflection_rad()).command, 1.0 / kRate_Hz);
      if (n > 10'000) largest_rad = std::max(largest_rad, joint.deflection_rad());
    }
    EXPECT_NEAR(largest_rad, std::sqrt(0.5) * 1e-3, 0.01 * 1e-3);
  }
}

TEST(DeflectionController, HoldsADeflectionAgainstALockedOutput) {
  for (const char* actuator : kWithoutClutch) {
    const auto settings = deflection_settings(actuator);
    DeflectionController controller(settings, kRate_Hz);
    SpringJoint joint(settings.joint, JointOutput::locked);
    for (int n = 0; n < 3000; ++n)
      joint.step(controller.step(0.01, joint.deflection_rad()).command, 1.0 / kRate_Hz);
    EXPECT_NEAR(joint.deflection_rad(), 0.01, 1e-6) << actuator;
  }
}

TEST(DeflectionController, LetsAFreeJointComeToRestAfterAPush) {
  for (const char* actuator : kWithoutClutch) {
    const auto settings = deflection_settings(actuator);
    DeflectionController controller(settings, kRate_Hz);
    SpringJoint joint(settings.joint, JointOutput::free);
    double max_J = 0.0;
    for (int n = 0; n < 20'000; ++n) {
      const double push_Nm = n < 200 ? 0.02 * settings.joint.stiffness_Nm_rad : 0.0;
      joint.step(controller.step(0.0, joint.deflection_rad()).command, 1.0 / kRate_Hz, push_Nm);
      max_J = std::max(max_J, joint.energy_J());
    }
    EXPECT_GT(max_J, 0.0);
    // The drive's friction, which the integral compensates, acts like inertia: it coasts long.
    EXPECT_LT(joint.energy_J(), 0.2 * max_J) << actuator;
  }
}

TEST(DeflectionController, ActsOnTheSpeedOfADriveWithALoopOfItsOwn) {
  for (const char* actuator : kWithoutClutch) {
    auto settings = deflection_settings(actuator);
    settings.actuation = Actuation::velocity;
    const auto drive = JointCascade::gains_for(settings.joint.drive, 200.0);
    settings.speed_loop = drive.velocity;
    DeflectionController controller(settings, kRate_Hz);
    Pid speed_loop({.gains = drive.velocity}, kRate_Hz);
    SpringJoint joint(settings.joint, JointOutput::locked);
    for (int n = 0; n < 3000; ++n) {
      const auto output = controller.step(0.01, joint.deflection_rad());
      joint.step(speed_loop.step(output.command, joint.speed_rad_s()).command, 1.0 / kRate_Hz);
    }
    EXPECT_NEAR(joint.deflection_rad(), 0.01, 1e-6) << actuator;
  }
}

TEST(DeflectionController, CutsTheDeflectionAndTheCurrent) {
  const auto settings = deflection_settings("dfki-50");
  DeflectionController controller(settings, kRate_Hz);
  const auto output = controller.step(1.0, 0.0);
  EXPECT_EQ(output.wanted_deflection_rad, settings.largest_deflection_rad);
  EXPECT_EQ(output.command, settings.joint.drive.peak_current_A);
  EXPECT_TRUE(output.is_limited);
}

TEST(DeflectionController, KeepsTheLastFiniteReferenceAndFadesWithoutAMeasurement) {
  const auto settings = deflection_settings("dfki-50");
  DeflectionController disturbed(settings, kRate_Hz);
  DeflectionController sound(settings, kRate_Hz);
  (void)disturbed.step(0.01, 0.0);
  (void)sound.step(0.01, 0.0);
  const auto refused = disturbed.step(kNaN, 0.001);
  EXPECT_EQ(refused.fault, Fault::input_not_finite);
  EXPECT_EQ(refused.command, sound.step(0.01, 0.001).command);
  double last_A = refused.command;
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    const auto faded = disturbed.step(0.01, bad);
    EXPECT_EQ(faded.fault, Fault::input_not_finite);
    EXPECT_NEAR(faded.command, last_A * std::exp(-0.05), 1e-12);
    last_A = faded.command;
  }
  EXPECT_NEAR(disturbed.step(0.01, 0.001).command, last_A, 1e-9) << "continues from there";
}

TEST(DeflectionController, RefusesGainsThatAreUnstableAndStatesTheMargin) {
  const auto refusal = [](auto change) {
    DeflectionController::Settings settings = deflection_settings("dfki-50");
    change(settings);
    return test::error_message([&] { DeflectionController(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  const std::string fast = refusal([](auto& s) { s.bandwidth_rad_s = 200.0; });
  EXPECT_NE(fast.find("unstable with its output locked"), std::string::npos) << fast;
  EXPECT_NE(fast.find("found -21.1 degrees at 415.9 rad/s"), std::string::npos) << fast;
  EXPECT_NE(refusal([](auto& s) { s.bandwidth_rad_s = 20.0; }).find("faster than the loop's"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.gains = Pid::Gains{.proportional = -1.0}; }).find(">= 0"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.joint.stiffness_Nm_rad = 0.0; }), "");
  EXPECT_NE(refusal([](auto& s) { s.speed_loop.integral = kNaN; }), "");
  EXPECT_NE(refusal([](auto& s) { s.largest_deflection_rad = kInfinity; }), "");
  EXPECT_NE(refusal([](auto& s) { s.rate_cutoff_Hz = 500.0; }), "");
}

// 100 cases of 10^4 ticks: any reference, any measurement, gains changed during the run.
RC_GTEST_PROP(DeflectionController, KeepsToItsLimitsAndChangesItsGainsWithoutABump, ()) {
  auto settings =
      deflection_settings(*rc::gen::element("dfki-28", "dfki-50", "dfki-120", "dfki-300"));
  settings.anti_windup =
      *rc::gen::element(Pid::AntiWindup::back_calculation, Pid::AntiWindup::conditional);
  DeflectionController controller(settings, kRate_Hz);
  const Pid::Gains usual = controller.gains();
  const double peak_A = settings.joint.drive.peak_current_A;
  Random random = any_random();
  double wanted_rad = 0.0;
  double deflection_rad = 0.0;
  double last_A = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    const int phase = n % 200;
    const bool is_at_rest = phase >= 100;  // the filters settle: conditions are equal
    double measured_rad = deflection_rad;
    double asked_rad = wanted_rad;
    if (!is_at_rest) {
      if (random.uniform() < 0.02) wanted_rad = 0.2 * random.normal();
      deflection_rad += 1e-4 * random.normal();
      const double spoiled = random.uniform();
      asked_rad = spoiled > 0.98 ? kNaN : wanted_rad;
      measured_rad = spoiled < 0.01 ? kNaN : spoiled < 0.02 ? kInfinity : deflection_rad;
    }
    DeflectionController unchanged = controller;
    if (phase == 199) {
      const double share = 2.0 * random.uniform();
      RC_ASSERT(controller.set_gains(
          {share * usual.proportional, share * usual.integral, (2.0 - share) * usual.derivative}));
    }
    const auto output = controller.step(asked_rad, measured_rad);
    if (phase == 199)
      RC_ASSERT(std::abs(output.command - unchanged.step(asked_rad, measured_rad).command) < 1e-9);
    RC_ASSERT(std::abs(output.command) <= peak_A);
    RC_ASSERT(std::abs(output.wanted_deflection_rad) <= settings.largest_deflection_rad);
    if (!std::isfinite(measured_rad)) {
      RC_ASSERT(output.fault == Fault::input_not_finite);
      RC_ASSERT(std::abs(output.command) <= std::abs(last_A));
    }
    last_A = output.command;
  }
}

// Colgate's and Vallery's limit: at low frequency Re Z has the sign of b (K + a K_p − …) − J a K_i.
TEST(Passivity, EndsAtZeroWhereTheIntegralOutrunsTheFriction) {
  DeflectionController::Settings settings = deflection_settings("dfki-50");
  const Pid::Gains gains = DeflectionController::gains_for(settings);
  const Drive& drive = settings.joint.drive;
  const double a = drive.torque_per_current();
  const double late_s = 2e-3 + drive.current_time_constant_s;
  const double critical_Nms_rad =
      drive.inertia() * a * gains.integral /
      (settings.joint.stiffness_Nm_rad + a * (gains.proportional - gains.integral * late_s));
  const auto passive_to = [&](double viscous_Nms_rad) {
    settings.joint.drive.viscous_Nms_rad = viscous_Nms_rad;
    const DeflectionController controller(settings, kRate_Hz);
    return passivity(settings.joint, controller.feedback()).passive_to_rad_s;
  };
  EXPECT_EQ(passive_to(0.98 * critical_Nms_rad), 0.0);
  EXPECT_GT(passive_to(1.02 * critical_Nms_rad), 300.0);
}

TEST(Passivity, HasNoEndWithoutAController) {
  const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
  const LinearSystem none = LinearSystem::gain(0.0, kRate_Hz);
  const Passivity found = passivity(joint, {none, none, none});
  EXPECT_EQ(found.passive_to_rad_s, std::numbers::pi * kRate_Hz);
  EXPECT_EQ(found.least_Nms_rad, 0.0);
}

}  // namespace
}  // namespace torsio
