#include "torsio/control/joint_controller.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spring_joint.hpp"
#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kNaN;
using test::kRate_Hz;
using test::SpringJoint;
using Actuation = DeflectionController::Actuation;
using Controller = JointController<LinearInverse>;

constexpr const char* kActuators[] = {"dfki-28",  "dfki-50",   "dfki-120",
                                      "dfki-300", "elastomer", "rubber-clutch"};

/// The spring's largest torque is half of what the rated current makes.
Controller::Settings controller_settings(const char* actuator,
                                         Actuation actuation = Actuation::current) {
  const DataSheet sheet = data_sheet(actuator);
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const double rated_Nm = joint.drive.rated_current_A * joint.drive.torque_per_current();
  // The velocity loop has to be faster than the deflection loop around it.
  const double spring_rad_s = std::sqrt(joint.stiffness_Nm_rad / joint.drive.inertia());
  const double bandwidth_rad_s = actuation == Actuation::velocity ? 25.0 : 50.0;
  return {.torque = {.deflection = {.joint = joint,
                                    .actuation = actuation,
                                    .bandwidth_rad_s =
                                        actuation == Actuation::velocity
                                            ? bandwidth_rad_s
                                            : std::max(bandwidth_rad_s, 1.2 * spring_rad_s)},
                     .largest_torque_Nm = 0.3 * rated_Nm},
          .limits = {.lowest_rad = -0.3,
                     .highest_rad = 0.3,
                     .speed_rad_s = 0.12 * joint.drive.supply_V /
                                    (joint.drive.torque_constant_Nm_A * joint.drive.ratio),
                     .max_unmeasured_load_Nm = 0.05 * rated_Nm,
                     .max_measured_load_Nm = 0.6 * rated_Nm}};
}

Controller controller_of(const Controller::Settings& settings) {
  return {LinearInverse(settings.torque.deflection.joint.stiffness_Nm_rad), settings, kRate_Hz};
}

const Drive& drive_of(const Controller::Settings& settings) {
  return settings.torque.deflection.joint.drive;
}

Controller::Output run(Controller& controller, SpringJoint& joint, const Drive& drive,
                       const JointReference& reference, int ticks) {
  Controller::Output output;
  for (int n = 0; n < ticks; ++n) {
    output = controller.step(reference, sample_of(joint, drive));
    joint.step(output.current_A, 1.0 / kRate_Hz);
  }
  return output;
}

TEST(JointController, FollowsTorqueAndDeflectionThroughEitherLoop) {
  for (const char* actuator : kActuators)
    for (const Actuation actuation : {Actuation::current, Actuation::velocity}) {
      const auto settings = controller_settings(actuator, actuation);
      const double torque_Nm = 0.5 * settings.torque.largest_torque_Nm;
      for (const JointMode mode : {JointMode::torque, JointMode::deflection}) {
        Controller controller = controller_of(settings);
        SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
        const double wanted_rad = std::min(
            torque_Nm / settings.torque.deflection.joint.stiffness_Nm_rad, rad_from_deg(8.0));
        const double wanted_Nm = wanted_rad * settings.torque.deflection.joint.stiffness_Nm_rad;
        run(controller, joint, drive_of(settings),
            {.mode = mode, .torque_Nm = wanted_Nm, .deflection_rad = wanted_rad}, 6000);
        EXPECT_NEAR(joint.torque_Nm(), wanted_Nm, 1e-3 * wanted_Nm)
            << actuator << ' ' << name(mode)
            << (actuation == Actuation::current ? " current" : " velocity");
      }
    }
}

TEST(JointController, RendersAnImpedanceAtTheMotorSide) {
  const auto settings = controller_settings("dfki-50");
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
  const JointReference reference = {
      .mode = JointMode::impedance, .position_rad = 0.2, .stiffness_Nm_rad = 40.0};
  run(controller, joint, drive_of(settings), reference, 5000);
  EXPECT_NEAR(joint.torque_Nm(), 40.0 * (0.2 - joint.angle_rad()), 1e-3);
}

// Paper 000, section 4: the limits are kept without a stop of the system, and released.
TEST(JointController, StaysAtALimitInSpringModesAndReleasesItAtOnce) {
  for (const Actuation actuation : {Actuation::current, Actuation::velocity}) {
    auto settings = controller_settings("dfki-50", actuation);
    settings.limits.lowest_rad = -0.2;
    settings.limits.highest_rad = 0.2;
    for (const JointMode mode : {JointMode::torque, JointMode::deflection}) {
      Controller controller = controller_of(settings);
      // Free: a torque accelerates the joint until the motor side is at its limit.
      SpringJoint joint(settings.torque.deflection.joint, JointOutput::free);
      const JointReference push = {.mode = mode, .torque_Nm = 10.0, .deflection_rad = 0.02};
      const auto held = run(controller, joint, drive_of(settings), push, 60'000);
      EXPECT_EQ(held.limit, JointCascade::Limit::position);
      EXPECT_NEAR(joint.angle_rad(), 0.2 - controller.core().cascade().position_margin(), 5e-3);
      // Nothing has wound up: the torque of the other sign begins at once.
      const JointReference back = {.mode = mode, .torque_Nm = -10.0, .deflection_rad = -0.02};
      const auto freed = run(controller, joint, drive_of(settings), back, 30);
      EXPECT_NE(freed.limit, JointCascade::Limit::position);
      EXPECT_LT(joint.torque_Nm(), -1.5) << name(mode);
    }
  }
}

TEST(JointController, FadesWithoutAMeasurementAndKeepsTheLastReference) {
  for (const Actuation actuation : {Actuation::current, Actuation::velocity}) {
    const auto settings = controller_settings("dfki-50", actuation);
    Controller controller = controller_of(settings);
    SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
    const JointReference reference = {.mode = JointMode::torque, .torque_Nm = 10.0};
    double last_A = run(controller, joint, drive_of(settings), reference, 3000).current_A;
    ASSERT_GT(last_A, 0.5);
    const auto refused = controller.step({.mode = JointMode::deflection, .deflection_rad = kNaN},
                                         sample_of(joint, drive_of(settings)));
    EXPECT_TRUE(refused.is_reference_refused);
    EXPECT_EQ(refused.fault, Fault::input_not_finite);
    EXPECT_NEAR(refused.current_A, last_A, 1e-3);
    last_A = refused.current_A;
    for (int n = 0; n < 90; ++n) {
      JointSample lost = sample_of(joint, drive_of(settings));
      (n % 3 == 0   ? lost.motor_angle_rad
       : n % 3 == 1 ? lost.gear_angle_rad
                    : lost.joint_angle_rad) = kNaN;
      const auto output = controller.step(reference, lost);
      ASSERT_EQ(output.fault, Fault::input_not_finite);
      ASSERT_NEAR(output.current_A, last_A * std::exp(-0.001 / 0.02), 1e-9);
      last_A = output.current_A;
    }
    const auto back = controller.step(reference, sample_of(joint, drive_of(settings)));
    EXPECT_EQ(back.fault, Fault::none);
    EXPECT_NEAR(back.current_A, last_A, 1e-9);
    run(controller, joint, drive_of(settings), reference, 3000);
    EXPECT_NEAR(joint.torque_Nm(), 10.0, 0.1);
  }
}

TEST(JointController, RefusesWhatContradicts) {
  const auto refusal = [](auto change, Actuation actuation = Actuation::current) -> std::string {
    auto settings = controller_settings("dfki-50", actuation);
    change(settings);
    return test::error_message([&] { static_cast<void>(controller_of(settings)); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& s) { s.torque.observer_cutoff_Hz = 10.0; }, Actuation::velocity)
                .find("acts on the speed"),
            std::string::npos);
  // 48 V / (0.104 Vs/rad 120) = 3.85 rad/s.
  EXPECT_NE(refusal([](auto& s) { s.limits.speed_rad_s = 3.9; }).find("back-EMF"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.limits.highest_rad = -0.99; }).find("no room between"),
            std::string::npos);
  // A deflection loop that is faster than the velocity loop inside it.
  EXPECT_NE(
      refusal([](auto& s) { s.torque.deflection.bandwidth_rad_s = 500.0; }, Actuation::velocity)
          .find("unstable"),
      std::string::npos);
}

// ------------------------------------------------------------------------------------ properties

JointReference any_reference(Random& random, const Controller::Settings& settings, double far) {
  const double torque_Nm = settings.torque.largest_torque_Nm;
  const auto wild = [&](double usual) {
    const double draw = random.uniform();
    return draw < 0.01 ? far * usual * random.normal() : usual * random.normal();
  };
  return {.mode = static_cast<JointMode>(6.0 * random.uniform()),
          .position_rad = wild(1.0),
          .velocity_rad_s = wild(settings.limits.speed_rad_s),
          .acceleration_rad_s2 = wild(5.0),
          .torque_Nm = wild(torque_Nm),
          .current_A = random.uniform() < 0.5 ? 0.0 : wild(drive_of(settings).rated_current_A),
          .stiffness_Nm_rad = std::abs(wild(torque_Nm)),
          .damping_Nms_rad = std::abs(wild(0.05 * torque_Nm)),
          .deflection_rad = wild(torque_Nm / settings.torque.deflection.joint.stiffness_Nm_rad)};
}

// Neither may take its damping away: the rate that they use is that of the reference.
TEST(JointController, KeepsItsDampingInModesWhoseTorqueFollowsFromMeasurements) {
  auto settings = controller_settings("dfki-50");
  const auto swings = [&](const JointReference& reference) {
    Controller controller = controller_of(settings);
    SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
    run(controller, joint, drive_of(settings), reference, 500);
    double lowest_Nm = joint.torque_Nm();
    double highest_Nm = joint.torque_Nm();
    for (int n = 0; n < 500; ++n) {
      run(controller, joint, drive_of(settings), reference, 1);
      lowest_Nm = std::min(lowest_Nm, joint.torque_Nm());
      highest_Nm = std::max(highest_Nm, joint.torque_Nm());
    }
    return highest_Nm - lowest_Nm;
  };
  const JointReference deflection = {.mode = JointMode::deflection, .deflection_rad = 0.02};
  const JointReference impedance = {
      .mode = JointMode::impedance, .position_rad = 0.2, .stiffness_Nm_rad = 40.0};
  const double plain_deflection_Nm = swings(deflection);
  const double plain_impedance_Nm = swings(impedance);
  settings.torque.feeds_rate_forward = true;
  settings.torque.friction = FrictionCompensation{};
  EXPECT_LT(swings(deflection), 2.0 * plain_deflection_Nm + 0.01);
  EXPECT_NEAR(swings(impedance), plain_impedance_Nm, 1e-9);
}

TEST(JointController, LimitsTheDeflectionByTheLargestTorque) {
  auto settings = controller_settings("dfki-50");
  settings.limits.torque_Nm = 5.0;  // below `largest_torque_Nm`
  for (const JointMode mode : {JointMode::torque, JointMode::deflection}) {
    Controller controller = controller_of(settings);
    SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
    run(controller, joint, drive_of(settings),
        {.mode = mode, .torque_Nm = 100.0, .deflection_rad = 0.5}, 3000);
    EXPECT_NEAR(joint.torque_Nm(), 5.0, 0.01) << name(mode);
  }
}

// A current that is fed forward is not a disturbance that the observer may remove.
TEST(JointController, LetsTheObserverSeeTheWholeCurrent) {
  auto settings = controller_settings("dfki-50");
  settings.torque.observer_cutoff_Hz = 10.0;
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
  const auto output = run(controller, joint, drive_of(settings),
                          {.mode = JointMode::torque, .torque_Nm = 5.0, .current_A = 0.5}, 3000);
  EXPECT_NEAR(output.torque.observer_A, 0.0, 0.02);
}

// A drive that cuts the current during a transfer winds nothing up.
TEST(JointController, TracksWhatADriveAppliedDuringATransfer) {
  const auto settings = controller_settings("dfki-50");
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::locked);
  run(controller, joint, drive_of(settings), {.mode = JointMode::current, .current_A = 0.6}, 300);
  const JointReference reference = {.mode = JointMode::torque, .torque_Nm = 1.0};
  double integral_A = 0.0;
  for (int n = 0; n < 50; ++n) {
    const auto output = controller.step(reference, sample_of(joint, drive_of(settings)));
    const double applied_A = std::min(output.current_A, 0.1);
    if (applied_A != output.current_A) controller.track(applied_A);
    joint.step(applied_A, 1.0 / kRate_Hz);
    integral_A = output.torque.integral_A;
  }
  EXPECT_LE(integral_A, 0.01);
}

// The override begins and ends where its bound meets the command: no step of the current.
TEST(JointController, OverridesAndReleasesWithoutAJump) {
  for (const Actuation actuation : {Actuation::current, Actuation::velocity}) {
    const auto settings = controller_settings("dfki-50", actuation);
    Controller controller = controller_of(settings);
    SpringJoint joint(settings.torque.deflection.joint, JointOutput::free);
    const Drive& drive = drive_of(settings);
    int changes = 0;
    auto last = run(controller, joint, drive, {.mode = JointMode::torque}, 10);
    for (int n = 0; n < 20'000; ++n) {
      const double wanted_Nm = 12.0 * std::sin(2e-3 * n);
      const auto output =
          run(controller, joint, drive, {.mode = JointMode::torque, .torque_Nm = wanted_Nm}, 1);
      if (output.limit != last.limit) ++changes;
      // A thousandth of the way of the sine, and what spring and rotor do within a tick.
      EXPECT_LT(std::abs(output.current_A - last.current_A), 0.05 * drive.peak_current_A);
      last = output;
    }
    EXPECT_GE(changes, 10);
  }
}

// 10^6 ticks: all modes, on every actuator with a spring, through both loops. The output is locked
// or free, and a person pushes it; drive friction of any sign and a spring that is 3 % stiffer than
// the controller's are the load that it does not measure. The tube of the harmonic drive is too
// stiff for a deflection loop on the current (its own controller is `TubeImpedance`), not for one on
// the velocity.
TEST(JointController, NeverLetsTheMotorSideOutOfItsLimits) {
  constexpr int kTicks = 84'000;
  Random random(19);
  std::vector<std::pair<const char*, Actuation>> joints;
  for (const char* actuator : kActuators)
    for (const Actuation actuation : {Actuation::current, Actuation::velocity})
      joints.emplace_back(actuator, actuation);
  joints.emplace_back("harmonic-drive", Actuation::velocity);
  for (const auto& [actuator, actuation] : joints) {
    for (const JointOutput end : {JointOutput::locked, JointOutput::free}) {
      auto settings = controller_settings(actuator, actuation);
      if (actuator == std::string_view("harmonic-drive")) {
        // Locked, its tube allows less motion than the margin for the load.
        if (end == JointOutput::locked) continue;
        settings.limits.speed_rad_s *= 0.5;
      }
      JointCascade::Limits& limits = settings.limits;
      // Where the output is locked, the position limits the torque of the spring.
      if (end == JointOutput::locked)
        limits.highest_rad =
            0.9 * limits.max_measured_load_Nm / settings.torque.deflection.joint.stiffness_Nm_rad;
      limits.lowest_rad = -limits.highest_rad;
      double farthest_rad = 0.0;
      double fastest_rad_s = 0.0;
      Controller controller = controller_of(settings);
      SeriesElasticJoint stiffer = settings.torque.deflection.joint;
      stiffer.stiffness_Nm_rad *= 1.03;
      SpringJoint joint(stiffer, end);
      JointReference reference;
      double push_Nm = 0.0;
      double drive_Nm = 0.0;
      double max_Nm = 0.0;
      for (int n = 0; n < kTicks / 2; ++n) {
        if (random.uniform() < 0.01) reference = any_reference(random, settings, 1e3);
        if (random.uniform() < 0.003)
          push_Nm = 0.2 * settings.torque.largest_torque_Nm * (2.0 * random.uniform() - 1.0);
        if (random.uniform() < 0.02)
          drive_Nm = (random.uniform() < 0.5 ? 0.5 : -0.5) * limits.max_unmeasured_load_Nm;
        const auto output = controller.step(reference, sample_of(joint, drive_of(settings)));
        joint.step(output.current_A, 1.0 / kRate_Hz, push_Nm, drive_Nm);
        max_Nm = std::max(max_Nm, std::abs(joint.torque_Nm()));
        farthest_rad = std::max(farthest_rad, std::abs(joint.angle_rad()));
        fastest_rad_s = std::max(fastest_rad_s, std::abs(joint.speed_rad_s()));
      }
      const std::string run_name =
          fmt::format("{} {} {}", actuator, end == JointOutput::locked ? "locked" : "free",
                      actuation == Actuation::current ? "current" : "velocity");
      EXPECT_LE(max_Nm, limits.max_measured_load_Nm) << run_name << ": beyond the condition";
      EXPECT_LE(farthest_rad, limits.highest_rad) << run_name;
      EXPECT_GT(farthest_rad, 0.3 * limits.highest_rad) << run_name << ": never near the limit";
      EXPECT_LE(fastest_rad_s, limits.speed_rad_s) << run_name;
    }
  }
}

RC_GTEST_PROP(JointController, SwitchesItsModeWithoutAJump, ()) {
  const auto settings =
      controller_settings(*rc::gen::element("dfki-28", "dfki-50", "dfki-120", "dfki-300"),
                          *rc::gen::element(Actuation::current, Actuation::velocity));
  Random random = any_random();
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::free);
  for (int change = 0; change < 20; ++change) {
    JointReference reference = any_reference(random, settings, 1.0);
    const double before_A = run(controller, joint, drive_of(settings), reference, 30).current_A;
    const int mode =
        static_cast<int>(reference.mode) + 1 + static_cast<int>(random.uniform() * 5.0);
    reference = any_reference(random, settings, 1.0);
    reference.mode = static_cast<JointMode>(mode % 6);
    const auto after = controller.step(reference, sample_of(joint, drive_of(settings)));
    // What the override allows moves with the joint.
    if (after.limit == JointCascade::Limit::none)
      RC_ASSERT(std::abs(after.current_A - before_A) < 1e-9);
    else
      RC_ASSERT(std::abs(after.current_A - before_A) < 0.3 * drive_of(settings).peak_current_A);
  }
}

TEST(JointController, KeepsLimitsThatAreSetWhileItRuns) {
  const auto settings = controller_settings("dfki-50");
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::free);
  const double speed_rad_s = settings.limits.speed_rad_s;
  ASSERT_TRUE(controller.set_limits(-0.2, 0.15, 0.5 * speed_rad_s, 3.0));
  double farthest_rad = 0.0;
  double fastest_rad_s = 0.0;
  for (int n = 0; n < 3000; ++n) {
    run(controller, joint, drive_of(settings), {.mode = JointMode::position, .position_rad = 0.29},
        1);
    farthest_rad = std::max(farthest_rad, joint.angle_rad());
    fastest_rad_s = std::max(fastest_rad_s, joint.speed_rad_s());
  }
  EXPECT_LE(farthest_rad, 0.15);
  EXPECT_GT(farthest_rad, 0.05);
  EXPECT_LE(fastest_rad_s, 0.5 * speed_rad_s);
  const auto out =
      run(controller, joint, drive_of(settings), {.mode = JointMode::torque, .torque_Nm = 5.0}, 1);
  EXPECT_EQ(out.torque.wanted_torque_Nm, 3.0);
  EXPECT_FALSE(controller.set_limits(0.1, 0.1, speed_rad_s, 3.0));
  EXPECT_FALSE(controller.set_limits(-0.2, 0.2, 2.0 * speed_rad_s, 3.0));
  EXPECT_FALSE(controller.set_limits(-0.2, 0.2, 1e-9, 3.0));
  EXPECT_FALSE(controller.set_limits(-0.2, 0.2, speed_rad_s, 0.0));
  EXPECT_FALSE(controller.set_limits(kNaN, 0.2, speed_rad_s, 3.0));
}

TEST(JointController, ChangesItsGainsWithoutAJump) {
  const auto settings = controller_settings("dfki-50");
  Controller controller = controller_of(settings);
  SpringJoint joint(settings.torque.deflection.joint, JointOutput::free);
  const JointReference reference{.mode = JointMode::position, .position_rad = 0.1};
  const double before_A = run(controller, joint, drive_of(settings), reference, 20).current_A;
  JointCascade::Gains gains = JointCascade::gains_for(drive_of(settings), 100.0);
  ASSERT_TRUE(controller.set_gains(gains));
  EXPECT_NEAR(controller.step(reference, sample_of(joint, drive_of(settings))).current_A, before_A,
              1e-9);
  gains.position_1_s = -1.0;
  EXPECT_FALSE(controller.set_gains(gains));
}

}  // namespace
}  // namespace torsio
