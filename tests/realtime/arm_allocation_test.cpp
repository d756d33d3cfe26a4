#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "sim/arm/arm_plant.hpp"
#include "support/allocation_counter.hpp"
#include "support/arm_drives.hpp"

namespace torsio {
namespace {

TEST(ArmPlant, NeverUsesTheHeapAfterItsConstruction) {
  for (const FirstStageForm form : {FirstStageForm::elastic, FirstStageForm::rigid}) {
    ArmPlant arm(test::arm6_with_8_kg(), test::arm6_drives(), form);
    std::array<PlantCommand, 6> commands;
    commands.fill({.current_A = 2.0});
    std::array<PlantCommand, 6> broken = commands;
    broken[3].current_A = std::numeric_limits<double>::quiet_NaN();
    ArmLoad load{.force_N = {10.0, 0.0, 5.0}, .moment_Nm = {1.0, 0.0, 0.0}};
    load.is_locked[2] = true;
    const std::array<double, 6> bent_rad = {0.1, -0.4, 0.8, 0.2, 0.5, -0.3};
    const ArmLoad too_much{.force_N = {0.0, 0.0, 1e307}};
    std::array<Fault, 4> faults{};
    EXPECT_EQ(test::heap_calls_during([&] {
                arm.reset(bent_rad, load);
                arm.set_condition(1, {.second_stage_factor = 0.5});
                faults[0] = arm.step(commands, load, 1e-4);
                faults[1] = arm.step(commands, load, 1e-3);
                faults[2] = arm.step(broken, load, 1e-4);
                faults[3] = arm.step(commands, too_much, 1.0);
              }),
              0U);
    EXPECT_EQ(faults, (std::array{Fault::none, Fault::none, Fault::input_not_finite,
                                  Fault::model_not_finite}));
  }
}

}  // namespace
}  // namespace torsio
