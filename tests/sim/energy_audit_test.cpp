#include "torsio/sim/energy_audit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/series_elastic.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiment.hpp"
#include "torsio/sim/position_loop.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;

TEST(EnergyAudit, NoEnergyAppearsFromNothingInASweep) {
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const PlantParameters parts = plant_parameters(sheet);
    Plant plant(parts, kStep_s);
    const Load load = lever(9.0, sweep_protocol(sheet.name).train_lever_m.back());
    plant.reset(0.0, load);
    EnergyAudit audit(plant, load);
    PositionLoop loop(parts, 1000.0);
    TrapezoidSweep sweep({.amplitude = rad_from_deg(60.0),
                          .speed = rad_from_deg(10.0),
                          .acceleration = rad_from_deg(30.0)},
                         1000.0);
    double largest_slip_J = 0.0;
    for (int tick = 0; tick < 30000; ++tick) {
      const PlantCommand command{.current_A =
                                     loop.step(sweep.step(), plant.state().rotor_angle_rad)};
      for (int i = 0; i < 10; ++i) {
        ASSERT_EQ(plant.step(command, load, kStep_s), Fault::none);
        audit.observe(plant, load, kStep_s);
      }
      const double elapsed_s = 1e-3 * (tick + 1);
      const double allowed_J = 1e-3 * elapsed_s * (1e-2 + audit.throughput());
      ASSERT_LE(std::abs(audit.residual()), allowed_J) << sheet.name << " at " << elapsed_s << " s";
      largest_slip_J = std::max(largest_slip_J, audit.hysteretic_loss());
      ASSERT_GE(audit.hysteretic_loss(), largest_slip_J - 2e-3) << "a slip element gave energy";
    }
    EXPECT_GT(audit.lost(), 1.0) << sheet.name;
    EXPECT_LT(std::abs(audit.residual()), 2e-5 * audit.throughput()) << sheet.name;
  }
}

TEST(EnergyAudit, SeesAPlantThatCreatesEnergy) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-50"));
  Plant plant(parts, kStep_s);
  const Load load = lever(9.0, 0.2);
  const Load billed = lever(9.0, 0.1);
  plant.reset(PlantState{.joint_angle_rad = 0.0, .joint_speed_rad_s = 1.0});
  EnergyAudit audit(plant, billed);
  for (int i = 0; i < 10000; ++i) {
    ASSERT_EQ(plant.step({}, load, kStep_s), Fault::none);
    audit.observe(plant, billed, kStep_s);
  }
  EXPECT_GT(std::abs(audit.residual()), 1e-2);
}

}  // namespace
}  // namespace torsio
