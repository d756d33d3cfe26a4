#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "rows.hpp"
#include "sim/plant/plant_batch.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::bench {
namespace {

constexpr double kStep_s = 1e-4;

PlantParameters dfki_120(const char* name = "dfki-120") {
  return plant_parameters(data_sheet(name));
}

/// The input, also of the peer: 1 Hz, and 2 % of 37 Hz, on a lever of 0.4 m with 9 kg.
std::vector<PlantCommand> commands_of_a_second() {
  std::vector<PlantCommand> commands(10000);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const double turns = static_cast<double>(i) * kStep_s;
    commands[i].current_A = 2.0 * std::sin(2.0 * std::numbers::pi * turns) +
                            0.04 * std::sin(37.0 * 2.0 * std::numbers::pi * turns);
  }
  return commands;
}

void expect(Fault fault) {
  if (fault != Fault::none) throw std::runtime_error("a plant refuses its input");
}

double steps_per_second(Plant plant) {
  const std::vector<PlantCommand> commands = commands_of_a_second();
  const Load load = lever(9.0, 0.4);
  const double seconds = best_seconds([&] {
    for (const PlantCommand& command : commands) expect(plant.step(command, load, kStep_s));
  });
  return static_cast<double>(commands.size()) / seconds;
}

/// Additions, multiplications, multiply-adds, divisions, comparisons and conversions of doubles in a
/// step of dfki-120 with all effects: those in the compiled kernel of PlantBatch. Sines and
/// cosines are 22 each, exponentials 24, and together some 60 % of all; a step that needs no Stribeck
/// curve, no play and no moving bristle has 100 fewer.
constexpr double kOperations = 360.0;

/// Steps per second if the units that multiply and add were never idle.
double floor_with_lanes(std::size_t lanes) {
  const double each_lane = multiply_adds_per_second() / static_cast<double>(vector_lanes());
  return each_lane * static_cast<double>(lanes) / kOperations;
}

Row single(const PlantParameters& parameters) {
  return {.value = steps_per_second(Plant(parameters)), .unit = "steps/s"};
}

}  // namespace

// The work of `torsio simulate` before it writes: plant, sensors, position loop.
Row simulate_dfki_120() {
  double steps = 0.0;
  const double seconds = best_seconds([&] {
    const Recording recording = simulate({.actuator = "dfki-120"});
    steps = std::round(static_cast<double>(recording.size()) /
                       (recording.sample_rate_Hz() * Plant::kDefaultStep_s));
  });
  return {.value = steps / seconds, .unit = "steps/s"};
}

void write_simulate_inputs() {
  std::vector<double> currents_A;
  for (const PlantCommand& command : commands_of_a_second())
    currents_A.push_back(command.current_A);
  write_doubles("commands_A.f64", currents_A);
}

Row simulate_single() {
  Row row = single(dfki_120());
  row.floor = floor_with_lanes(1);
  return row;
}
/// With windings, inverter and current control, in multiples of real time.
Row simulate_electrical() {
  const DataSheet sheet = data_sheet("dfki-120");
  Plant plant(plant_parameters(sheet));
  plant.use(electrical_parameters(sheet, 1));
  return {.value = steps_per_second(std::move(plant)) * kStep_s, .unit = "x real time"};
}
Row simulate_single_bouc_wen() { return single(dfki_120("dfki-120:bouc-wen")); }
Row simulate_single_lugre() { return single(dfki_120("dfki-120:lugre")); }

namespace {

void drop_ripple(PlantParameters& of) { of.motor.ripple = 0.0; }
void drop_gear_error(PlantParameters& of) { std::get<Gear::Parameters>(of.first).error_rad = {}; }
void drop_play(PlantParameters& of) {
  std::get<Spring::Parameters>(of.second).elastic.half_gap_rad = 0.0;
}
// Without a force Bouc-Wen returns at once.
void drop_hysteresis(PlantParameters& of) {
  std::get<Spring::Parameters>(of.second).friction = BoucWen::Parameters{};
}
void drop_stribeck(PlantParameters& of) { of.rotor_friction.static_ratio = 1.0; }
void drop_friction(PlantParameters& of) {
  for (LuGreFriction::Parameters* friction : {&of.rotor_friction, &of.bearing}) {
    friction->coulomb_Nm = 0.0;
    friction->load_factor = 0.0;
  }
}

template <class... Drops>
Row without(Drops... drops) {
  PlantParameters parameters = dfki_120();
  (drops(parameters), ...);
  return single(parameters);
}

}  // namespace

Row simulate_no_ripple() { return without(drop_ripple); }
Row simulate_no_gear_error() { return without(drop_gear_error); }
Row simulate_no_play() { return without(drop_play); }
Row simulate_no_hysteresis() { return without(drop_hysteresis); }
Row simulate_no_stribeck() { return without(drop_stribeck); }
Row simulate_no_friction() { return without(drop_friction); }
Row simulate_no_effects() {
  return without(drop_ripple, drop_gear_error, drop_play, drop_hysteresis, drop_friction);
}

namespace {

constexpr std::size_t kActuators = 256;

/// `kActuators` that differ by up to 5 %, each with its own phase of the same commands.
Row batched(const char* actuator, double dt_s) {
  std::vector<PlantParameters> parameters(kActuators, dfki_120(actuator));
  for (std::size_t i = 0; i < kActuators; ++i) {
    const double share = static_cast<double>(i) / kActuators;
    parameters[i].rotor_inertia_kg_m2 *= 1.0 + 0.05 * share;
    parameters[i].joint_inertia_kg_m2 *= 1.05 - 0.05 * share;
  }
  PlantBatch batch(parameters, kStep_s);
  const std::vector<PlantCommand> second = commands_of_a_second();
  constexpr std::size_t kCalls = 100;
  std::vector<std::vector<PlantCommand>> commands(kCalls, std::vector<PlantCommand>(kActuators));
  for (std::size_t call = 0; call < kCalls; ++call)
    for (std::size_t i = 0; i < kActuators; ++i)
      commands[call][i] = second[(call * 100 + i * 39) % second.size()];
  const std::vector<Load> loads(kActuators, lever(9.0, 0.4));
  const double seconds = best_seconds([&] {
    for (const auto& now : commands) expect(batch.step(now, loads, dt_s));
  });
  const double steps = std::round(dt_s / kStep_s) * static_cast<double>(kCalls * kActuators);
  return {.value = steps / seconds, .unit = "steps/s", .floor = floor_with_lanes(vector_lanes())};
}

}  // namespace

Row simulate_batched() { return batched("dfki-120", kStep_s); }
Row simulate_batched_held() { return batched("dfki-120", 1e-3); }
Row simulate_batched_bouc_wen() { return batched("dfki-120:bouc-wen", kStep_s); }
Row simulate_batched_lugre() { return batched("dfki-120:lugre", kStep_s); }

}  // namespace torsio::bench
