#include <fmt/format.h>

#include <array>
#include <cmath>

#include "experiment_table.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/position_loop.hpp"

namespace torsio {
namespace {

constexpr std::string_view kActuators = "dfki-*";
constexpr double kMass_kg = 9.0;
constexpr double kSweepSpeed_rad_s = rad_from_deg(10.0);
constexpr double kSweepAcceleration_rad_s2 = rad_from_deg(30.0);
constexpr double kCycle_Hz = 0.05;
constexpr double kCycles = 3.0;
constexpr double kHold_rad = rad_from_deg(90.0);

/// The lever with its mass. @throws UsageError if it is too heavy.
Load bench_lever(const DataSheet& sheet, const ExperimentSpec& spec) {
  const double length_m = spec.lever_m.value_or(sweep_protocol(sheet.name).train_lever_m.front());
  const Load load = lever(kMass_kg, length_m, spec.inclination_rad);
  if (std::abs(load.gravity_Nm) > sheet.rating.torque_Nm.value) {
    throw UsageError(
        {.place = spec.experiment,
         .problem = "the lever is too heavy for the actuator",
         .expected = fmt::format("at most the {} Nm that {} is rated for",
                                 sheet.rating.torque_Nm.value, sheet.name),
         .found = fmt::format("{:.1f} Nm ({} kg at {} m)", load.gravity_Nm, kMass_kg, length_m),
         .advice = "take a shorter lever, or incline it"});
  }
  return load;
}

BenchProgram sweep(const DataSheet& sheet, const ExperimentSpec& spec) {
  const SweepProtocol protocol = sweep_protocol(sheet.name);
  const Load load = bench_lever(sheet, spec);
  // One period and a quarter: to one end, to the other, back to the first and to the middle.
  const double duration_s = 5.0 * protocol.amplitude_rad / kSweepSpeed_rad_s;
  return {.start = load,
          .duration_s = duration_s,
          .next = [load,
                   reference = TrapezoidSweep({.amplitude = protocol.amplitude_rad,
                                               .speed = kSweepSpeed_rad_s,
                                               .acceleration = kSweepAcceleration_rad_s2},
                                              kBenchRate_Hz),
                   loop = PositionLoop(plant_parameters(sheet), kBenchRate_Hz)](
                      const Measurement& measured) mutable -> BenchAction {
            return {.command = {.current_A = loop.step(reference.step(), measured.motor_angle_rad)},
                    .load = load};
          }};
}

BenchProgram static_cycle(const DataSheet& sheet, const ExperimentSpec& /*spec*/) {
  return {
      .start = {},
      .duration_s = kCycles / kCycle_Hz,
      .next = [ramp =
                   Triangle({.amplitude = sheet.rating.torque_Nm.value, .frequency_Hz = kCycle_Hz},
                            kBenchRate_Hz)](const Measurement&) mutable -> BenchAction {
        return {.command = {.is_motor_held = true}, .load = {.external_torque_Nm = ramp.step()}};
      }};
}

BenchProgram hold(const DataSheet& sheet, const ExperimentSpec& spec) {
  const Load load = bench_lever(sheet, spec);
  return {.start = load,
          .start_angle_rad = kHold_rad,
          .duration_s = 60.0,
          .next = [load, loop = PositionLoop(plant_parameters(sheet), kBenchRate_Hz)](
                      const Measurement& measured) mutable -> BenchAction {
            return {.command = {.current_A = loop.step(kHold_rad, measured.motor_angle_rad)},
                    .load = load};
          }};
}

constexpr auto kTable = std::to_array<ExperimentEntry>({
    {.info =
         {.name = "sweep",
          .actuators = kActuators,
          .description =
              "a lever with 9 kg is moved to and fro at 10 deg/s, +-170 deg (dfki-28: +-60 deg)"},
     .has_lever = true,
     .program = sweep},
    {.info = {.name = "static-cycle",
              .actuators = kActuators,
              .description =
                  "rotor held, a torque ramp of +-rated torque pulls on the output at 0.05 Hz"},
     .program = static_cycle},
    {.info = {.name = "hold",
              .actuators = kActuators,
              .description =
                  "the position loop holds a lever with 9 kg level, 90 deg from hanging"},
     .has_lever = true,
     .program = hold},
});

}  // namespace

std::span<const ExperimentEntry> series_elastic_experiments() noexcept { return kTable; }

SweepProtocol sweep_protocol(std::string_view actuator) {
  const DataSheet& sheet = data_sheet(actuator);
  SweepProtocol protocol{.amplitude_rad = rad_from_deg(170.0),
                         .train_lever_m = {0.35, 0.60, 0.80},
                         .test_lever_m = 0.72,
                         .test_inclination_rad = rad_from_deg(37.8)};
  if (sheet.name == "dfki-50") {
    protocol.train_lever_m = {0.10, 0.17, 0.24};
    protocol.test_lever_m = 0.29;
  }
  if (sheet.name == "dfki-28") {
    protocol.amplitude_rad = rad_from_deg(60.0);
    protocol.train_lever_m = {0.08, 0.14, 0.20};
    protocol.test_lever_m = 0.23;
  }
  return protocol;
}

}  // namespace torsio
