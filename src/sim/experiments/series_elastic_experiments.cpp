#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>

#include "sim/experiments/experiment_table.hpp"
#include "sim/experiments/torque_references.hpp"
#include "sim/loops/bench_deflection_loop.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

constexpr std::string_view kSeriesElasticActuators = "dfki-*";
constexpr double kSweepSpeed_rad_s = rad_from_deg(10.0);
constexpr double kSweepAcceleration_rad_s2 = rad_from_deg(30.0);
constexpr double kShortChirp_s = 10.0;
constexpr double kHold_rad = rad_from_deg(90.0);

double lever_mass_kg(const ExperimentSpec& spec) { return spec.mass_kg.value_or(kLeverMass_kg); }

Load bench_lever(const DataSheet& sheet, const ExperimentSpec& spec) {
  return bearable_lever(sheet, spec, lever_mass_kg(spec),
                        spec.lever_m.value_or(sweep_protocol(sheet).train_lever_m.front()));
}

BenchProgram sweep(const DataSheet& sheet, const ExperimentSpec& spec) {
  const SweepProtocol protocol = sweep_protocol(sheet);
  const Load load = bench_lever(sheet, spec);
  // One period and a quarter: to one end, to the other, back to the first and to the middle.
  const double duration_s = 5.0 * protocol.amplitude_rad / kSweepSpeed_rad_s;
  return {.start = load,
          .duration_s = duration_s,
          .command_channels = {kGoalAngle},
          .next = [load,
                   reference = TrapezoidSweep({.amplitude = protocol.amplitude_rad,
                                               .speed = kSweepSpeed_rad_s,
                                               .acceleration = kSweepAcceleration_rad_s2},
                                              kBenchRate_Hz),
                   loop = BenchPositionLoop(plant_parameters(sheet), kBenchRate_Hz)](
                      const Measurement& measured) mutable -> BenchAction {
            const double goal_rad = reference.step();
            return {.command = {.current_A = loop.step(goal_rad, measured.motor_angle_rad)},
                    .load = load,
                    .commanded = {goal_rad}};
          }};
}

BenchProgram series_elastic_static_cycle(const DataSheet& sheet, const ExperimentSpec& /*spec*/) {
  return static_cycle_program(sheet.rating.torque_Nm.value);
}

BenchProgram series_elastic_hold(const DataSheet& sheet, const ExperimentSpec& spec) {
  const Load load = bench_lever(sheet, spec);
  return {.start = load,
          .start_angle_rad = kHold_rad,
          .duration_s = 60.0,
          .command_channels = {kGoalAngle},
          .next = [load, loop = BenchPositionLoop(plant_parameters(sheet), kBenchRate_Hz)](
                      const Measurement& measured) mutable -> BenchAction {
            return {.command = {.current_A = loop.step(kHold_rad, measured.motor_angle_rad)},
                    .load = load,
                    .commanded = {kHold_rad}};
          }};
}

double torque_amplitude(const DataSheet& sheet, const ExperimentSpec& spec) {
  return spec.torque_amplitude_Nm ? *spec.torque_amplitude_Nm : usual_torque_amplitude(sheet);
}

/// A deflection loop follows a torque; the line from torque to deflection is that of the data
/// sheet, (τ − 0) / K.
BenchProgram torque_tracking(const DataSheet& sheet, const ExperimentSpec& spec, auto reference) {
  Load load{.is_locked = true};
  if (spec.lever_m) {
    load = lever(lever_mass_kg(spec), *spec.lever_m, spec.inclination_rad);
    check_swing({.place = spec.experiment,
                 .load = load,
                 .duration_s = spec.duration_s.value_or(kTorqueTest_s),
                 .reference = [reference]() mutable { return reference.step(); }},
                sheet);
  } else if (spec.inclination_rad != 0.0) {
    throw UsageError({.place = fmt::format("{} inclination", spec.experiment),
                      .problem = "the output is locked",
                      .advice = "give a lever, which then swings freely"});
  }
  const PlantParameters plant = plant_parameters(sheet);
  const double stiffness_Nm_rad =
      std::get<Spring::Parameters>(plant.second).elastic.stiffness_Nm_rad;
  return {
      .start = load,
      .duration_s = kTorqueTest_s,
      .command_channels = {kGoalTorque},
      .next = [load, reference, stiffness_Nm_rad, loop = BenchDeflectionLoop(plant, kBenchRate_Hz)](
                  const Measurement& measured) mutable -> BenchAction {
        const double deflection_rad = measured.middle_angle_rad - measured.joint_angle_rad;
        const double wanted_Nm = reference.step();
        const double wanted_rad = wanted_Nm / stiffness_Nm_rad;
        return {.command = {.current_A = loop.step(wanted_rad, deflection_rad)},
                .load = load,
                .commanded = {wanted_Nm}};
      }};
}

BenchProgram series_elastic_chirp(const DataSheet& sheet, const ExperimentSpec& spec) {
  return torque_tracking(sheet, spec, torque_chirp(torque_amplitude(sheet, spec)));
}

BenchProgram series_elastic_random_walk(const DataSheet& sheet, const ExperimentSpec& spec) {
  return torque_tracking(sheet, spec, torque_walk(torque_amplitude(sheet, spec), spec.seed));
}

/// What a new joint is asked to do when a model of another one is transferred to it.
BenchProgram short_chirp(const DataSheet& sheet, const ExperimentSpec& spec) {
  const Chirp reference(
      {.amplitude = spec.torque_amplitude_Nm.value_or(0.5 * sheet.rating.torque_Nm.value),
       .start_Hz = 0.05,
       .end_Hz = 0.3,
       .duration_s = spec.duration_s.value_or(kShortChirp_s)},
      kBenchRate_Hz);
  BenchProgram program = torque_tracking(sheet, spec, reference);
  program.duration_s = kShortChirp_s;
  return program;
}

constexpr auto kSeriesElasticTable = std::to_array<ExperimentEntry>({
    {.info = {.name = "sweep",
              .actuators = kSeriesElasticActuators,
              .description = "a lever with 9 kg is moved back and forth at 10 deg/s, +-170 deg "
                             "(dfki-28: +-60 deg)"},
     .has_lever = true,
     .program = sweep},
    {.info = {.name = "static-cycle",
              .actuators = kSeriesElasticActuators,
              .description =
                  "rotor held, a torque ramp of +-rated torque pulls on the output at 0.05 Hz"},
     .program = series_elastic_static_cycle},
    {.info = {.name = "hold",
              .actuators = kSeriesElasticActuators,
              .description =
                  "the position loop holds a lever with 9 kg level, 90 deg from hanging"},
     .has_lever = true,
     .program = series_elastic_hold},
    {.info = {.name = "chirp",
              .actuators = kSeriesElasticActuators,
              .description = "a deflection loop follows a torque chirp, 0.01 to 0.3 Hz in 100 s; "
                             "output locked, or with a lever and 9 kg free to swing",
              .amplitude_unit = "Nm"},
     .has_lever = true,
     .highest_torque_share = 1.0,
     .program = series_elastic_chirp},
    {.info = {.name = "short-chirp",
              .actuators = kSeriesElasticActuators,
              .description =
                  "as chirp, of half the rated torque, 0.05 to 0.3 Hz in its duration of "
                  "10 s or another",
              .amplitude_unit = "Nm"},
     .highest_torque_share = 1.0,
     .program = short_chirp},
    {.info = {.name = "random-walk",
              .actuators = kSeriesElasticActuators,
              .description = "as chirp, the torque being noise below 1 Hz with the same RMS",
              .amplitude_unit = "Nm"},
     .has_lever = true,
     .highest_torque_share = kWalkAmplitude,
     .program = series_elastic_random_walk},
});

}  // namespace

std::span<const ExperimentEntry> series_elastic_experiments() noexcept {
  return kSeriesElasticTable;
}

SweepProtocol sweep_protocol(const DataSheet& sheet) {
  if (sheet.family != ActuatorFamily::series_elastic)
    throw UsageError({.place = "sweep",
                      .expected = fmt::format("one of {}", kSeriesElasticActuators),
                      .found = std::string(sheet.name),
                      .advice = "the other actuators have no lever to sweep"});
  const double incline_rad = rad_from_deg(37.8);
  if (sheet.name == "dfki-28") return {rad_from_deg(60.0), {0.08, 0.14, 0.20}, 0.23, incline_rad};
  if (sheet.name == "dfki-50") return {rad_from_deg(170.0), {0.10, 0.17, 0.24}, 0.29, incline_rad};
  if (sheet.name == "dfki-120" || sheet.name == "dfki-300")
    return {rad_from_deg(170.0), {0.35, 0.60, 0.80}, 0.72, incline_rad};
  // A sheet of the user's own: levers that take the same shares of its rating.
  const double rated_m = lever_m(sheet, 1.0);
  return {rad_from_deg(170.0),
          {0.2 * rated_m, 0.35 * rated_m, 0.5 * rated_m},
          0.45 * rated_m,
          incline_rad};
}

}  // namespace torsio
