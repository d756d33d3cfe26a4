#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "sim/loops/bench_deflection_loop.hpp"
#include "sim/loops/bench_impedance_loop.hpp"
#include "sim/loops/bench_pd_loop.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "sim/loops/bench_torque_loop.hpp"
#include "sim/plant/plant.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;

/// A loop as a function of what is wanted and of one measurement.
struct Loop {
  std::string name;
  std::function<double(double wanted, double measured)> step;
};

std::vector<Loop> loops_with_memory() {
  const PlantParameters plant = plant_parameters(data_sheet("dfki-50"));
  const double stiffness_Nm_rad =
      std::get<Spring::Parameters>(plant.second).elastic.stiffness_Nm_rad;
  return {
      {"position",
       [loop = BenchPositionLoop(plant, kRate_Hz)](double wanted, double measured) mutable {
         return loop.step(wanted, measured);
       }},
      {"deflection",
       [loop = BenchDeflectionLoop(plant, kRate_Hz)](double wanted, double measured) mutable {
         return loop.step(wanted, measured);
       }},
      {"torque",
       [loop = BenchTorqueLoop(plant, stiffness_Nm_rad, kRate_Hz)](
           double wanted, double measured) mutable { return loop.step(wanted, measured, 0.01); }},
      {"PD", [loop = BenchPdLoop(plant, BenchPdLoop::gains(plant, 0.4, 50.0), kRate_Hz)](
                 double wanted, double measured) mutable { return loop.step(wanted, measured); }}};
}

TEST(Loops, PassOverWhatIsNotFinite) {
  std::vector<Loop> disturbed = loops_with_memory();
  std::vector<Loop> sound = loops_with_memory();
  for (std::size_t k = 0; k < disturbed.size(); ++k) {
    double held_A = 0.0;
    for (int i = 0; i < 100; ++i) {
      const double wanted = 0.01 * std::sin(0.1 * i);
      const double measured = 0.009 * std::sin(0.1 * i - 0.2);
      held_A = disturbed[k].step(wanted, measured);
      ASSERT_EQ(held_A, sound[k].step(wanted, measured)) << disturbed[k].name;
      for (const double bad : {kNaN, kInfinity, -kInfinity}) {
        ASSERT_EQ(disturbed[k].step(bad, measured), held_A) << disturbed[k].name;
        ASSERT_EQ(disturbed[k].step(wanted, bad), held_A) << disturbed[k].name;
      }
    }
    EXPECT_NE(held_A, 0.0) << disturbed[k].name;
  }
}

TEST(Loops, StartAgainAfterNumbersBeyondWhatTheyHold) {
  for (Loop& loop : loops_with_memory()) {
    constexpr double kHuge = 1e308;
    for (const double measured : {0.0, kHuge, -kHuge, kHuge})
      EXPECT_TRUE(std::isfinite(loop.step(0.0, measured))) << loop.name;
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(std::isfinite(loop.step(0.01, 0.0))) << loop.name;
  }
}

TEST(Loops, PdRefusesGainsThatAreNegativeOrNotFiniteAndNoTorque) {
  const PlantParameters plant = plant_parameters(data_sheet("dfki-50"));
  const auto make = [&](double kp, double kd, double limit) {
    return BenchPdLoop(plant, {kp, kd, limit}, kRate_Hz);
  };
  EXPECT_NO_THROW(static_cast<void>(make(0.0, 0.0, 1.0)));
  EXPECT_THROW(static_cast<void>(make(-1.0, 0.0, 1.0)), Error);
  EXPECT_THROW(static_cast<void>(make(1.0, kNaN, 1.0)), Error);
  EXPECT_THROW(static_cast<void>(make(1.0, 1.0, 0.0)), Error);
}

TEST(Loops, PdTurnsTheErrorOfTheJointIntoTorqueUpToItsLimit) {
  const PlantParameters plant = plant_parameters(data_sheet("dfki-50"));
  BenchPdLoop loop(plant, {.kp_Nm_rad = 100.0, .kd_Nms_rad = 2.0, .torque_limit_Nm = 30.0},
                   kRate_Hz);
  EXPECT_DOUBLE_EQ(loop.step(0.1, 0.0), 10.0);
  // 1 rad/s of the joint for a millisecond, 120 times that of the rotor.
  EXPECT_NEAR(loop.step(0.1, 120.0 * 1e-3), 100.0 * (0.1 - 1e-3) - 2.0 * 1.0, 1e-9);
  EXPECT_DOUBLE_EQ(loop.step(1.0, 120.0 * 1e-3), 30.0);
  EXPECT_DOUBLE_EQ(loop.step(-1.0, 120.0 * 1e-3), -30.0);
  EXPECT_NEAR(loop.current(30.0), 30.0 / (120.0 * plant.motor.torque_constant_Nm_A), 1e-12);
}

TEST(Loops, ImpedanceGivesNoCurrentForWhatIsNotFinite) {
  const BenchImpedanceLoop loop(plant_parameters(data_sheet("harmonic-drive")),
                                BenchImpedanceLoop::kHigh, BenchImpedanceLoop::Twist::tube);
  EXPECT_NE(loop.step(0.1, 0.0, 0.0, 0.0), 0.0);
  for (const double bad : {kNaN, kInfinity}) {
    EXPECT_EQ(loop.step(bad, 0.0, 0.0, 0.0), 0.0);
    EXPECT_EQ(loop.step(0.1, bad, 0.0, 0.0), 0.0);
    EXPECT_EQ(loop.step(0.1, 0.0, bad, 0.0), 0.0);
    EXPECT_EQ(loop.step(0.1, 0.0, 0.0, bad), 0.0);
  }
}

}  // namespace
}  // namespace torsio
