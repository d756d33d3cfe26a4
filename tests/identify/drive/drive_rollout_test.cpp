#include "identify/drive/drive_rollout.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/aligned_vector.hpp"

namespace torsio {
namespace {

using enum DriveParameter;

DriveLog test_log(CommandKind kind) {
  DriveLog log;
  log.kind = kind;
  log.sample_period_s = 0.005;
  log.gain = kind == CommandKind::goal_to_torque ? 60.0 : 0.6;
  log.speed_gain = 2.0;
  log.limit = kind == CommandKind::goal_to_torque ? 20.0 : 1.0;
  log.supply_V = 24.0;
  log.load.load = {.gravity_Nm = 4.0, .inertia_kg_m2 = 0.3, .zero_rad = 0.05};
  for (int n = 0; n < 400; ++n) {
    log.command.push_back(0.6 * std::sin(0.02 * n) + 0.2 * std::sin(0.11 * n));
    log.angle_rad.push_back(0.0);
    log.enabled.push_back(n >= 250 && n < 300 ? 0.0 : 1.0);
  }
  return log;
}

DriveValues test_values() {
  DriveValues values = neutral_drive_values();
  at(values, torque_constant) = 2.0;
  at(values, resistance) = 3.0;
  at(values, armature) = 0.05;
  at(values, zero) = -0.02;
  at(values, coulomb) = 0.2;
  at(values, viscous) = 0.1;
  at(values, delay) = 0.0065;
  at(values, load_friction) = 0.05;
  at(values, load_stribeck) = 0.04;
  at(values, load_speed) = 0.3;
  at(values, stribeck) = 0.1;
  at(values, stribeck_speed) = 0.2;
  at(values, resistance_rise) = 0.7;
  at(values, duty_exponent) = 0.85;
  at(values, direction) = 0.2;
  at(values, stiffness) = 300.0;
  at(values, spring_damping) = 0.4;
  at(values, bearing) = 0.1;
  at(values, bearing_viscous) = 0.05;
  return values;
}

double command_at(const DriveLog& log, double place) {
  place = std::clamp(place, 0.0, static_cast<double>(log.size() - 1));
  const auto below = std::min(static_cast<std::size_t>(place), log.size() - 2);
  return log.command[below] +
         (place - static_cast<double>(below)) * (log.command[below + 1] - log.command[below]);
}

/// The equations of `DriveParameter` with one mass, in scalar code.
std::vector<double> one_mass(const DriveLog& log, const DriveValues& p, double angle) {
  constexpr int kSteps = 5;
  const double dt = log.sample_period_s / kSteps;
  const double inertia = log.load.load.inertia_kg_m2 + at(p, armature);
  double speed = 0.0;
  std::vector<double> angles;
  for (std::size_t n = 0; n < log.size(); ++n) {
    angles.push_back(angle);
    for (int k = 0; k < kSteps; ++k) {
      const double place = static_cast<double>(n) + static_cast<double>(k) / kSteps -
                           at(p, delay) / log.sample_period_s;
      double d = std::clamp(log.gain * (command_at(log, place) - angle), -log.limit, log.limit);
      const double size = std::abs(d);
      d = std::copysign(std::pow(size, at(p, duty_exponent)), d);
      const double r = at(p, resistance) + at(p, resistance_rise) * size * size;
      const double motor = log.enabled[n] * at(p, torque_constant) *
                           (log.supply_V * d - at(p, torque_constant) * speed) / r;
      const double gravity =
          -log.load.load.gravity_Nm * std::sin(angle + log.load.load.zero_rad + at(p, zero));
      const double load =
          std::abs(motor * (1.0 + at(p, direction)) - gravity * (1.0 - at(p, direction)));
      const double bound =
          at(p, coulomb) + at(p, load_friction) * load +
          at(p, load_stribeck) * load * std::exp(-std::abs(speed) / at(p, load_speed)) +
          at(p, stribeck) * std::exp(-std::abs(speed) / at(p, stribeck_speed)) +
          at(p, viscous) * std::abs(speed);
      const double friction = std::clamp(inertia / dt * speed + motor + gravity, -bound, bound);
      speed += dt / inertia * (motor + gravity - friction);
      angle += dt * speed;
    }
  }
  return angles;
}

/// The outputs of one lane.
struct Rolled {
  std::vector<double> angle_rad;
  std::vector<double> joint_angle_rad;
  std::vector<double> joint_torque_Nm;
};

Rolled rolled(const DriveLog& log, const DriveRun& run, const DriveLanes& lanes,
              const RolloutOptions& options, std::size_t lane = 0) {
  detail::AlignedVector<double> angle(run.samples * kDriveLanes);
  detail::AlignedVector<double> joint(run.samples * kDriveLanes);
  detail::AlignedVector<double> torque(run.samples * kDriveLanes);
  roll_out(log, run, lanes, options, {angle.data(), joint.data(), torque.data()});
  Rolled one;
  for (std::size_t n = lane; n < angle.size(); n += kDriveLanes) {
    one.angle_rad.push_back(angle[n]);
    one.joint_angle_rad.push_back(joint[n]);
    one.joint_torque_Nm.push_back(torque[n]);
  }
  return one;
}

std::vector<double> kernel_angles(const DriveLog& log, const DriveValues& values,
                                  const DriveTerms& terms, std::size_t lane,
                                  DriveIntegrator integrator = DriveIntegrator::midpoint_speed,
                                  double step_s = 0.001) {
  DriveLanes lanes{};
  for (std::size_t k = 0; k < kDriveLanes; ++k) {
    DriveValues other = values;
    at(other, coulomb) *= k == lane ? 1.0 : 1.5;
    lanes.set(k, other);
  }
  return rolled(log, {.first = 0, .samples = log.size(), .angle_rad = 0.1}, lanes,
                {terms, step_s, integrator}, lane)
      .angle_rad;
}

DriveTerms terms_of_one_mass() {
  DriveTerms terms = DriveTerms().set();
  for (const DriveTerm term : {DriveTerm::spring, DriveTerm::hysteresis, DriveTerm::backlash,
                               DriveTerm::bearing, DriveTerm::presliding, DriveTerm::joint_inertia})
    terms.reset(static_cast<std::size_t>(term));
  return terms;
}

TEST(DriveRollouts, AreThoseOfTheEquationsInEachLane) {
  const DriveLog log = test_log(CommandKind::goal_to_duty);
  const std::vector<double> wanted = one_mass(log, test_values(), 0.1);
  for (const std::size_t lane : {std::size_t{0}, std::size_t{7}, kDriveLanes - 1}) {
    const std::vector<double> found = kernel_angles(log, test_values(), terms_of_one_mass(), lane,
                                                    DriveIntegrator::semi_implicit_euler);
    for (std::size_t n = 0; n < log.size(); ++n) ASSERT_NEAR(found[n], wanted[n], 1e-9) << n;
  }
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n) largest = std::max(largest, std::abs(a[n] - b[n]));
  return largest;
}

// With dry friction the ends of motions are of first order with any fixed step.
TEST(DriveRollouts, OfLongStepsAreNearThoseOfShortSteps) {
  using enum DriveIntegrator;
  DriveLog log = test_log(CommandKind::goal_to_duty);
  const DriveTerms terms = drive_terms(
      {DriveTerm::base, DriveTerm::delay, DriveTerm::resistance_rise, DriveTerm::duty_exponent});
  DriveValues values = test_values();
  at(values, coulomb) = 0.05;
  const auto angles = [&](DriveIntegrator integrator, double step_s) {
    return kernel_angles(log, values, terms, 0, integrator, step_s);
  };
  const std::vector<double> exact = angles(midpoint_speed, 1e-5);
  EXPECT_LT(largest_difference(angles(semi_implicit_euler, 1e-5), exact), 1e-4);
  const double of_first_order = largest_difference(angles(semi_implicit_euler, 0.0025), exact);
  const double of_second_order = largest_difference(angles(midpoint_speed, 0.0025), exact);
  EXPECT_LT(of_second_order, 0.2 * of_first_order);
}

TEST(DriveRollouts, ApplyAHeldCommandAtTheTimeOfItsDelay) {
  DriveLog log = test_log(CommandKind::torque);
  log.enabled.clear();
  log.command.assign(log.size(), 0.0);
  std::fill(log.command.begin() + 20, log.command.end(), 1.0);
  log.command_end = log.command;
  log.load.load = {.gravity_Nm = 0.0, .inertia_kg_m2 = 0.9, .zero_rad = 0.0};
  DriveValues values = neutral_drive_values();
  at(values, armature) = 0.1;
  const RolloutOptions options{drive_terms({DriveTerm::base, DriveTerm::delay}), 0.0025};
  for (const double delay_s : {-0.0031, 0.0, 0.0007, 0.0049, 0.0122}) {
    at(values, delay) = delay_s;
    const Rolled found = rolled(log, {.first = 0, .samples = 60}, DriveLanes::all(values), options);
    const double time_s = 59 * log.sample_period_s - 20 * log.sample_period_s - delay_s;
    EXPECT_NEAR(found.angle_rad.back(), 0.5 * time_s * time_s, 2e-6) << delay_s;
  }
}

TEST(DriveRollouts, BeginWithTheTorqueOfADelayedLaw) {
  DriveLog log = test_log(CommandKind::goal_to_torque);
  log.command.assign(log.size(), 0.6);
  log.gain = 1.0;
  log.speed_gain = 0.0;
  log.load.load = {.gravity_Nm = 0.0, .inertia_kg_m2 = 100.0, .zero_rad = 0.0};
  DriveValues values = neutral_drive_values();
  at(values, armature) = 1.0;
  at(values, delay) = 0.03;
  const DriveLanes lanes = DriveLanes::all(values);
  const Rolled found = rolled(log, {.first = 0, .samples = 5}, lanes,
                              {drive_terms({DriveTerm::base, DriveTerm::delay}), 0.001});
  EXPECT_DOUBLE_EQ(found.joint_torque_Nm.front(), 0.6);
  EXPECT_NEAR(found.angle_rad[4], 0.5 * 0.6 / 101.0 * 0.02 * 0.02, 1e-8);
}

TEST(DriveRollouts, DelayALawByManyShortSteps) {
  DriveLog law = test_log(CommandKind::goal_to_torque);
  law.sample_period_s = 0.0001;
  law.enabled.clear();
  law.gain = 1.0;
  law.speed_gain = 0.0;
  law.load.load = {.gravity_Nm = 0.0, .inertia_kg_m2 = 1e6, .zero_rad = 0.0};  // hardly moves
  DriveLog torque = law;
  torque.kind = CommandKind::torque;
  DriveValues values = neutral_drive_values();
  at(values, armature) = 1.0;
  at(values, delay) = 0.03;
  const RolloutOptions options{drive_terms({DriveTerm::base, DriveTerm::delay}), 0.0001};
  const DriveRun run{.first = 0, .samples = law.size()};
  const DriveLanes lanes = DriveLanes::all(values);
  const std::vector<double> of_law = rolled(law, run, lanes, options).joint_torque_Nm;
  const std::vector<double> of_torque = rolled(torque, run, lanes, options).joint_torque_Nm;
  for (std::size_t n = 302; n < law.size(); ++n)  // after the delay
    EXPECT_NEAR(of_law[n], of_torque[n], 1e-6) << n;
}

TEST(DriveRollouts, HaveNoTorqueWithoutDuty) {
  DriveLog log = test_log(CommandKind::duty);
  log.command.assign(log.size(), 0.0);
  log.load.load.gravity_Nm = 0.0;
  DriveValues values = test_values();
  at(values, coulomb) = 0.0;
  at(values, duty_exponent) = 0.3;
  const Rolled found = rolled(log, {.first = 0, .samples = log.size()}, DriveLanes::all(values),
                              {drive_terms({DriveTerm::base, DriveTerm::duty_exponent}), 0.001});
  EXPECT_EQ(found.angle_rad.back(), 0.0);
}

TEST(DriveRollouts, HaveNoTorqueInTheBacklash) {
  DriveLog log = test_log(CommandKind::torque);
  log.command.assign(log.size(), 0.0);
  log.load.load.gravity_Nm = 0.0;
  DriveValues values = neutral_drive_values();
  at(values, armature) = 0.1;
  at(values, stiffness) = 300.0;
  at(values, spring_damping) = 5.0;
  at(values, hysteresis) = 2.0;
  at(values, hysteresis_width) = 0.01;
  at(values, backlash) = 0.05;
  const Rolled found = rolled(log, {.first = 0, .samples = 100}, DriveLanes::all(values),
                              {drive_terms({DriveTerm::base, DriveTerm::spring,
                                            DriveTerm::hysteresis, DriveTerm::backlash}),
                               0.001});
  EXPECT_EQ(found.joint_torque_Nm.back(), 0.0);
  // The motor moves, the joint does not until the backlash is passed.
  log.command.assign(log.size(), 0.4);
  const Rolled moved = rolled(log, {.first = 0, .samples = 100}, DriveLanes::all(values),
                              {drive_terms({DriveTerm::base, DriveTerm::spring,
                                            DriveTerm::hysteresis, DriveTerm::backlash}),
                               0.001});
  for (std::size_t n = 0; n < 100 && moved.angle_rad[n] < 0.05; ++n) {
    EXPECT_EQ(moved.joint_torque_Nm[n], 0.0) << n;
    EXPECT_EQ(moved.joint_angle_rad[n], 0.0) << n;
  }
  EXPECT_GT(moved.joint_torque_Nm.back(), 0.0);
}

TEST(DriveRollouts, BeginWithAJointThatHangsOnASoftSpring) {
  DriveLog log = test_log(CommandKind::torque);
  log.load.load = {.gravity_Nm = 8.0, .inertia_kg_m2 = 0.3, .zero_rad = 0.2};
  DriveLanes lanes{};
  for (std::size_t lane = 0; lane < kDriveLanes; ++lane) {
    DriveValues values = neutral_drive_values();
    at(values, armature) = 0.1;
    at(values, stiffness) = 2.0 + 2.0 * static_cast<double>(lane);  // softer than gravity at first
    lanes.set(lane, values);
  }
  for (const double angle : {0.3, 1.5, 3.0, -2.5})
    for (std::size_t lane = 0; lane < kDriveLanes; ++lane) {
      const Rolled found = rolled(log, {.first = 0, .samples = 2, .angle_rad = angle}, lanes,
                                  {drive_terms({DriveTerm::base, DriveTerm::spring}), 0.001}, lane);
      const double joint = found.joint_angle_rad.front();
      const double stiffness_Nm_rad = 2.0 + 2.0 * static_cast<double>(lane);
      EXPECT_NEAR(joint + 8.0 / stiffness_Nm_rad * std::sin(joint + 0.2), angle, 1e-9) << lane;
    }
}

TEST(DriveRollouts, KeepTheEnergyOfAnElasticPendulumWithoutFriction) {
  DriveLog log = test_log(CommandKind::torque);
  for (double& value : log.command) value = 0.0;
  DriveValues values = test_values();
  for (const DriveParameter none : {coulomb, viscous, load_friction, load_stribeck, stribeck,
                                    spring_damping, bearing, bearing_viscous, zero})
    at(values, none) = 0.0;
  log.load.load.zero_rad = 0.0;
  log.load.load.gravity_Nm = 0.0;
  const DriveTerms terms = drive_terms({DriveTerm::base, DriveTerm::spring});
  // Without gravity both masses move on at the speed that they had.
  const Rolled found =
      rolled(log, {.first = 0, .samples = log.size(), .angle_rad = 0.0, .speed_rad_s = 1.0},
             DriveLanes::all(values), {terms, 0.001});
  const double duration = log.sample_period_s * static_cast<double>(log.size() - 1);
  EXPECT_NEAR(found.angle_rad.back(), duration, 1e-9);
}

TEST(DriveRollouts, OfTwoMassesHaveTheResonanceOfTheSpring) {
  DriveLog log = test_log(CommandKind::torque);
  log.sample_period_s = 0.001;
  log.command.assign(4000, 0.0);
  log.angle_rad.assign(4000, 0.0);
  log.enabled.clear();
  for (int n = 0; n < 20; ++n) log.command[n] = 10.0;  // a blow
  log.load.load = {.gravity_Nm = 0.0, .inertia_kg_m2 = 0.3, .zero_rad = 0.0};
  DriveValues values = neutral_drive_values();
  at(values, armature) = 0.1;
  at(values, stiffness) = 300.0;
  const std::vector<double> torque =
      rolled(log, {.first = 0, .samples = log.size()}, DriveLanes::all(values),
             {drive_terms({DriveTerm::base, DriveTerm::spring}), 0.001})
          .joint_torque_Nm;
  int crossings = 0;
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t n = 100; n + 1 < log.size(); ++n)
    if (torque[n] < 0.0 && torque[n + 1] >= 0.0) {
      if (crossings++ == 0) first = n;
      last = n;
    }
  ASSERT_GT(crossings, 10);
  const double frequency_Hz = (crossings - 1) / (0.001 * static_cast<double>(last - first));
  const double wanted_Hz = std::sqrt(300.0 * (1.0 / 0.1 + 1.0 / 0.3)) / (2.0 * M_PI);
  EXPECT_NEAR(frequency_Hz, wanted_Hz, 0.01 * wanted_Hz);
}

TEST(DriveRollouts, OfALawDelayItsTorque) {
  const DriveLog log = test_log(CommandKind::goal_to_torque);
  DriveValues values = test_values();
  at(values, delay) = 0.0;
  const DriveTerms with = drive_terms({DriveTerm::base, DriveTerm::delay});
  const DriveTerms without = drive_terms({DriveTerm::base});
  // The speed that a delayed law reads is half a step old.
  EXPECT_LT(largest_difference(kernel_angles(log, values, with, 0),
                               kernel_angles(log, values, without, 0)),
            5e-3);
  at(values, delay) = 0.01;
  const std::vector<double> late = kernel_angles(log, values, with, 0);
  const std::vector<double> now = kernel_angles(log, values, without, 0);
  EXPECT_NE(late, now);
  for (const double angle : late) EXPECT_TRUE(std::isfinite(angle));
}

}  // namespace
}  // namespace torsio
