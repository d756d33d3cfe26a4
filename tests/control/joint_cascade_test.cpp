#include "torsio/control/joint_cascade.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rigid_joint.hpp"
#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_number;
using test::any_random;
using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;
using test::RigidJoint;

JointCascade::Settings cascade_settings(const char* actuator) {
  const DataSheet sheet = data_sheet(actuator);
  return {.drive = drive_of(sheet),
          .limits = {.lowest_rad = -1.0,
                     .highest_rad = 1.0,
                     .speed_rad_s = sheet.rating.speed_rad_s.value,
                     .max_unmeasured_load_Nm = 0.05 * sheet.rating.torque_Nm.value,
                     .max_measured_load_Nm = 0.3 * sheet.rating.torque_Nm.value},
          .has_torque = true};
}

/// Runs the loop for so long; the last output.
JointCascade::Output run(JointCascade& cascade, RigidJoint& joint, const JointReference& reference,
                         int ticks, double max_unmeasured_load_Nm = 0.0) {
  JointCascade::Output output;
  for (int n = 0; n < ticks; ++n) {
    output = cascade.step(reference, joint.state(max_unmeasured_load_Nm));
    joint.step(output.current_A, max_unmeasured_load_Nm, 1.0 / kRate_Hz);
  }
  return output;
}

TEST(JointCascade, GoesToAPositionAndHoldsItUnderLoad) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    const JointCascade::Settings settings = cascade_settings(actuator);
    JointCascade cascade(settings, kRate_Hz);
    RigidJoint joint(settings.drive);
    const double max_unmeasured_load_Nm = 0.5 * settings.limits.max_measured_load_Nm;
    run(cascade, joint, {.mode = JointMode::position, .position_rad = 0.5}, 5000,
        max_unmeasured_load_Nm);
    EXPECT_NEAR(joint.angle_rad(), 0.5, 1e-4) << actuator;
    EXPECT_NEAR(joint.speed_rad_s(), 0.0, 1e-4) << actuator;
  }
}

// P on position over P on speed: q'' + w q' + w k_q q = w k_q q*, a second-order system.
TEST(JointCascade, FollowsAStepAsTheSecondOrderSystemDoes) {
  JointCascade::Settings settings = cascade_settings("dfki-50");
  settings.drive.current_time_constant_s = 1e-6;
  settings.limits.max_unmeasured_load_Nm = 0.0;
  JointCascade::Gains gains = JointCascade::gains_for(settings.drive, 50.0);
  gains.velocity.integral = 0.0;
  settings.gains = gains;
  settings.transfer_s = 1e-6;
  constexpr double kFast_Hz = 100'000.0;
  JointCascade cascade(settings, kFast_Hz);
  RigidJoint joint(settings.drive);
  const double root = std::sqrt(0.25 * 50.0 * 50.0 - 50.0 * gains.position_1_s);
  const double fast = 25.0 + root;
  const double slow = 25.0 - root;
  constexpr double kStep_rad = 1e-3;
  for (int n = 0; n < 50'000; ++n) {
    const double t = n / kFast_Hz;
    const double expected =
        kStep_rad *
        (1.0 - (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow));
    ASSERT_NEAR(joint.angle_rad(), expected, 2e-3 * kStep_rad) << t;
    const auto output =
        cascade.step({.mode = JointMode::position, .position_rad = kStep_rad}, joint.state(0.0));
    joint.step(output.current_A, 0.0, 1.0 / kFast_Hz);
  }
}

TEST(JointCascade, AddsUpTheTermsThatItNames) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  run(cascade, joint, {.mode = JointMode::velocity, .velocity_rad_s = 0.1}, 20);
  for (const JointMode mode : {JointMode::position, JointMode::current, JointMode::velocity}) {
    const auto output = run(cascade, joint,
                            {.mode = mode,
                             .position_rad = 0.01,
                             .acceleration_rad_s2 = 0.1,
                             .torque_Nm = 0.5,
                             .current_A = 0.02},
                            30);
    EXPECT_EQ(output.limit, JointCascade::Limit::none);
    EXPECT_NEAR(output.current_A,
                output.proportional_A + output.integral_A + output.derivative_A +
                    output.feed_forward_A + output.transfer_A,
                1e-12);
  }
}

TEST(JointCascade, StaysAtALimitThatItIsPushedIntoAndLetsGoAtOnce) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  const JointReference push = {.mode = JointMode::current, .current_A = 3.0};
  const auto held = run(cascade, joint, push, 10'000);
  EXPECT_EQ(held.limit, JointCascade::Limit::position);
  EXPECT_NEAR(joint.angle_rad(), 1.0 - cascade.position_margin(), 1e-6);
  EXPECT_NEAR(held.current_A, 0.0, 1e-6);
  const JointReference back = {.mode = JointMode::current, .current_A = -0.3};
  const auto freed = cascade.step(back, joint.state(0.0));
  EXPECT_EQ(freed.current_A, -0.3);
  EXPECT_EQ(freed.limit, JointCascade::Limit::none);
}

TEST(JointCascade, CarriesTheLoadOnWhenAPositionBecomesASpeed) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  // The cascade does not measure it: only its integral compensates it.
  const auto hold = [&](const JointReference& reference, int ticks) {
    for (int n = 0; n < ticks; ++n) {
      const auto output = cascade.step(reference, joint.state(0.0));
      joint.step(output.current_A, settings.limits.max_unmeasured_load_Nm, 1.0 / kRate_Hz);
    }
  };
  hold({.mode = JointMode::position, .position_rad = 0.3}, 5000);
  const double before_rad = joint.angle_rad();
  hold({.mode = JointMode::velocity}, 1000);
  EXPECT_NEAR(joint.angle_rad(), before_rad, 1e-6);
}

// docs/simulation/faults.md 30: the loop that was overridden for a minute has not wound up.
TEST(JointCascade, DoesNotWindUpWhileOverridden) {
  for (const JointMode mode : {JointMode::velocity, JointMode::position, JointMode::torque}) {
    JointCascade::Settings settings = cascade_settings("dfki-50");
    settings.gains = JointCascade::gains_for(settings.drive, 50.0);
    settings.gains->torque = {.proportional = 0.5, .integral = 5.0};
    JointCascade cascade(settings, kRate_Hz);
    RigidJoint joint(settings.drive);
    run(cascade, joint,
        {.mode = mode, .position_rad = 3.0, .velocity_rad_s = 2.0, .torque_Nm = 20.0}, 60'000);
    EXPECT_LT(joint.angle_rad(), 1.0);
    run(cascade, joint,
        {.mode = mode, .position_rad = 0.0, .velocity_rad_s = -0.5, .torque_Nm = -2.0}, 100);
    EXPECT_LT(joint.speed_rad_s(), 0.0) << name(mode);
  }
}

// docs/simulation/faults.md 31: speed, position and current all at once; the approach is smooth and ends at rest.
TEST(JointCascade, DoesNotChatterBetweenTwoLimits) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    const JointCascade::Settings settings = cascade_settings(actuator);
    JointCascade cascade(settings, kRate_Hz);
    RigidJoint joint(settings.drive);
    auto last = JointCascade::Limit::none;
    int changes = 0;
    int turns = 0;
    double last_A = 0.0;
    double last_move_A = 0.0;
    for (int n = 0; n < 20'000; ++n) {
      const auto output = cascade.step(
          {.mode = JointMode::current, .current_A = 2.0 * settings.drive.peak_current_A},
          joint.state(0.0));
      joint.step(output.current_A, 0.0, 1.0 / kRate_Hz);
      if (output.limit != last) ++changes;
      const double move_A = output.current_A - last_A;
      if (move_A * last_move_A < 0.0 && std::abs(move_A) > 1e-6) ++turns;
      last = output.limit;
      last_A = output.current_A;
      if (move_A != 0.0) last_move_A = move_A;
    }
    EXPECT_LE(changes, 5) << actuator << ": current, thermal, speed, position";
    EXPECT_LE(turns, 6) << actuator;
    EXPECT_EQ(last, JointCascade::Limit::position) << actuator;
    EXPECT_NEAR(joint.angle_rad(), 1.0 - cascade.position_margin(), 1e-6) << actuator;
  }
}

TEST(JointCascade, KeepsTheLastReferenceWhenOneIsNotFinite) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade disturbed(settings, kRate_Hz);
  JointCascade sound(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  const JointReference good = {.mode = JointMode::position, .position_rad = 0.1};
  for (int n = 0; n < 100; ++n) {
    const auto expected = sound.step(good, joint.state(0.0));
    JointReference bad = n == 0 ? good : JointReference{.mode = JointMode::torque};
    if (n > 0) (n % 2 == 0 ? bad.damping_Nms_rad : bad.torque_Nm) = n % 3 == 0 ? kNaN : kInfinity;
    const auto output = disturbed.step(bad, joint.state(0.0));
    ASSERT_EQ(output.current_A, expected.current_A);
    ASSERT_EQ(output.fault, n == 0 ? Fault::none : Fault::input_not_finite);
    ASSERT_EQ(output.is_reference_refused, n > 0);
    joint.step(output.current_A, 0.0, 1.0 / kRate_Hz);
  }
}

TEST(JointCascade, RefusesAModeThatItHasNoSensorFor) {
  JointCascade::Settings settings = cascade_settings("dfki-50");
  settings.has_torque = false;
  JointCascade cascade(settings, kRate_Hz);
  for (const JointMode mode : {JointMode::torque, JointMode::impedance}) {
    const auto output =
        cascade.step({.mode = mode, .torque_Nm = 5.0}, {.angle_rad = 0.0, .speed_rad_s = 0.0});
    EXPECT_TRUE(output.is_reference_refused);
    EXPECT_EQ(output.current_A, 0.0);
  }
  EXPECT_TRUE(cascade
                  .step({.mode = JointMode::current, .stiffness_Nm_rad = -1.0},
                        {.angle_rad = 0.0, .speed_rad_s = 0.0})
                  .is_reference_refused);
}

TEST(JointCascade, LetsTheCurrentFadeWithoutAMeasurementAndGoesOnFromThere) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  const JointReference reference = {.mode = JointMode::velocity, .velocity_rad_s = 1.0};
  double last_A = run(cascade, joint, reference, 20).current_A;
  ASSERT_GT(std::abs(last_A), 0.1);
  for (int n = 0; n < 100; ++n) {
    JointState lost = joint.state(0.0);
    (n % 3 == 0 ? lost.angle_rad : n % 3 == 1 ? lost.speed_rad_s : lost.torque_Nm) = kNaN;
    const auto output = cascade.step(reference, lost);
    ASSERT_EQ(output.fault, Fault::input_not_finite);
    ASSERT_NEAR(output.current_A, last_A * std::exp(-0.001 / settings.fault_decay_s), 1e-9);
    last_A = output.current_A;
  }
  const auto back = cascade.step(reference, joint.state(0.0));
  EXPECT_EQ(back.fault, Fault::none);
  EXPECT_NEAR(back.current_A, last_A, 1e-9);
}

TEST(JointCascade, KeepsToTheVoltageThatItsSupplyHas) {
  JointCascade::Settings settings = cascade_settings("dfki-50");
  settings.limits.speed_rad_s = 3.8;
  settings.limits.max_unmeasured_load_Nm = 0.0;
  JointCascade cascade(settings, kRate_Hz);
  // No-load speed: 48 V / (0.104 Vs/rad 120) = 3.85 rad/s; nothing left above it.
  const auto output = cascade.step({.mode = JointMode::current, .current_A = 3.0},
                                   {.angle_rad = 0.0, .speed_rad_s = 3.84, .torque_Nm = 50.0});
  EXPECT_EQ(output.limit, JointCascade::Limit::voltage);
  const Drive& drive = settings.drive;
  EXPECT_NEAR(
      output.current_A * drive.resistance_Ohm + drive.torque_constant_Nm_A * drive.ratio * 3.84,
      drive.supply_V, 1e-9);
}

TEST(JointCascade, RefusesLimitsThatContradictEachOther) {
  const auto refusal = [](auto change) {
    JointCascade::Settings settings = cascade_settings("dfki-50");
    change(settings);
    return test::error_message([&] { JointCascade(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& s) { s.limits.highest_rad = -0.99; }).find("no room between"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.lowest_rad = kNaN; }).find("no room between"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.max_unmeasured_load_Nm = 70.0; }).find("cannot brake"),
            std::string::npos);
  // 0.9 of what the rated current can, beside a load_Nm of 2.5 Nm.
  const Drive drive = drive_of(data_sheet("dfki-50"));
  const double rated_Nm = drive.rated_current_A * drive.torque_per_current();
  EXPECT_EQ(refusal([&](auto& s) { s.limits.max_measured_load_Nm = 0.9 * rated_Nm; }), "");
  EXPECT_NE(
      refusal([&](auto& s) { s.limits.max_measured_load_Nm = rated_Nm; }).find("cannot brake"),
      std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.speed_rad_s = 0.05; }).find("use up the speed limit"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.current_rate_A_s = 100.0; }).find("current rate"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.thermal_time_s = 0.001; }).find("thermal limit"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.drive.peak_current_A = 1.0; }).find("peak current"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.bandwidth_rad_s = 500.0; }).find("bandwidth"),
            std::string::npos);
  for (const double bad : {-1.0, kNaN, kInfinity})
    EXPECT_NE(refusal([&](auto& s) {
                s.gains = JointCascade::gains_for(s.drive, 50.0);
                s.gains->velocity.integral = bad;
              }),
              "");
}

// ------------------------------------------------------------------------------------ properties

JointCascade::Settings any_cascade_settings() {
  JointCascade::Settings settings =
      cascade_settings(*rc::gen::element("dfki-28", "dfki-50", "dfki-120", "dfki-300"));
  settings.bandwidth_rad_s = any_number(20.0, 100.0);
  settings.limits.lowest_rad = any_number(-2.0, -0.5);
  settings.limits.highest_rad = any_number(0.5, 2.0);
  settings.limits.thermal_time_s = any_number(0.2, 5.0);
  settings.limits.max_measured_load_Nm =
      any_number(0.0, 0.8) * settings.drive.rated_current_A * settings.drive.torque_per_current();
  settings.gains = JointCascade::gains_for(settings.drive, settings.bandwidth_rad_s);
  settings.gains->velocity.integral *= any_number(0.0, 3.0);
  settings.gains->position_1_s *= any_number(0.1, 5.0);
  settings.gains->torque = {
      .proportional = any_number(0.0, 2.0) / settings.drive.torque_per_current(),
      .integral = any_number(0.0, 20.0) / settings.drive.torque_per_current(),
      .derivative = 0.0};
  return settings;
}

JointReference any_reference(Random& random, double far = 1e6) {
  JointReference reference;
  reference.mode = static_cast<JointMode>(5.0 * random.uniform());
  const auto wild = [&](double usual) {
    const double draw = random.uniform();
    return draw < 0.01 ? kNaN : draw < 0.03 ? far * random.normal() : usual * random.normal();
  };
  reference.position_rad = wild(2.0);
  reference.velocity_rad_s = wild(3.0);
  reference.acceleration_rad_s2 = wild(10.0);
  reference.torque_Nm = wild(50.0);
  reference.current_A = wild(5.0);
  reference.stiffness_Nm_rad = std::abs(wild(100.0));
  reference.damping_Nms_rad = std::abs(wild(5.0));
  return reference;
}

JointReference finite_reference(Random& random) {
  JointReference reference = any_reference(random, 1e3);
  while (!std::isfinite(reference.position_rad + reference.velocity_rad_s +
                        reference.acceleration_rad_s2 + reference.torque_Nm + reference.current_A +
                        reference.stiffness_Nm_rad + reference.damping_Nms_rad))
    reference = any_reference(random, 1e3);
  return reference;
}

// 100 cases of 10^4 ticks, each ten steps of the plant: any modes, any commands, gains changed
// during the run, loads up to those of the limits' settings. A fifth of the unknown load is
// reserved for the known one, which the current follows late.
RC_GTEST_PROP(JointCascade, NeverLetsTheJointOutOfItsLimits, ()) {
  const JointCascade::Settings settings = any_cascade_settings();
  const JointCascade::Limits& limits = settings.limits;
  Random random = any_random();
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  JointReference reference;
  const bool is_steady = *rc::gen::arbitrary<bool>();
  double max_measured_load_Nm = 0.0;
  double unknown_Nm = 0.0;
  double heat = 0.0;
  const double share = -std::expm1(-1.0 / (limits.thermal_time_s * kRate_Hz));
  const double max_J = 0.5 * settings.drive.inertia() * limits.speed_rad_s * limits.speed_rad_s;
  for (int n = 0; n < 10'000; ++n) {
    if (random.uniform() < 0.01) reference = any_reference(random);
    if (random.uniform() < 0.003) {
      JointCascade::Gains gains = *settings.gains;
      gains.velocity.proportional *= 2.0 * random.uniform();
      gains.position_1_s *= 2.0 * random.uniform();
      RC_ASSERT(cascade.set_gains(gains));
    }
    if (random.uniform() < 0.02)
      unknown_Nm = 0.8 * limits.max_unmeasured_load_Nm * (random.uniform() < 0.5 ? -1 : 1);
    // Half of the cases push to one side with all of it.
    max_measured_load_Nm =
        is_steady ? limits.max_measured_load_Nm
                  : std::clamp(max_measured_load_Nm +
                                   0.004 * limits.max_measured_load_Nm * random.normal(),
                               -limits.max_measured_load_Nm, limits.max_measured_load_Nm);
    const auto output = cascade.step(reference, joint.state(max_measured_load_Nm));
    joint.step(output.current_A, max_measured_load_Nm + unknown_Nm, 1.0 / kRate_Hz);
    RC_ASSERT(joint.angle_rad() >= limits.lowest_rad);
    RC_ASSERT(joint.angle_rad() <= limits.highest_rad);
    RC_ASSERT(std::abs(joint.speed_rad_s()) <= limits.speed_rad_s);
    RC_ASSERT(joint.energy_J() <= max_J);
    RC_ASSERT(std::abs(output.current_A) <= settings.drive.peak_current_A);
    heat += share * (output.current_A * output.current_A - heat);
    RC_ASSERT(heat <= settings.drive.rated_current_A * settings.drive.rated_current_A);
  }
}

// The worst case of the limits' settings: a load that pushes into the limit for ever, and a current
// that heats the winding until only the rated one is left to brake with.
TEST(JointCascade, StopsAtItsLimitWithAHotWindingUnderTheWholeLoadOfItsSettings) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    for (const double share : {0.3, 0.6, 0.9}) {
      JointCascade::Settings settings = cascade_settings(actuator);
      const Drive& drive = settings.drive;
      const double rated_Nm = drive.rated_current_A * drive.torque_per_current();
      settings.limits.max_measured_load_Nm = share * rated_Nm;
      JointCascade cascade(settings, kRate_Hz);
      RigidJoint joint(drive);
      double farthest_rad = 0.0;
      double hottest = 0.0;
      for (int n = 0; n < 50'000; ++n) {
        // To and fro on the spot at the peak, then with the load.
        const bool is_heating = n < 40'000;
        const double wanted_A =
            is_heating && n / 10 % 2 == 0 ? -drive.peak_current_A : drive.peak_current_A;
        const double max_unmeasured_load_Nm =
            is_heating ? 0.0 : -settings.limits.max_measured_load_Nm;
        const auto output = cascade.step({.mode = JointMode::current, .current_A = wanted_A},
                                         joint.state(max_unmeasured_load_Nm));
        joint.step(output.current_A, max_unmeasured_load_Nm, 1.0 / kRate_Hz);
        farthest_rad = std::max(farthest_rad, std::abs(joint.angle_rad()));
        hottest = std::max(hottest, output.thermal_load);
      }
      EXPECT_LE(farthest_rad, 1.0) << actuator << ", " << share;
      EXPECT_GT(hottest, 0.8) << actuator << ": above 0.75 the peak is no longer allowed";
    }
  }
}

RC_GTEST_PROP(JointCascade, SwitchesItsModeAndItsGainsWithoutAJump, ()) {
  const JointCascade::Settings settings = any_cascade_settings();
  Random random = any_random();
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  for (int change = 0; change < 20; ++change) {
    JointReference reference = finite_reference(random);
    run(cascade, joint, reference, 30);
    // What the override allows moves with the state: equal conditions are an equal state.
    const JointState state = joint.state(0.0);
    const double before_A = cascade.step(reference, state).current_A;
    if (change % 2 == 0) {
      RC_ASSERT(cascade.set_gains(*any_cascade_settings().gains));
    } else {
      const int mode =
          static_cast<int>(reference.mode) + 1 + static_cast<int>(random.uniform() * 4.0);
      reference = finite_reference(random);
      reference.mode = static_cast<JointMode>(mode % 5);
    }
    const auto after = cascade.step(reference, state);
    RC_ASSERT(std::abs(after.current_A - before_A) < 1e-9 ||
              after.limit == JointCascade::Limit::thermal);
  }
}

// Stiffness and damping travel in the reference: a change of them within the mode is one of gains.
TEST(JointCascade, ChangesItsImpedanceWithoutAJump) {
  JointCascade::Settings settings = cascade_settings("dfki-50");
  settings.gains = JointCascade::gains_for(settings.drive, 50.0);
  settings.gains->torque = {.proportional = 0.1, .integral = 1.0};
  JointCascade cascade(settings, kRate_Hz);
  JointReference reference = {
      .mode = JointMode::impedance, .position_rad = 0.2, .stiffness_Nm_rad = 20.0};
  const JointState state = {.angle_rad = 0.0, .speed_rad_s = 0.0, .torque_Nm = 4.0};
  double last_A = 0.0;
  for (int n = 0; n < 2000; ++n) last_A = cascade.step(reference, state).current_A;
  EXPECT_NEAR(last_A, 4.0 / settings.drive.torque_per_current(), 1e-6);
  reference.stiffness_Nm_rad = 50.0;
  reference.damping_Nms_rad = 3.0;
  const auto changed = cascade.step(reference, state);
  EXPECT_NEAR(changed.current_A, last_A, 1e-9);
  EXPECT_NEAR(changed.wanted_torque_Nm, 4.0, 1e-9);
  JointCascade::Output output;
  for (int n = 0; n < 2000; ++n) output = cascade.step(reference, state);
  EXPECT_NEAR(output.wanted_torque_Nm, 10.0, 1e-6) << "and arrives";
}

TEST(JointCascade, HasTheTorqueOfItsImpedanceFromTheFirstTickOn) {
  const JointCascade::Settings settings = cascade_settings("dfki-50");
  JointCascade cascade(settings, kRate_Hz);
  const JointReference reference = {
      .mode = JointMode::impedance, .position_rad = 0.2, .stiffness_Nm_rad = 20.0};
  const JointState state = {.angle_rad = 0.0, .speed_rad_s = 0.0, .torque_Nm = 0.0};
  EXPECT_NEAR(cascade.step(reference, state).wanted_torque_Nm, 4.0, 1e-12);
  (void)cascade.step({.mode = JointMode::current}, state);
  EXPECT_NEAR(cascade.step(reference, state).wanted_torque_Nm, 4.0, 1e-12);
}

RC_GTEST_PROP(JointCascade, GivesAFaultAndASafeCurrentForAnyNumberThatIsNotFinite, ()) {
  const JointCascade::Settings settings = any_cascade_settings();
  Random random = any_random();
  JointCascade cascade(settings, kRate_Hz);
  double last_A = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    const auto spoil = [&](double value) {
      const double draw = random.uniform();
      return draw < 0.05 ? kNaN : draw < 0.08 ? kInfinity : draw < 0.1 ? 1e308 : value;
    };
    const JointState state = {.angle_rad = spoil(random.normal()),
                              .speed_rad_s = spoil(random.normal()),
                              .torque_Nm = spoil(10.0 * random.normal())};
    const auto output = cascade.step(any_reference(random), state);
    RC_ASSERT(std::isfinite(output.current_A));
    RC_ASSERT(std::abs(output.current_A) <= settings.drive.peak_current_A);
    if (!std::isfinite(state.angle_rad + state.speed_rad_s + state.torque_Nm)) {
      RC_ASSERT(output.fault == Fault::input_not_finite);
      RC_ASSERT(std::abs(output.current_A) <= std::abs(last_A));
    }
    last_A = output.current_A;
  }
}

RC_GTEST_PROP(JointCascade, KeepsToItsCurrentRateWhereNothingDisturbsIt, ()) {
  JointCascade::Settings settings = any_cascade_settings();
  const Drive& drive = settings.drive;
  const double gain = drive.inertia() * settings.bandwidth_rad_s / drive.torque_per_current();
  const double rate_A_s = any_number(1.01, 3.0) * gain *
                          (0.2 * settings.bandwidth_rad_s * settings.limits.speed_rad_s +
                           drive.peak_current_A * drive.torque_per_current() / drive.inertia());
  settings.limits.current_rate_A_s = rate_A_s;
  Random random = any_random();
  JointCascade cascade(settings, kRate_Hz);
  RigidJoint joint(settings.drive);
  JointReference reference;
  double last_A = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    if (random.uniform() < 0.01) reference = any_reference(random);
    const auto output = cascade.step(reference, joint.state(0.0));
    joint.step(output.current_A, 0.0, 1.0 / kRate_Hz);
    RC_ASSERT(std::abs(output.current_A - last_A) <= rate_A_s / kRate_Hz * (1.0 + 1e-9));
    last_A = output.current_A;
  }
}

TEST(ThermalLimit, AllowsAColdWindingThePeakItselfForAnyPair) {
  for (int i = 100; i < 2000; ++i) {
    for (int k = 0; k < 5; ++k) {
      const double rated_A = 0.01 * i;
      const double peak_A = rated_A * (1.5 + 0.37 * k);
      ThermalLimit limit(rated_A, peak_A, 10.0, kRate_Hz);
      EXPECT_EQ(limit.allowed_A(), peak_A);
      for (int n = 0; n < 5; ++n) {
        limit.step(peak_A);
        ASSERT_LE(limit.allowed_A(), peak_A);
      }
    }
  }
}

TEST(ThermalLimit, AllowsThePeakForAMomentAndTheRatedCurrentForEver) {
  ThermalLimit limit(5.0, 10.0, 10.0, kRate_Hz);
  EXPECT_EQ(limit.allowed_A(), 10.0);
  int at_peak = 0;
  for (int n = 0; n < 200'000; ++n) {
    const double allowed_A = limit.allowed_A();
    at_peak += allowed_A == 10.0 ? 1 : 0;
    limit.step(allowed_A);
    ASSERT_LE(limit.load(), 1.0);
  }
  // From 0 to 3/4 of the rated square at four times it: -10 s ln(1 - 3/16).
  EXPECT_NEAR(at_peak, 2076, 2);
  EXPECT_NEAR(limit.allowed_A(), 5.0, 1e-6);
}

}  // namespace
}  // namespace torsio
