#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <string>

#include "control/controller_systems.hpp"
#include "control/design/loop_design.hpp"
#include "spring_joint.hpp"
#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/deflection_controller.hpp"
#include "torsio/control/estimate_correction.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;
using test::SpringJoint;

TEST(JointImpedance, IsASpringAndADamper) {
  JointImpedance impedance({.gains = {.stiffness_Nm_rad = 50.0, .damping_Nms_rad = 2.0}}, kRate_Hz);
  const auto output = impedance.step({.angle_rad = 0.3, .speed_rad_s = 1.0, .torque_Nm = 0.5},
                                     {.angle_rad = 0.1, .speed_rad_s = -1.0});
  EXPECT_DOUBLE_EQ(output.spring_Nm, 10.0);
  EXPECT_DOUBLE_EQ(output.damper_Nm, 4.0);
  EXPECT_DOUBLE_EQ(output.torque_Nm, 14.5);
  EXPECT_FALSE(output.is_limited);
}

// K, D and the joint's inertia: the frequency and the damping of a swinging joint are those asked for.
TEST(JointImpedance, MakesAFreeJointSwingAsItsSpringAndDamperDo) {
  SeriesElasticJoint parts = series_elastic_joint(data_sheet("dfki-50"));
  parts.joint_inertia_kg_m2 = 5.76;
  parts.drive.viscous_Nms_rad = 0.0;
  parts.joint_viscous_Nms_rad = 0.0;
  TorqueLoopCore::Settings settings = {.deflection = {.joint = parts}};
  TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
  constexpr double kFrequency_rad_s = 2.0;
  constexpr double kDamping = 0.3;
  JointImpedance impedance(
      {.gains = {.stiffness_Nm_rad = 5.76 * kFrequency_rad_s * kFrequency_rad_s,
                 .damping_Nms_rad = 2.0 * kDamping * kFrequency_rad_s * 5.76}},
      kRate_Hz);
  SpringJoint joint(parts, JointOutput::free);
  const double damped = kFrequency_rad_s * std::sqrt(1.0 - kDamping * kDamping);
  constexpr double kStep_rad = 0.1;
  for (int n = 0; n < 4000; ++n) {
    const double t = n / kRate_Hz;
    const double expected =
        kStep_rad -
        kStep_rad * std::exp(-kDamping * kFrequency_rad_s * t) *
            (std::cos(damped * t) + kDamping * kFrequency_rad_s / damped * std::sin(damped * t));
    ASSERT_NEAR(joint.joint_rad(), expected, 0.04 * kStep_rad) << t;
    const auto reference =
        impedance.step({.angle_rad = kStep_rad},
                       {.angle_rad = joint.joint_rad(), .speed_rad_s = joint.joint_speed_rad_s()});
    JointSample sample;
    sample.gear_angle_rad = joint.angle_rad();
    sample.joint_angle_rad = joint.joint_rad();
    joint.step(controller.step(reference.torque_Nm, sample).current_A, 1.0 / kRate_Hz);
  }
}

TEST(JointImpedance, FadesWithoutAMeasurementAndKeepsTheLastFiniteReference) {
  JointImpedance impedance({.gains = {.stiffness_Nm_rad = 50.0}}, kRate_Hz);
  EXPECT_EQ(impedance.step({.angle_rad = kNaN}, {.angle_rad = 0.1, .speed_rad_s = 0.0}).torque_Nm,
            0.0)
      << "no reference yet";
  JointImpedance estimate({.gains = {.stiffness_Nm_rad = 50.0}}, kRate_Hz);
  (void)estimate.step({.angle_rad = 0.3}, {.angle_rad = 0.1, .speed_rad_s = 0.0});
  const auto refused = estimate.step({.angle_rad = 0.5, .torque_Nm = kInfinity},
                                     {.angle_rad = 0.1, .speed_rad_s = 0.0});
  EXPECT_EQ(refused.fault, Fault::input_not_finite);
  EXPECT_DOUBLE_EQ(refused.torque_Nm, 10.0);
  const auto lost = estimate.step({.angle_rad = 0.3}, {});
  EXPECT_EQ(lost.fault, Fault::input_not_finite);
  EXPECT_NEAR(lost.torque_Nm, 10.0 * std::exp(-0.05), 1e-12);
  EXPECT_NEAR(estimate.step({.angle_rad = 0.3}, {.angle_rad = 0.1, .speed_rad_s = 0.0}).torque_Nm,
              lost.torque_Nm, 1e-9);
}

// A stiffness that somebody turns up in every tick must not hold the torque where it was.
TEST(JointImpedance, FollowsTheJointWhileItsGainsMove) {
  JointImpedance impedance({.gains = {.stiffness_Nm_rad = 20.0}}, kRate_Hz);
  double torque_Nm = 0.0;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(impedance.set_gains({.stiffness_Nm_rad = 20.0 + 0.1 * n}));
    const auto output =
        impedance.step({.angle_rad = 0.2}, {.angle_rad = 1e-4 * n, .speed_rad_s = 0.0});
    torque_Nm = output.torque_Nm;
  }
  // The transfer delays the gains by 0.1 s: that share of the stiffness at the present angles.
  EXPECT_NEAR(torque_Nm, 120.0 * 0.1 - 0.1 * 100.0 * 0.11, 0.15);
}

// Under equal conditions; changes due to the joint and the reference are not a bump.
RC_GTEST_PROP(JointImpedance, ChangesItsGainsWithoutABump, ()) {
  JointImpedance impedance({.torque_Nm = 5.0}, kRate_Hz);
  Random random = any_random();
  for (int n = 0; n < 10; ++n) {
    const JointImpedance::Reference reference = {.angle_rad = 0.1 * random.normal(),
                                                 .speed_rad_s = random.normal()};
    const JointImpedance::State state = {.angle_rad = 0.1 * random.normal(), .speed_rad_s = 0.0};
    double last_Nm = 0.0;
    // Until the transfer of the previous change has decayed.
    for (int k = 0; k < 3000; ++k) last_Nm = impedance.step(reference, state).torque_Nm;
    RC_ASSERT(impedance.set_gains(
        {.stiffness_Nm_rad = 100.0 * random.uniform(), .damping_Nms_rad = 5.0 * random.uniform()}));
    RC_ASSERT(std::abs(impedance.step(reference, state).torque_Nm - last_Nm) < 1e-9);
  }
}

RC_GTEST_PROP(JointImpedance, KeepsToItsLimits, ()) {
  const double max_Nm = 5.0;
  const double rate_Nm_s = 400.0;
  JointImpedance impedance({.torque_Nm = max_Nm, .torque_rate_Nm_s = rate_Nm_s}, kRate_Hz);
  Random random = any_random();
  double last_Nm = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    const bool is_lost = random.uniform() < 0.01;
    const JointImpedance::Reference reference = {
        .angle_rad = random.uniform() < 0.01 ? kNaN : random.normal()};
    const JointImpedance::State state = {.angle_rad = is_lost ? kNaN : random.normal(),
                                         .speed_rad_s = random.normal()};
    if (random.uniform() < 0.05)
      RC_ASSERT(impedance.set_gains({.stiffness_Nm_rad = 100.0 * random.uniform(),
                                     .damping_Nms_rad = 5.0 * random.uniform()}));
    const auto output = impedance.step(reference, state);
    RC_ASSERT(std::abs(output.torque_Nm) <= max_Nm);
    if (is_lost) {
      RC_ASSERT(output.fault == Fault::input_not_finite);
    } else {
      RC_ASSERT(std::abs(output.torque_Nm - last_Nm) <= rate_Nm_s / kRate_Hz * (1.0 + 1e-9));
    }
    last_Nm = output.torque_Nm;
  }
}

TEST(JointImpedance, RefusesImpossibleSettings) {
  const auto refusal = [](const JointImpedance::Settings& settings) {
    return test::error_message([&] { JointImpedance(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_NE(refusal({.gains = {.stiffness_Nm_rad = -1.0}}), "");
  EXPECT_NE(refusal({.gains = {.damping_Nms_rad = kNaN}}), "");
  EXPECT_NE(refusal({.torque_Nm = 0.0}), "");
  EXPECT_NE(refusal({.torque_rate_Nm_s = kNaN}), "");
  JointImpedance impedance({}, kRate_Hz);
  EXPECT_FALSE(impedance.set_gains({.stiffness_Nm_rad = -1.0}));
  EXPECT_FALSE(impedance.set_gains({.damping_Nms_rad = kInfinity}));
}

TEST(PassiveStiffness, IsBelowTheSpringAndGrowsWithTheDamping) {
  const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
  const DeflectionController controller({.joint = joint}, kRate_Hz);
  double last_Nm_rad = 0.0;
  for (const double damping_Nms_rad : {0.0, 1.0, 4.0}) {
    const double found = passive_stiffness(controller, damping_Nms_rad, 100.0, 40.0);
    EXPECT_GT(found, last_Nm_rad);
    EXPECT_LT(found, joint.stiffness_Nm_rad);
    last_Nm_rad = found;
    // The next step of the sweep is no longer passive.
    const auto beyond = impedance_feedback(controller, {1.06 * found, damping_Nms_rad}, 40.0);
    EXPECT_LT(passivity(joint, beyond).passive_to_rad_s, 100.0);
  }
}

// ------------------------------------------------------------------------------------------ tube

TubeImpedance::Settings tube_settings(const TubeImpedance::Gains& gains,
                                      const char* actuator = "harmonic-drive") {
  auto settings = tube_impedance_settings(data_sheet(actuator), gains);
  settings.relies_on_friction = true;
  return settings;
}

TEST(TubeImpedance, HasTheCurrentOfPaper004) {
  TubeImpedance impedance(tube_settings(TubeImpedance::kHigh), kRate_Hz);
  const TubeImpedance::Angles angles = {.rotor_rad = 0.02, .middle_rad = 0.004, .joint_rad = 0.01};
  const auto output = impedance.step(0.012, 0.0, angles);
  const double twist_rad = 0.02 / 2.0 - 0.004;
  EXPECT_DOUBLE_EQ(output.twist_rad, twist_rad);
  EXPECT_NEAR(output.current_A, 5.0 * (15.0 * 0.002 - twist_rad) / 0.08, 1e-12);
  auto with_gear = tube_settings(TubeImpedance::kHigh);
  with_gear.twist = TubeImpedance::Twist::tube_and_gear;
  EXPECT_DOUBLE_EQ(TubeImpedance(with_gear, kRate_Hz).step(0.0, 0.0, angles).twist_rad,
                   0.01 - 51.0 * 0.01);
}

TEST(TubeImpedance, RendersTheStiffnessThatItsGainsAreMadeFor) {
  const auto base = tube_settings(TubeImpedance::kZero);
  for (const double stiffness_Nm_rad : {100.0, 2000.0, 9000.0}) {
    auto settings = base;
    settings.relies_on_friction = false;
    settings.gains = TubeImpedance::gains_for(base, stiffness_Nm_rad, 20.0, 0.5);
    TubeImpedance impedance(settings, kRate_Hz);
    EXPECT_NEAR(impedance.stiffness(), stiffness_Nm_rad, 1e-9 * stiffness_Nm_rad);
    // A joint that is pushed from its place by a steady torque.
    SpringJoint joint(TubeImpedance::joint_of(settings), JointOutput::free);
    constexpr double kPush_Nm = 5.0;
    for (int n = 0; n < 20'000; ++n) {
      const auto output = impedance.step(0.0, 0.0,
                                         {.rotor_rad = joint.angle_rad() * 102.0,
                                          .middle_rad = joint.joint_rad() * 51.0,
                                          .joint_rad = joint.joint_rad()});
      joint.step(output.current_A, 1.0 / kRate_Hz, kPush_Nm);
    }
    EXPECT_NEAR(
        joint.joint_rad(),
        kPush_Nm / stiffness_Nm_rad + kPush_Nm / TubeImpedance::joint_of(settings).stiffness_Nm_rad,
        0.1 * kPush_Nm / stiffness_Nm_rad);
  }
}

TEST(TubeImpedance, FadesWithoutAMeasurement) {
  TubeImpedance impedance(tube_settings(TubeImpedance::kHigh), kRate_Hz);
  const TubeImpedance::Angles angles = {.rotor_rad = 0.0, .middle_rad = 0.0, .joint_rad = 0.0};
  const double last_A = impedance.step(0.01, 0.0, angles).current_A;
  ASSERT_GT(last_A, 1.0);
  EXPECT_EQ(impedance.step(kNaN, 0.0, angles).current_A, last_A);
  EXPECT_EQ(impedance.step(kNaN, 0.0, angles).fault, Fault::input_not_finite);
  for (auto lost :
       {TubeImpedance::Angles{kNaN, 0.0, 0.0}, TubeImpedance::Angles{0.0, kInfinity, 0.0},
        TubeImpedance::Angles{0.0, 0.0, kNaN}}) {
    const auto output = impedance.step(0.01, 0.0, lost);
    EXPECT_EQ(output.fault, Fault::input_not_finite);
    EXPECT_LT(output.current_A, last_A);
    EXPECT_GT(output.current_A, 0.0);
  }
}

TEST(TubeImpedance, GoesOnFromWhereItFadedTo) {
  TubeImpedance impedance(tube_settings(TubeImpedance::kHigh), kRate_Hz);
  const TubeImpedance::Angles angles = {.rotor_rad = 0.0, .middle_rad = 0.0, .joint_rad = 0.0};
  const double wanted_A = impedance.step(0.01, 0.0, angles).current_A;
  ASSERT_GT(wanted_A, 5.0);
  double last_A = wanted_A;
  for (int n = 0; n < 200; ++n) last_A = impedance.step(0.01, 0.0, {}).current_A;
  const auto back = impedance.step(0.01, 0.0, angles);
  EXPECT_EQ(back.fault, Fault::none);
  EXPECT_NEAR(back.current_A, last_A, 1e-9);
  EXPECT_NEAR(back.current_A, wanted_A + back.transfer_A, 1e-9);
  for (int n = 0; n < 100; ++n) last_A = impedance.step(0.01, 0.0, angles).current_A;
  EXPECT_NEAR(last_A, wanted_A * (1.0 - std::exp(-1.0)), 0.01 * wanted_A);
}

// docs/simulation/faults.md 13: without a command there is no reference; the angle 0 would be far away.
TEST(TubeImpedance, GivesNoCurrentBeforeItsFirstFiniteReference) {
  TubeImpedance impedance(tube_settings(TubeImpedance::kHigh), kRate_Hz);
  const TubeImpedance::Angles angles = {
      .rotor_rad = 0.5 * 102.0, .middle_rad = 0.5 * 51.0, .joint_rad = 0.5};
  for (int n = 0; n < 3; ++n) {
    const auto output = impedance.step(kNaN, 0.0, angles);
    EXPECT_EQ(output.current_A, 0.0);
    EXPECT_EQ(output.fault, Fault::input_not_finite);
  }
  EXPECT_NEAR(impedance.step(0.51, 0.0, angles).current_A, 0.0, 1e-9)
      << "transferred from no current";
  impedance.reset();
  EXPECT_EQ(impedance.step(kNaN, 0.0, angles).current_A, 0.0);
}

// 100 cases of 10^4 ticks.
RC_GTEST_PROP(TubeImpedance, GivesAFaultAndASafeCurrentForAnyNumbers, ()) {
  const auto settings =
      tube_settings(*rc::gen::element(TubeImpedance::kHigh, TubeImpedance::kZero));
  TubeImpedance impedance(settings, kRate_Hz);
  Random random = any_random();
  const auto spoil = [&](double value) {
    const double draw = random.uniform();
    return draw < 0.02 ? kNaN : draw < 0.04 ? kInfinity : draw < 0.06 ? 1e308 : value;
  };
  double last_A = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    const double wanted_rad = spoil(random.normal());
    const TubeImpedance::Angles angles = {.rotor_rad = spoil(10.0 * random.normal()),
                                          .middle_rad = spoil(10.0 * random.normal()),
                                          .joint_rad = spoil(random.normal())};
    const auto output = impedance.step(wanted_rad, 0.1 * random.normal(), angles);
    RC_ASSERT(std::abs(output.current_A) <= settings.drive.peak_current_A);
    const bool is_measured = std::isfinite(angles.rotor_rad + angles.middle_rad + angles.joint_rad);
    if (!is_measured) RC_ASSERT(std::abs(output.current_A) <= std::abs(last_A));
    if (!is_measured || !std::isfinite(wanted_rad)) RC_ASSERT(output.fault != Fault::none);
    last_A = output.current_A;
  }
}

// A joint that is locked and asked for a torque besides its impedance.
TEST(TubeImpedance, AddsTheTorqueThatIsAskedFor) {
  auto settings = tube_settings(TubeImpedance::kZero);
  settings.relies_on_friction = false;
  settings.gains = TubeImpedance::gains_for(settings, 1000.0, 20.0, 0.5);
  TubeImpedance impedance(settings, kRate_Hz);
  const SeriesElasticJoint parts = TubeImpedance::joint_of(settings);
  SpringJoint joint(parts, JointOutput::locked);
  TubeImpedance::Output output;
  constexpr double kWanted_Nm = 12.0;
  for (int n = 0; n < 20'000; ++n) {
    output = impedance.step(0.0, 0.0,
                            {.rotor_rad = joint.angle_rad() * 102.0,
                             .middle_rad = joint.joint_rad() * 51.0,
                             .joint_rad = joint.joint_rad()},
                            kWanted_Nm);
    joint.step(output.current_A, 1.0 / kRate_Hz);
  }
  EXPECT_NEAR(parts.stiffness_Nm_rad * (joint.angle_rad() - joint.joint_rad()), kWanted_Nm, 0.05);
  EXPECT_NEAR(output.feed_forward_rad * TubeImpedance::torque_per_twist(settings), kWanted_Nm,
              1e-9);
  auto without_gain = settings;
  without_gain.gains = {};
  EXPECT_EQ(TubeImpedance(without_gain, kRate_Hz).step(0.0, 0.0, {0.0, 0.0, 0.0}, 5.0).current_A,
            0.0);
}

// ------------------------------------------------------------------------------- correction

TEST(EstimateCorrection, IntegratesTheErrorUpToItsLimit) {
  EstimateCorrection correction({.bandwidth_rad_s = 10.0, .torque_Nm = 0.5}, kRate_Hz);
  EXPECT_DOUBLE_EQ(correction.step(3.0, {.value = 1.0}, false), 10.0 * 2.0 / kRate_Hz);
  EXPECT_DOUBLE_EQ(correction.step(3.0, {.value = 1.0}, true), 10.0 * 2.0 / kRate_Hz)
      << "it holds while the command is limited";
  for (int n = 0; n < 1000; ++n) (void)correction.step(3.0, {.value = 1.0}, false);
  EXPECT_DOUBLE_EQ(correction.correction_Nm(), 0.5);
  correction.reset();
  EXPECT_EQ(correction.correction_Nm(), 0.0);
}

TEST(EstimateCorrection, DecaysWithoutAUsableEstimate) {
  EstimateCorrection correction({.bandwidth_rad_s = 10.0, .fault_decay_s = 0.05}, kRate_Hz);
  const auto after = [&](double wanted_Nm, const Estimate& estimate) {
    for (int n = 0; n < 100; ++n) (void)correction.step(1.0, {.value = 0.0}, false);
    const double before_Nm = correction.correction_Nm();
    for (int n = 0; n < 50; ++n) (void)correction.step(wanted_Nm, estimate, false);
    return correction.correction_Nm() / before_Nm;
  };
  EXPECT_NEAR(after(1.0, {.value = 0.0, .fault = Fault::input_not_finite}), std::exp(-1.0), 1e-9);
  EXPECT_NEAR(after(1.0, {.value = kNaN}), std::exp(-1.0), 1e-9);
  EXPECT_NEAR(after(kNaN, {.value = 0.0}), std::exp(-1.0), 1e-9);
}

TEST(EstimateCorrection, RefusesWhatIsImpossible) {
  const auto refusal = [](const EstimateCorrection::Settings& settings) {
    return test::error_message([&] { EstimateCorrection(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_NE(refusal({.bandwidth_rad_s = 101.0}).find("at most 100 rad/s, found 101"),
            std::string::npos);
  EXPECT_NE(refusal({.bandwidth_rad_s = kNaN}), "");
  EXPECT_NE(refusal({.torque_Nm = 0.0}), "");
  EXPECT_NE(refusal({.fault_decay_s = -1.0}), "");
  for (const double rate_Hz : {-kRate_Hz, 0.0, kNaN}) {
    const std::string refused = test::error_message([&] { EstimateCorrection({}, rate_Hz); });
    EXPECT_NE(refused.find("sample_rate_Hz"), std::string::npos) << refused;
  }
}

// A value that is held for N ticks is the mean of N delays.
TEST(EstimateCorrection, HasTheDelayOfAHeldEstimate) {
  for (const std::size_t ticks : {1U, 2U, 3U, 10U, 100U}) {
    const LinearSystem hold = slow_hold(ticks, kRate_Hz);
    EXPECT_LE(hold.spectral_radius(), 1.0);
    const double third_rad_s = 2.0 * M_PI * kRate_Hz / static_cast<double>(ticks) / 3.0;
    for (const double share : {0.01, 0.3, 0.6, 1.0}) {
      const double rad_s = share * std::min(third_rad_s, 0.2 * M_PI * kRate_Hz);
      std::complex<double> mean;
      for (std::size_t delay = 0; delay < ticks; ++delay)
        mean += std::polar(1.0 / static_cast<double>(ticks),
                           -rad_s * static_cast<double>(delay) / kRate_Hz);
      EXPECT_LT(std::abs(hold.response(rad_s) - mean), 0.03) << ticks << " ticks, " << share;
    }
  }
}

// With an estimate at every tick the loop with the hold is the ordinary one; with a slow one less bandwidth is stable.
TEST(EstimateCorrection, HoldsAnEstimateInTheStabilityOfTheLoop) {
  const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
  const DeflectionController controller({.joint = joint}, kRate_Hz);
  const auto gain = [](double value) { return LinearSystem::gain(value, kRate_Hz); };
  const JointFeedback loop = controller.feedback();
  const LinearSystem path = controller.reference_path() * gain(1.0 / joint.stiffness_Nm_rad);
  int stable = 0;
  int stable_if_slow = 0;
  constexpr int kBandwidths = 56;
  for (int n = 0; n < kBandwidths; ++n) {
    const double bandwidth_rad_s = 0.05 * std::pow(1.2, n);
    const auto whole =
        corrected_feedback(loop, gain(0.0), path, joint.stiffness_Nm_rad, bandwidth_rad_s);
    const auto parts =
        corrected_parts(loop, gain(0.0), path, joint.stiffness_Nm_rad, bandwidth_rad_s);
    const auto is_stable = [&](std::size_t ticks) {
      return is_stable_held(joint, parts.others, parts.estimate, ticks, JointOutput::locked);
    };
    EXPECT_EQ(is_stable(1), is_stable_closed(open_loop(joint, whole, JointOutput::locked)))
        << bandwidth_rad_s;
    stable += is_stable(1) ? 1 : 0;
    stable_if_slow += is_stable(200) ? 1 : 0;
    // Within 5 s the torque follows, so that each estimate is that of the correction before: from 1 to 1 - 5 s times ω.
    EXPECT_EQ(is_stable(5000), bandwidth_rad_s * 5.0 < 2.0) << bandwidth_rad_s;
  }
  EXPECT_GT(stable, 0);
  EXPECT_LT(stable, kBandwidths);
  EXPECT_LT(stable_if_slow, stable);
}

TEST(TubeImpedance, RefusesWhatItCannotRender) {
  const auto refusal = [](auto change) {
    auto settings = tube_impedance_settings(data_sheet("harmonic-drive"), TubeImpedance::kZero);
    change(settings);
    return test::error_message([&] { TubeImpedance(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  const std::string high = refusal([](auto& s) { s.gains = TubeImpedance::kHigh; });
  EXPECT_NE(high.find("unstable with its output locked"), std::string::npos) << high;
  EXPECT_NE(refusal([](auto& s) { s.gains.position = -1.0; }), "");
  EXPECT_NE(refusal([](auto& s) { s.gains.damping_s = kNaN; }), "");
  EXPECT_NE(refusal([](auto& s) { s.tube_Nm_rad = 0.0; }), "");
  EXPECT_NE(test::error_message([] {
              return tube_impedance_settings(data_sheet("dfki-50"), {});
            }).find("a torsion tube before a gear, found dfki-50"),
            std::string::npos);
}

// Without poles in the right half plane: those of the joint with its output locked.
TEST(PassiveStiffness, OfATubeIsStableLockedAsWell) {
  int found = 0;
  for (const char* actuator : {"harmonic-drive", "harmonic-drive:soft"}) {
    for (const double torque_Nm_rad : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0}) {
      for (const double damping_Nms_rad : {0.0, 30.0, 100.0, 300.0}) {
        auto settings =
            tube_impedance_settings(data_sheet(actuator), {.torque_Nm_rad = torque_Nm_rad});
        const double stiffness_Nm_rad =
            passive_stiffness(settings, damping_Nms_rad, 60.0, kRate_Hz);
        if (!(stiffness_Nm_rad > 0.0)) continue;
        ++found;
        settings.gains =
            TubeImpedance::gains_for(settings, stiffness_Nm_rad, damping_Nms_rad, torque_Nm_rad);
        EXPECT_EQ(test::error_message([&] { TubeImpedance(settings, kRate_Hz); }), "")
            << actuator << ", " << torque_Nm_rad << ", " << damping_Nms_rad;
      }
    }
  }
  EXPECT_GT(found, 10);
}

TEST(PassiveStiffness, OfATubeEndsWhereTheLoopIsFast) {
  const auto slow = tube_impedance_settings(data_sheet("harmonic-drive"), TubeImpedance::kZero);
  const auto fast = tube_impedance_settings(data_sheet("harmonic-drive"), TubeImpedance::kHigh);
  EXPECT_GT(passive_stiffness(slow, 0.0, 60.0, kRate_Hz), 5000.0);
  EXPECT_EQ(passive_stiffness(fast, 0.0, 60.0, kRate_Hz), 0.0);
}

}  // namespace
}  // namespace torsio
