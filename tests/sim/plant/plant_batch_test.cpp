#include "sim/plant/plant_batch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/each_instruction_set.hpp"
#include "support/numbers.hpp"
#include "support/plant_batches.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::batch_inputs;
using test::BatchInputs;
using test::every_chain;
using test::kNaN;

constexpr double kTick_s = 1e-3;
constexpr std::size_t kTicks = 1000;

/// Everything that a plant shows.
std::vector<double> numbers(const PlantState& s, const PlantTorques& t, double current_A) {
  return {s.rotor_angle_rad,
          s.rotor_speed_rad_s,
          s.middle_angle_rad,
          s.middle_speed_rad_s,
          s.joint_angle_rad,
          s.joint_speed_rad_s,
          t.motor_Nm,
          t.rotor_friction_Nm,
          t.first_Nm,
          t.first_on_rotor_Nm,
          t.middle_friction_Nm,
          t.second_Nm,
          t.second_on_middle_Nm,
          t.bearing_Nm,
          t.joint_Nm,
          t.wall_Nm,
          current_A};
}
std::vector<double> numbers(const Plant& plant) {
  return numbers(plant.state(), plant.torques(), plant.current());
}
std::vector<double> numbers(const PlantBatch& batch, std::size_t plant) {
  return numbers(batch.state(plant), batch.torques(plant), batch.current(plant));
}

using Track = std::vector<std::vector<double>>;  // [plant][tick and number]

Track run_batch(const BatchInputs& inputs, double longest_step_s, std::size_t ticks = kTicks) {
  PlantBatch batch(inputs.parameters, longest_step_s);
  Track track(batch.size());
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    EXPECT_EQ(batch.step(inputs.commands[tick], inputs.loads[tick], kTick_s), Fault::none);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::vector<double> now = numbers(batch, i);
      track[i].insert(track[i].end(), now.begin(), now.end());
    }
  }
  return track;
}

Track run_plants(const BatchInputs& inputs, double longest_step_s) {
  Track track(inputs.parameters.size());
  for (std::size_t i = 0; i < track.size(); ++i) {
    Plant plant(inputs.parameters[i], longest_step_s);
    for (std::size_t tick = 0; tick < kTicks; ++tick) {
      EXPECT_EQ(plant.step(inputs.commands[tick][i], inputs.loads[tick][i], kTick_s), Fault::none);
      const std::vector<double> now = numbers(plant);
      track[i].insert(track[i].end(), now.begin(), now.end());
    }
  }
  return track;
}

/// The largest difference of any number at any tick, over the largest value of that number.
double largest_difference(const Track& a, const Track& b) {
  const std::size_t width = numbers({}, {}, 0.0).size();
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::vector<double> scale(width, 1e-9);
    for (std::size_t k = 0; k < a[i].size(); ++k)
      scale[k % width] = std::max(scale[k % width], std::abs(a[i][k]));
    for (std::size_t k = 0; k < a[i].size(); ++k) {
      const double difference = std::abs(a[i][k] - b[i][k]) / scale[k % width];
      worst = difference <= worst ? worst : difference;  // NaN is worst
    }
  }
  return worst;
}

/// A plant whose rotor is in the middle of a stick-slip event at another step differs permanently;
/// none of these does within a second.
constexpr double kTolerance = 1e-10;

class PlantBatchOf : public testing::TestWithParam<std::string> {};

TEST_P(PlantBatchOf, MovesAsItsPlantsDoAlone) {
  const BatchInputs inputs = batch_inputs(GetParam(), 0, 11, kTicks);
  const double step_s = PlantBatch(inputs.parameters).longest_step();
  const Track alone = run_plants(inputs, step_s);
  const double difference = largest_difference(alone, run_batch(inputs, step_s));
  RecordProperty("largest_difference", std::to_string(difference));
  EXPECT_LT(difference, kTolerance);
  const double turned = std::abs(alone[0][alone[0].size() - numbers({}, {}, 0.0).size()]);
  EXPECT_GT(turned, 0.0);
}

TEST_P(PlantBatchOf, GivesAPlantTheSameBitsInAnyCompany) {
  constexpr std::size_t kShort = 200;
  const double step_s = PlantBatch(batch_inputs(GetParam(), 0, 17, 1).parameters).longest_step();
  const Track all = run_batch(batch_inputs(GetParam(), 0, 17, kShort), step_s, kShort);
  for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{16, 1}, {2, 3}, {7, 8}}) {
    const Track some = run_batch(batch_inputs(GetParam(), first, count, kShort), step_s, kShort);
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_EQ(some[i], all[first + i]) << "plant " << first + i << " in a batch of " << count;
  }
}

TEST_P(PlantBatchOf, AgreesOnEveryInstructionSet) {
  const BatchInputs inputs = batch_inputs(GetParam(), 0, 5, kTicks);
  const double step_s = PlantBatch(inputs.parameters).longest_step();
  const Track best = run_batch(inputs, step_s);
  int sets = 0;
  test::on_each_instruction_set([&](const char* name) {
    ++sets;
    EXPECT_LT(largest_difference(best, run_batch(inputs, step_s)), kTolerance) << name;
  });
  EXPECT_GE(sets, 1);
}

TEST_P(PlantBatchOf, LeavesAPlantWithImpossibleInputWhereItIs) {
  constexpr std::size_t kBad = 4;
  BatchInputs inputs = batch_inputs(GetParam(), 0, 9, 60);
  PlantBatch batch(inputs.parameters);
  PlantBatch untouched(inputs.parameters);
  const std::array<std::pair<PlantCommand, Load>, 4> bad = {{
      {{.current_A = kNaN}, {}},
      {{}, {.inertia_kg_m2 = -1.0}},
      {{}, {.external_torque_Nm = std::numeric_limits<double>::infinity()}},
      {{}, {.wall_angle_rad = kNaN}},
  }};
  for (std::size_t tick = 0; tick < 60; ++tick) {
    ASSERT_EQ(untouched.step(inputs.commands[tick], inputs.loads[tick], kTick_s), Fault::none);
    const std::vector<double> before = numbers(batch, kBad);
    const bool is_bad = tick >= 30;
    if (is_bad) {
      inputs.commands[tick][kBad] = bad[tick % bad.size()].first;
      inputs.loads[tick][kBad] = bad[tick % bad.size()].second;
    }
    ASSERT_EQ(batch.step(inputs.commands[tick], inputs.loads[tick], kTick_s),
              is_bad ? Fault::input_not_finite : Fault::none);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      EXPECT_EQ(batch.fault(i), is_bad && i == kBad ? Fault::input_not_finite : Fault::none);
      EXPECT_EQ(numbers(batch, i), is_bad && i == kBad ? before : numbers(untouched, i));
    }
  }
}

TEST_P(PlantBatchOf, WearsAsItsPlantsDo) {
  const BatchInputs inputs = batch_inputs(GetParam(), 0, 3, 300);
  PlantBatch batch(inputs.parameters);
  std::vector<Plant> plants;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const PlantCondition condition{.friction_factor = 1.0 + 0.5 * static_cast<double>(i),
                                   .torque_constant_factor = 0.9,
                                   .second_stage_factor = i == 1 ? 0.0 : 0.8,
                                   .stop_twist_rad = 0.01,
                                   .stop_stiffness_Nm_rad = 20.0};
    plants.emplace_back(inputs.parameters[i], batch.longest_step());
    plants[i].set_condition(condition);
    batch.set_condition(i, condition);
  }
  for (std::size_t tick = 0; tick < 300; ++tick) {
    ASSERT_EQ(batch.step(inputs.commands[tick], inputs.loads[tick], kTick_s), Fault::none);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      ASSERT_EQ(plants[i].step(inputs.commands[tick][i], inputs.loads[tick][i], kTick_s),
                Fault::none);
      const double expected = plants[i].state().joint_angle_rad;
      EXPECT_NEAR(batch.state(i).joint_angle_rad, expected, kTolerance) << i;
    }
  }
}

TEST_P(PlantBatchOf, StartsWherePlantDoes) {
  const BatchInputs inputs = batch_inputs(GetParam(), 0, 9, 1);
  PlantBatch batch(inputs.parameters);
  std::vector<Plant> plants;
  for (const PlantParameters& of : inputs.parameters) plants.emplace_back(of, batch.longest_step());
  const Load load = inputs.loads[0][0];
  batch.reset(0.3, load);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    plants[i].reset(0.3, load);
    EXPECT_EQ(numbers(batch, i), numbers(plants[i])) << i;
  }
  const PlantState thrown{.rotor_speed_rad_s = 3.0, .middle_angle_rad = 1e-3};
  batch.reset(2, thrown);
  plants[2].reset(thrown);
  batch.reset(5, -0.2, {});
  plants[5].reset(-0.2, {});
  const std::vector<PlantCommand> commands(batch.size());
  const std::vector<Load> loads(batch.size(), load);
  for (int tick = 0; tick < 50; ++tick) {
    ASSERT_EQ(batch.step(commands, loads, kTick_s), Fault::none);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      ASSERT_EQ(plants[i].step({}, load, kTick_s), Fault::none);
      EXPECT_NEAR(batch.state(i).joint_angle_rad, plants[i].state().joint_angle_rad, kTolerance);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, PlantBatchOf, testing::ValuesIn(every_chain()), [](const auto& of) {
  std::string name = of.param;
  std::ranges::replace(name, '-', '_');
  std::ranges::replace(name, ':', '_');
  return name;
});

TEST(PlantBatch, DividesAStepThatIsLongerThanItsOwn) {
  const BatchInputs inputs = batch_inputs("dfki-120", 0, 5, 50);
  PlantBatch once(inputs.parameters);
  PlantBatch ten_times(inputs.parameters, 1e-4);
  for (std::size_t tick = 0; tick < 50; ++tick) {
    ASSERT_EQ(once.step(inputs.commands[tick], inputs.loads[tick], 1e-3), Fault::none);
    for (int k = 0; k < 10; ++k) {
      ASSERT_EQ(ten_times.step(inputs.commands[tick], inputs.loads[tick], 1e-3 / 10.0),
                Fault::none);
    }
  }
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(numbers(once, i), numbers(ten_times, i));
}

TEST(PlantBatch, TakesTheManyStepsOfASmallBoucWenKnee) {
  BatchInputs inputs = batch_inputs("dfki-50:bouc-wen", 0, 9, kTicks);
  for (std::size_t i = 0; i < inputs.parameters.size(); ++i) {
    auto& spring = std::get<Spring::Parameters>(inputs.parameters[i].second);
    spring.friction = BoucWen::Parameters{.constant_Nm = 1e-3 * static_cast<double>(i),
                                          .knee_rad = 1e-6 * static_cast<double>(1 + i)};
  }
  const double step_s = PlantBatch(inputs.parameters).longest_step();
  EXPECT_LT(largest_difference(run_plants(inputs, step_s), run_batch(inputs, step_s)), kTolerance);
}

TEST(PlantBatch, ClipsALuGreForceThatOutlastsItsLoad) {
  BatchInputs inputs = batch_inputs("dfki-28:lugre", 0, 9, kTicks);
  for (PlantParameters& of : inputs.parameters) {
    std::get<Spring::Parameters>(of.second).friction =
        LuGreSlip::Parameters{.load_factor = 0.3, .bristle_rad = 0.03};
  }
  const double step_s = PlantBatch(inputs.parameters).longest_step();
  EXPECT_LT(largest_difference(run_plants(inputs, step_s), run_batch(inputs, step_s)), kTolerance);
}

TEST(PlantBatch, RefusesStepsAndCountsThatMeanNothing) {
  const BatchInputs inputs = batch_inputs("dfki-28", 0, 2, 1);
  PlantBatch batch(inputs.parameters);
  const auto& commands = inputs.commands[0];
  const auto& loads = inputs.loads[0];
  const std::vector<double> before = numbers(batch, 1);
  for (const double dt_s : {0.0, -1e-4, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(batch.step(commands, loads, dt_s), Fault::input_not_finite);
    EXPECT_EQ(batch.fault(1), Fault::input_not_finite);
  }
  EXPECT_EQ(batch.step(std::span(commands).first(1), loads, kTick_s), Fault::input_count_wrong);
  EXPECT_EQ(batch.step(commands, std::span(loads).first(1), kTick_s), Fault::input_count_wrong);
  EXPECT_EQ(numbers(batch, 1), before);
}

/// The constructor's error for these plants.
ErrorReport refusal(const std::vector<PlantParameters>& parameters, double longest_step_s = 0.0) {
  try {
    PlantBatch(parameters, longest_step_s);
  } catch (const Error& error) {
    return error.report();
  }
  ADD_FAILURE() << "accepted";
  return {};
}

TEST(PlantBatch, RefusesAMixtureAndNamesThePlantThatDiffers) {
  const auto parts = [](const char* name) { return plant_parameters(data_sheet(name)); };
  const ErrorReport springs = refusal({parts("dfki-28"), parts("dfki-50"), parts("dfki-50:lugre")});
  EXPECT_EQ(springs.expected, "gear + Maxwell-slip spring, as plant 0 is");
  EXPECT_EQ(springs.found, "gear + LuGre spring at plant 2");
  EXPECT_EQ(refusal({parts("elastomer"), parts("elastomer:unbonded")}).found,
            "gear + unbonded elastomer at plant 1");
  EXPECT_EQ(refusal({}).problem, "nothing to simulate");
  PlantParameters strange = parts("dfki-28");
  strange.first = parts("rubber-clutch").first;
  EXPECT_EQ(refusal({strange}).found, "slip clutch + Maxwell-slip spring");
}

TEST(PlantBatch, RefusesAStepTooLongForOneOfItsPlants) {
  std::vector<PlantParameters> parameters(2, plant_parameters(data_sheet("dfki-50")));
  std::get<Gear::Parameters>(parameters[1].first).stiffness_Nm_rad *= 4.0;
  EXPECT_EQ(refusal(parameters, 1e-4).found, "0.0001 s");
  EXPECT_LT(PlantBatch(parameters).longest_step(), 1e-4);
}

}  // namespace
}  // namespace torsio
