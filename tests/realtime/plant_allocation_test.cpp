#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>

#include "sim/plant/plant_batch.hpp"
#include "support/allocation_counter.hpp"
#include "support/plant_batches.hpp"

namespace torsio {
namespace {

using test::heap_calls_during;

TEST(PlantBatch, NeverUsesTheHeapAfterItsConstruction) {
  for (const std::string& actuator : test::every_chain()) {
    test::BatchInputs inputs = test::batch_inputs(actuator, 0, 11, 3);
    inputs.commands[2][4].current_A = std::numeric_limits<double>::quiet_NaN();
    PlantBatch batch(inputs.parameters);
    std::array<Fault, 4> faults{};
    EXPECT_EQ(heap_calls_during([&] {
                faults[0] = batch.step(inputs.commands[0], inputs.loads[0], 1e-4);
                faults[1] = batch.step(inputs.commands[1], inputs.loads[1], 1e-3);
                faults[2] = batch.step(inputs.commands[2], inputs.loads[2], 1e-3);
                faults[3] = batch.step({}, {}, 1e-3);
                batch.set_condition(1, {.second_stage_factor = 0.5});
                batch.reset(0.1);
                batch.reset(3, PlantState{});
              }),
              0U)
        << actuator;
    EXPECT_EQ(faults, (std::array{Fault::none, Fault::none, Fault::input_not_finite,
                                  Fault::input_count_wrong}));
  }
}

TEST(Plant, NeverUsesTheHeapAfterItsConstruction) {
  for (const std::string& actuator : test::every_chain()) {
    const test::BatchInputs inputs = test::batch_inputs(actuator, 0, 1, 1);
    Plant plant(inputs.parameters[0]);
    Fault fault = Fault::none;
    EXPECT_EQ(heap_calls_during([&] {
                fault = plant.step(inputs.commands[0][0], inputs.loads[0][0], 1e-3);
                plant.reset(0.1);
              }),
              0U)
        << actuator;
    EXPECT_EQ(fault, Fault::none);
  }
}

}  // namespace
}  // namespace torsio
