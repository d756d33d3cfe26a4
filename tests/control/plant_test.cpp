// The controllers on the simulated actuators, with all their friction, play and gear errors.
#include "sim/plant/plant.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "sim/loops/bench_deflection_loop.hpp"
#include "sim/loops/bench_impedance_loop.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

JointSample sample_of(const Plant& plant) {
  JointSample sample;
  sample.motor_angle_rad = plant.state().rotor_angle_rad;
  sample.gear_angle_rad = plant.state().middle_angle_rad;
  sample.joint_angle_rad = plant.state().joint_angle_rad;
  return sample;
}

struct MeanErrors {
  double torque_Nm = 0.0;
  double deflection_rad = 0.0;
};

/// The mean errors for a slow sine with a locked output.
MeanErrors mean_errors(const char* actuator, const TorqueLoopCore::Settings& settings) {
  const DataSheet sheet = data_sheet(actuator);
  Plant plant(plant_parameters(sheet));
  TorqueController controller(LinearInverse(settings.deflection.joint.stiffness_Nm_rad), settings,
                              kRate_Hz);
  const Load locked = {.is_locked = true};
  MeanErrors mean;
  constexpr int kTicks = 20'000;
  for (int n = 0; n < kTicks; ++n) {
    const double wanted_Nm = 0.25 * sheet.rating.torque_Nm.value * std::sin(2e-3 * n);
    const JointSample sample = sample_of(plant);
    const auto output = controller.step(wanted_Nm, sample);
    EXPECT_EQ(output.fault, Fault::none);
    EXPECT_EQ(plant.step({.current_A = output.current_A}, locked, 1.0 / kRate_Hz), Fault::none);
    mean.torque_Nm += std::abs(plant.torques().joint_Nm - wanted_Nm) / kTicks;
    mean.deflection_rad +=
        std::abs(output.wanted_deflection_rad - sample.spring_deflection_rad()) / kTicks;
  }
  return mean;
}

// The observer compensates the drive's friction, and the deflection follows; the torque follows
// less well, because a linear inverse does not contain the spring's own friction.
TEST(TorqueController, FollowsATorqueOnEverySeriesElasticPlant) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    TorqueLoopCore::Settings settings = {
        .deflection = {.joint = series_elastic_joint(data_sheet(actuator))}};
    const double amplitude_Nm = 0.25 * data_sheet(actuator).rating.torque_Nm.value;
    const MeanErrors plain = mean_errors(actuator, settings);
    EXPECT_LT(plain.torque_Nm, 0.15 * amplitude_Nm) << actuator;
    settings.friction = FrictionCompensation{};
    EXPECT_LT(mean_errors(actuator, settings).torque_Nm, plain.torque_Nm) << actuator;
    settings.friction.reset();
    settings.observer_cutoff_Hz = 10.0;
    EXPECT_LT(mean_errors(actuator, settings).deflection_rad, 0.7 * plain.deflection_rad)
        << actuator;
  }
}

// The bench's own loop integrates before its output, which is a tick's share of the integral.
TEST(DeflectionController, IsTheLoopOfTheBenchWithinATicksIntegral) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    const DataSheet sheet = data_sheet(actuator);
    DeflectionController controller({.joint = series_elastic_joint(sheet)}, kRate_Hz);
    BenchDeflectionLoop bench(plant_parameters(sheet), kRate_Hz);
    for (int n = 0; n < 5000; ++n) {
      const double wanted_rad = 0.005 * std::sin(3e-3 * n);
      const double deflection_rad = 0.0045 * std::sin(3e-3 * n - 0.1);
      EXPECT_NEAR(
          controller.step(wanted_rad, deflection_rad).command,
          bench.step(wanted_rad, deflection_rad),
          1.01 * controller.gains().integral * std::abs(wanted_rad - deflection_rad) / kRate_Hz +
              1e-9);
    }
  }
}

TEST(TubeImpedance, IsTheLoopOfTheBench) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  auto settings = tube_impedance_settings(sheet, TubeImpedance::kHigh);
  settings.relies_on_friction = true;
  TubeImpedance impedance(settings, kRate_Hz);
  const BenchImpedanceLoop bench(plant_parameters(sheet), BenchImpedanceLoop::kHigh,
                                 BenchImpedanceLoop::Twist::tube);
  Random random(1);
  for (int n = 0; n < 1000; ++n) {
    const double rotor_rad = 0.01 * random.normal();
    const double middle_rad = 0.005 * random.normal();
    const double joint_rad = 1e-4 * random.normal();
    EXPECT_NEAR(
        impedance
            .step(1e-3, 0.0,
                  {.rotor_rad = rotor_rad, .middle_rad = middle_rad, .joint_rad = joint_rad})
            .current_A,
        bench.step(1e-3, rotor_rad, middle_rad, joint_rad), 1e-9);
  }
}

// With a free joint after the spring, and friction and gravity as loads that only the spring's
// torque measures: the motor's side stays within its limits.
TEST(JointCascade, HoldsAPlantWithinItsLimits) {
  for (const char* actuator : {"dfki-50", "dfki-120"}) {
    const DataSheet sheet = data_sheet(actuator);
    Plant plant(plant_parameters(sheet));
    const Drive drive = drive_of(sheet);
    const double speed_rad_s = 0.8 * sheet.rating.speed_rad_s.value;
    JointCascade cascade({.drive = drive,
                          .limits = {.lowest_rad = -0.8,
                                     .highest_rad = 0.8,
                                     .speed_rad_s = speed_rad_s,
                                     .max_unmeasured_load_Nm = 2.0 * drive.coulomb_Nm +
                                                               drive.viscous_Nms_rad * speed_rad_s,
                                     .max_measured_load_Nm = 10.0},
                          .has_torque = true},
                         kRate_Hz);
    const Load load = lever(1.0, 0.5);
    const double stiffness_Nm_rad = series_elastic_joint(sheet).stiffness_Nm_rad;
    Differentiator speed(kRate_Hz, 120.0);
    Random random(4);
    JointReference reference;
    double farthest_rad = 0.0;
    double fastest_rad_s = 0.0;
    for (int n = 0; n < 60'000; ++n) {
      if (n % 200 == 0)
        reference = {.mode = static_cast<JointMode>(3.0 * random.uniform()),
                     .position_rad = random.normal(),
                     .velocity_rad_s = 3.0 * random.normal(),
                     .current_A = 0.5 * drive.peak_current_A * random.normal()};
      const JointSample sample = sample_of(plant);
      const double angle_rad = sample.motor_angle_rad / drive.ratio;
      const auto output =
          cascade.step(reference, {.angle_rad = angle_rad,
                                   .speed_rad_s = speed.step(angle_rad),
                                   .torque_Nm = stiffness_Nm_rad * sample.spring_deflection_rad()});
      ASSERT_EQ(plant.step({.current_A = output.current_A}, load, 1.0 / kRate_Hz), Fault::none);
      farthest_rad = std::max(farthest_rad, std::abs(angle_rad));
      fastest_rad_s =
          std::max(fastest_rad_s, std::abs(plant.state().rotor_speed_rad_s) / drive.ratio);
    }
    EXPECT_LE(farthest_rad, 0.8) << actuator;
    EXPECT_GT(farthest_rad, 0.5) << actuator << ": the limit was never reached";
    EXPECT_LE(fastest_rad_s, speed_rad_s) << actuator;
  }
}

}  // namespace
}  // namespace torsio
