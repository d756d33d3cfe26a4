#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "sim/loops/bench_deflection_loop.hpp"
#include "sim/loops/bench_impedance_loop.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "sim/loops/bench_torque_loop.hpp"
#include "sim/plant/plant.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/data_sheet.hpp"

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
  return {{"position",
           [loop = BenchPositionLoop(plant, kRate_Hz)](double wanted, double measured) mutable {
             return loop.step(wanted, measured);
           }},
          {"deflection",
           [loop = BenchDeflectionLoop(plant, kRate_Hz)](double wanted, double measured) mutable {
             return loop.step(wanted, measured);
           }},
          {"torque", [loop = BenchTorqueLoop(plant, stiffness_Nm_rad, kRate_Hz)](
                         double wanted, double measured) mutable {
             return loop.step(wanted, measured, 0.01);
           }}};
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
