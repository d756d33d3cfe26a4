#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/allocation_counter.hpp"
#include "support/example_models.hpp"
#include "support/example_settings.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/random.hpp"
#include "torsio/signal/joint_move.hpp"

namespace torsio {
namespace {

using test::heap_calls_during;

constexpr double kRate_Hz = 1000.0;
constexpr int kCycles = 1'000'000;

/// A number, or now and then what is none.
double spoiled(Random& random, double value) {
  const double draw = random.uniform();
  if (draw < 0.002) return std::numeric_limits<double>::quiet_NaN();
  if (draw < 0.004) return std::numeric_limits<double>::infinity();
  return draw < 0.006 ? 1e308 : value;
}

// Every mode, the fault paths, and gains changed on the way.
TEST(JointCascade, NeverTouchesTheHeapInAMillionCycles) {
  const Drive drive = drive_of(data_sheet("dfki-50"));
  JointCascade cascade(
      {.drive = drive,
       .limits = {.lowest_rad = -1.0, .highest_rad = 1.0, .speed_rad_s = 2.0, .load_Nm = 2.0},
       .has_torque = true},
      kRate_Hz);
  const JointCascade::Gains gains = JointCascade::gains_for(drive, 40.0);
  Random random(1);
  int faults = 0;
  EXPECT_EQ(heap_calls_during([&] {
              for (int n = 0; n < kCycles; ++n) {
                const auto mode = static_cast<JointMode>(n / 1000 % 5);
                const auto output = cascade.step(
                    {.mode = mode,
                     .position_rad = spoiled(random, random.normal()),
                     .torque_Nm = random.normal()},
                    {.angle_rad = spoiled(random, 0.5), .speed_rad_s = 0.1, .torque_Nm = 1.0});
                faults += output.fault != Fault::none ? 1 : 0;
                if (n % 777 == 0) static_cast<void>(cascade.set_gains(gains));
              }
              cascade.reset();
            }),
            0U);
  EXPECT_GT(faults, kCycles / 1000);
}

TEST(TorqueController, NeverTouchesTheHeapInAMillionCycles) {
  EstimatorSettings model = test::example_settings();
  model.ranges = {.lowest = {-0.02, -0.1}, .highest = {0.02, 0.1}, .margin = 0.1};
  TorqueLoopCore::Settings settings = {
      .deflection = {.joint = series_elastic_joint(data_sheet("dfki-50"))},
      .friction = FrictionCompensation{},
      .observer_cutoff_Hz = 5.0};
  TorqueController controller(ModelInverse(model, test::example<Polynomial>()), settings, kRate_Hz);
  JointImpedance impedance({.gains = {20.0, 1.0}}, kRate_Hz);
  Random random(2);
  int faults = 0;
  EXPECT_EQ(heap_calls_during([&] {
              for (int n = 0; n < kCycles; ++n) {
                JointSample sample;
                sample.motor_angle_rad = spoiled(random, 0.01 * random.normal());
                sample.gear_angle_rad = spoiled(random, 0.01 * random.normal());
                sample.joint_angle_rad = 0.0;
                const auto wish = impedance.step({.angle_rad = spoiled(random, 0.1)},
                                                 {.angle_rad = 0.0, .speed_rad_s = 0.0});
                const auto output = controller.step(wish.torque_Nm, sample);
                faults += output.fault != Fault::none ? 1 : 0;
                if (n % 777 == 0) static_cast<void>(impedance.set_gains({10.0, 1.0}));
              }
              controller.reset();
            }),
            0U);
  EXPECT_GT(faults, kCycles / 1000);
}

TEST(TubeImpedance, NeverTouchesTheHeapInAMillionCycles) {
  TubeImpedance impedance(
      TubeImpedance::settings_of(data_sheet("harmonic-drive"), TubeImpedance::kZero), kRate_Hz);
  JointMove move({.waypoints_rad = {0.0, 1.0, -0.5}}, kRate_Hz);
  Random random(3);
  double sum_A = 0.0;
  EXPECT_EQ(
      heap_calls_during([&] {
        for (int n = 0; n < kCycles; ++n) {
          const auto wish = move.step();
          sum_A +=
              impedance
                  .step(wish.position_rad, wish.velocity_rad_s,
                        {.rotor_rad = spoiled(random, 0.1), .middle_rad = 0.0, .joint_rad = 0.0})
                  .current_A;
        }
      }),
      0U);
  EXPECT_TRUE(std::isfinite(sum_A));
}

}  // namespace
}  // namespace torsio
