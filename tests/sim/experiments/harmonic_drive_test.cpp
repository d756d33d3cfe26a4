#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "sim/experiments/results.hpp"
#include "sim/loops/bench_impedance_loop.hpp"
#include "sim/plant/energy_audit.hpp"
#include "sim/plant/plant.hpp"
#include "support/straight_line.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::largest;
using test::range;

constexpr const char* kTubes[] = {"harmonic-drive", "harmonic-drive:soft", "harmonic-drive:rigid"};
constexpr double kTubeRatio = 2.0;
constexpr double kGearRatio = 51.0;
constexpr double kOutputCode_deg = 360.0 / (1U << 17U);

/// The two-body model of specification 2: rotor and output on the tube, an ideal gear between them.
/// The wave generator is so light, and the gear so stiff, that each moves the modes by less than
/// 0.3 %.
PlantParameters ideal(const std::string& name) {
  PlantParameters parts = plant_parameters(data_sheet(name));
  std::get<Gear::Parameters>(parts.first).damping_Nms_rad = 0.0;
  parts.second = Gear::Parameters{.ratio = kGearRatio, .stiffness_Nm_rad = 3e7};
  parts.middle_inertia_kg_m2 = 1e-6;
  parts.rotor_friction = {};
  parts.middle_friction = {};
  parts.bearing = {};
  parts.joint_viscous_Nms_rad = 0.0;
  parts.motor.ripple = 0.0;
  return parts;
}

/// Frequency of the tube's twist, with which the rotor starts.
double mode_Hz(const PlantParameters& parts, bool is_motor_held, bool is_locked) {
  Plant plant(parts);
  const double twist_rad = 1e-3;
  if (is_motor_held) {
    plant.reset(
        PlantState{.middle_angle_rad = twist_rad, .joint_angle_rad = twist_rad / kGearRatio});
  } else {
    plant.reset(PlantState{.rotor_angle_rad = kTubeRatio * twist_rad});
  }
  const double step_s = plant.longest_step();
  const int steps = static_cast<int>(0.5 / step_s);
  int crossings = 0;
  double first_s = 0.0;
  double last_s = 0.0;
  double mean = 0.0;  // the gear's own mode, a thousand times faster, is averaged out
  for (int i = 1; i <= steps; ++i) {
    const double before = mean;
    EXPECT_EQ(plant.step({.is_motor_held = is_motor_held}, {.is_locked = is_locked}, step_s),
              Fault::none);
    mean += 0.02 * (plant.first_twist() - mean);
    if (i < 1000 || before * mean > 0.0) continue;
    last_s = step_s * (i - mean / (mean - before));
    if (crossings++ == 0) first_s = last_s;
  }
  EXPECT_GT(crossings, 30);
  return 0.5 * (crossings - 1) / (last_s - first_s);
}

// Specification 7 has two rows. That with the constant efficiency 0.5 (62.99, 37.23, 36.73 Hz, and
// the rigid-body pole at -4.29 1/s) is the paper's linear model, whose stiffness matrix is not
// symmetric: it gives back more work than it took (erratum 004-1), and no passive plant has those
// modes. These are the modes for an efficiency of 1.
TEST(HarmonicDrive, HasTheNaturalFrequenciesOfItsTwoBodyModel) {
  const PlantParameters stiff = ideal("harmonic-drive");
  EXPECT_NEAR(mode_Hz(stiff, false, false), 72.92, 0.01 * 72.92) << "free";
  EXPECT_NEAR(mode_Hz(stiff, false, true), 51.18, 0.01 * 51.18) << "output locked";
  EXPECT_NEAR(mode_Hz(stiff, true, false), 51.94, 0.01 * 51.94) << "motor locked";
  const PlantParameters soft = ideal("harmonic-drive:soft");
  EXPECT_NEAR(mode_Hz(soft, false, false), 43.09, 0.01 * 43.09) << "free, soft tube";
}

TEST(HarmonicDrive, CoastsWithTheRigidBodyPole) {
  PlantParameters parts = ideal("harmonic-drive");
  parts.joint_viscous_Nms_rad = 6.5;
  Plant plant(parts);
  plant.reset(PlantState{.rotor_speed_rad_s = kTubeRatio * kGearRatio,
                         .middle_speed_rad_s = kGearRatio,
                         .joint_speed_rad_s = 1.0});
  ASSERT_EQ(plant.step({}, {}, 0.3), Fault::none);
  const double rotor_at_joint = parts.rotor_inertia_kg_m2 * std::pow(kTubeRatio * kGearRatio, 2);
  const double pole_1_s = 6.5 / (1.0 + rotor_at_joint);
  EXPECT_NEAR(-std::log(plant.state().joint_speed_rad_s) / 0.3, pole_1_s, 0.02 * pole_1_s);
}

TEST(HarmonicDrive, RatedTorqueTwistsALosslessTubeByEightDegrees) {
  Plant plant(ideal("harmonic-drive"));
  const Load rated{.external_torque_Nm = -292.0};
  plant.reset(0.0, rated);
  EXPECT_NEAR(deg_from_rad(plant.first_twist()), 8.0109, 1e-4);
  ASSERT_EQ(plant.step({.is_motor_held = true}, rated, 0.1), Fault::none);
  EXPECT_NEAR(deg_from_rad(plant.first_twist()), 8.0109, 1e-4) << "no equilibrium";
  EXPECT_NEAR(plant.torques().first_on_rotor_Nm, 2.863, 1e-3);
}

TEST(HarmonicDrive, RefusesAStepTooLongForTheRigidTubeAndNamesTheLimit) {
  const PlantParameters rigid = plant_parameters(data_sheet("harmonic-drive:rigid"));
  EXPECT_NO_THROW(Plant(rigid, 5e-5)) << "specification 4.6";
  EXPECT_NO_THROW(Plant(plant_parameters(data_sheet("harmonic-drive")), 1e-4));
  try {
    Plant(rigid, 1e-4);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.report().expected, "0 s < step <= 5.7e-05 s");
    EXPECT_EQ(error.report().found, "0.0001 s");
  }
}

// Specification 2: at 20 Nm theta_a = 0.19 deg and theta_s = -0.55 deg.
TEST(BenchImpedanceLoop, YieldsAsItsLinearModelSays) {
  PlantParameters parts = ideal("harmonic-drive");
  parts.joint_viscous_Nms_rad = 65.0;  // ten times: it settles sooner, where it would anyway
  Plant plant(parts);
  const BenchImpedanceLoop loop(parts, BenchImpedanceLoop::kHigh, BenchImpedanceLoop::Twist::tube);
  for (int tick = 0; tick < 1000; ++tick) {
    const PlantState& s = plant.state();
    const double current_A =
        loop.step(0.0, s.rotor_angle_rad, s.middle_angle_rad, s.joint_angle_rad);
    ASSERT_EQ(plant.step({.current_A = current_A}, {.external_torque_Nm = 20.0}, 1e-3),
              Fault::none);
  }
  const double twist_rad = -20.0 / kGearRatio / 40.95;
  const double motor_Nm = -20.0 / kGearRatio / kTubeRatio;
  const double yield_rad = -(motor_Nm / 5.0 + twist_rad) / 15.0;
  EXPECT_NEAR(deg_from_rad(plant.first_twist()), -0.55, 0.005);
  EXPECT_NEAR(plant.state().joint_angle_rad, yield_rad, 0.01 * yield_rad);
  EXPECT_NEAR(deg_from_rad(plant.state().joint_angle_rad), 0.19, 0.005);
}

TEST(BenchImpedanceLoop, RefusesOtherActuatorsAndImpossibleGains) {
  const auto make = [](const char* actuator, double gain) {
    return BenchImpedanceLoop(plant_parameters(data_sheet(actuator)), {gain, 1.0},
                              BenchImpedanceLoop::Twist::tube);
  };
  EXPECT_NO_THROW(static_cast<void>(make("harmonic-drive", 0.0)));
  EXPECT_THROW(static_cast<void>(make("dfki-50", 1.0)), Error);
  EXPECT_THROW(static_cast<void>(make("rubber-clutch", 1.0)), Error);
  EXPECT_THROW(static_cast<void>(make("harmonic-drive", -1.0)), Error);
  EXPECT_THROW(static_cast<void>(make("harmonic-drive", std::nan(""))), Error);
}

// Properties of the recordings.

using Values = std::vector<double>;

Values tube_twist_deg(const Recording& recording) {
  const Values& rotor = recording.channel("motor_angle_rad").values;
  const Values& wave = recording.channel("wave_generator_angle_rad").values;
  Values twist(rotor.size());
  for (std::size_t i = 0; i < twist.size(); ++i)
    twist[i] = deg_from_rad(rotor[i] / kTubeRatio - wave[i]);
  return twist;
}

Values whole_twist_deg(const Recording& recording) {
  const Values& rotor = recording.channel("motor_angle_rad").values;
  const Values& joint = recording.channel("joint_angle_rad").values;
  Values twist(rotor.size());
  for (std::size_t i = 0; i < twist.size(); ++i)
    twist[i] = deg_from_rad(rotor[i] / kTubeRatio - kGearRatio * joint[i]);
  return twist;
}

/// RMSE of the linear least-squares fit, as a share of the largest value.
double share_off_the_line(const Values& x, const Values& y) {
  return test::straight_line(x, y).rmse / largest(y);
}

Recording pushed(const std::string& actuator, double torque_Nm, std::uint64_t seed = 1,
                 bool is_zero = false) {
  return simulate({.actuator = actuator,
                   .experiment = "human-torque",
                   .seed = seed,
                   .duration_s = 40.0,
                   .torque_amplitude_Nm = torque_Nm,
                   .is_impedance_zero = is_zero});
}

/// As long as the run of the prototype, and with a largest push as strong: friction makes the
/// ranges grow faster than it.
Recording pushed_as_the_prototype(const std::string& actuator, std::uint64_t seed) {
  constexpr double kLargest_Nm = 21.45;
  constexpr double kAny_Nm = 18.0;
  const Recording trial = pushed(actuator, kAny_Nm, seed);
  return pushed(actuator, kAny_Nm * kLargest_Nm / largest(trial.channel("torque_Nm").values), seed);
}

// The prototype of specification 4.5: theta_s ranges over 2.4 deg (soft), 0.83 deg (stiff) and 0.01
// deg (rigid), theta_s1 of the rigid tube over 1.35 deg, and the best line of the torque over
// theta_s is 18 to 20 % of the largest torque off; 17.9 to 21.9 % with two seeds.
TEST(HumanTorque, TwistsTheTubesAsThePrototype) {
  const auto expect_range = [](const char* tube, double range_deg, double tolerance) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const Recording recording = pushed_as_the_prototype(tube, seed);
      const Values twist = tube_twist_deg(recording);
      EXPECT_NEAR(range(twist), range_deg, tolerance * range_deg) << tube << ", seed " << seed;
      const double share = share_off_the_line(twist, recording.channel("torque_Nm").values);
      EXPECT_GT(share, 0.15) << tube << ", seed " << seed;
      EXPECT_LT(share, 0.22) << tube << ", seed " << seed;
    }
  };
  expect_range("harmonic-drive:soft", 2.36, 0.12);
  expect_range("harmonic-drive", 0.830, 0.12);
  expect_range("harmonic-drive:rigid", 0.0098, 0.15);  // ten codes of the wave generator's encoder
}

TEST(HumanTorque, RigidTubeIsSeenAtTheOutputByAFewCodesOfItsEncoder) {
  const Recording recording = pushed_as_the_prototype("harmonic-drive:rigid", 1);
  EXPECT_NEAR(range(whole_twist_deg(recording)), 1.35, 0.1);
  EXPECT_NEAR(range(whole_twist_deg(recording)) / kGearRatio / kOutputCode_deg, 10.0, 1.0);
}

TEST(HumanTorque, OutputStaysInPlaceUnderHighImpedance) {
  for (const char* tube : kTubes) {
    for (const double torque_Nm : {5.0, 20.0, 50.0}) {
      const Recording recording = pushed(tube, torque_Nm);
      const double moved_deg = deg_from_rad(range(recording.channel("joint_angle_rad").values));
      // Yields by 2 * 0.19 deg a 20 Nm without friction, half as much again with a soft tube.
      EXPECT_LT(moved_deg, 0.035 * torque_Nm) << tube << ' ' << torque_Nm;
      EXPECT_GT(moved_deg, 0.010 * torque_Nm) << tube << ' ' << torque_Nm;
      EXPECT_LT(largest(recording.channel("motor_torque_Nm").values), 0.02 * torque_Nm) << tube;
    }
  }
}

TEST(HumanTorque, ZeroImpedanceGivesWay) {
  for (const char* tube : kTubes) {
    for (const double torque_Nm : {5.0, 50.0}) {
      const double high = range(pushed(tube, torque_Nm).channel("joint_angle_rad").values);
      const double zero = range(pushed(tube, torque_Nm, 1, true).channel("joint_angle_rad").values);
      EXPECT_GT(zero, 20.0 * high) << tube << ' ' << torque_Nm;
    }
  }
}

TEST(HumanTorque, SameSeedSameRecordingOtherSeedOtherHand) {
  const Recording first = pushed("harmonic-drive", 20.0, 4);
  const Recording again = pushed("harmonic-drive", 20.0, 4);
  const Recording differing = pushed("harmonic-drive", 20.0, 5);
  for (const Channel& channel : first.channels()) {
    EXPECT_EQ(channel.values, again.channel(channel.name).values) << channel.name;
    if (channel.name == "goal_angle_rad") continue;  // the impedance controller stays at 0
    EXPECT_NE(channel.values, differing.channel(channel.name).values) << channel.name;
  }
  EXPECT_EQ(first.sample_rate_Hz(), 100.0);
}

TEST(HumanTorque, TakesFiveToFiftyNewtonMetresAtAFrequency) {
  const auto refused = [](const ExperimentSpec& changed) {
    ExperimentSpec spec = changed;
    spec.actuator = "harmonic-drive";
    spec.experiment = "human-torque";
    spec.duration_s = 0.1;
    try {
      static_cast<void>(simulate(spec));
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused({.torque_amplitude_Nm = 50.0}), "");
  EXPECT_NE(refused({.torque_amplitude_Nm = 51.0}).find("at most 50 Nm"), std::string::npos);
  EXPECT_NE(refused({.frequency_Hz = 0.0}).find("0.001 to 10 Hz"), std::string::npos);
  EXPECT_NE(refused({.lever_m = 0.1}).find("has no lever"), std::string::npos);
}

TEST(HarmonicDriveStaticCycle, TwistsTheTubeByTheTorqueLessTheFriction) {
  const Recording recording =
      simulate({.actuator = "harmonic-drive", .experiment = "static-cycle"});
  const double largest_Nm = largest(recording.channel("torque_Nm").values);
  EXPECT_NEAR(largest_Nm, 100.0, 0.5);
  // Pulled from the output, the friction carries 4.1 Nm and 12 % of the load.
  const double expected_deg = deg_from_rad((0.88 * 100.0 - 4.08) / kGearRatio / 40.95);
  EXPECT_NEAR(0.5 * range(tube_twist_deg(recording)), expected_deg, 0.1 * expected_deg);
}

TEST(HarmonicDriveHold, StaysAtRestAndYieldsALittleToAConstantTorque) {
  ExperimentSpec spec{.actuator = "harmonic-drive", .experiment = "hold", .duration_s = 10.0};
  const Recording alone = simulate(spec);
  // The wanted twist jumps by K_pp codes of the output's encoder.
  EXPECT_LT(range(tube_twist_deg(alone)), 15.0 * kOutputCode_deg);
  spec.torque_amplitude_Nm = 20.0;
  const Recording pushed_on = simulate(spec);
  EXPECT_NEAR(pushed_on.channel("torque_Nm").values.back(), -20.0, 0.2);
  const double yielded_deg = deg_from_rad(pushed_on.channel("joint_angle_rad").values.back());
  EXPECT_GT(yielded_deg, 0.05);
  EXPECT_LT(yielded_deg, 0.25);
}

TEST(HumanTorque, NoEnergyAppearsFromNothing) {
  for (const char* tube : kTubes) {
    const DataSheet sheet = data_sheet(tube);
    const PlantParameters parts = plant_parameters(sheet);
    Plant plant(parts);
    const int steps = static_cast<int>(std::ceil(1e-3 / plant.longest_step()));
    const double step_s = 1e-3 / steps;
    const BenchImpedanceLoop loop(parts, BenchImpedanceLoop::kHigh,
                                  sheet.variant == "rigid"
                                      ? BenchImpedanceLoop::Twist::tube_and_gear
                                      : BenchImpedanceLoop::Twist::tube);
    QuasiPeriodic hand({.amplitude = 20.0}, 1000.0);
    EnergyAudit audit(plant, {});
    double largest_J = 0.0;
    double largest_fall_J = 0.0;
    for (int tick = 0; tick < 30000; ++tick) {
      const PlantState& s = plant.state();
      const PlantCommand command{
          .current_A = loop.step(0.0, s.rotor_angle_rad, s.middle_angle_rad, s.joint_angle_rad)};
      const Load load{.external_torque_Nm = hand.step()};
      for (int i = 0; i < steps; ++i) {
        ASSERT_EQ(plant.step(command, load, step_s), Fault::none);
        audit.observe(plant, load, step_s);
      }
      largest_J = std::max(largest_J, audit.hysteretic_loss());
      largest_fall_J = std::max(largest_fall_J, largest_J - audit.hysteretic_loss());
    }
    EXPECT_LT(std::abs(audit.residual()), 1e-6 * audit.throughput()) << tube;
    EXPECT_LT(largest_fall_J, 1e-6) << tube << ": the gear's hysteresis gave energy";
    EXPECT_GT(audit.hysteretic_loss(), 0.01) << tube;
    EXPECT_GT(audit.lost(), 0.2 * audit.throughput()) << tube;
  }
}

}  // namespace
}  // namespace torsio
