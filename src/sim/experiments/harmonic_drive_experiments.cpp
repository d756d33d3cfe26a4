#include <array>

#include "sim/experiments/experiment_table.hpp"
#include "sim/loops/bench_impedance_loop.hpp"
#include "torsio/core/random.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

constexpr std::string_view kHarmonicDriveActuators = "harmonic-drive";
constexpr double kGoal_rad = 0.0;  // the impedance controller stays there
constexpr double kHumanTorque_Nm = 20.0;
constexpr double kHumanFrequency_Hz = 0.4;
constexpr double kHighestHumanTorque_Nm = 50.0;

BenchImpedanceLoop impedance_loop(const DataSheet& sheet, bool is_zero) {
  return {plant_parameters(sheet), is_zero ? BenchImpedanceLoop::kZero : BenchImpedanceLoop::kHigh,
          sheet.variant == "rigid" ? BenchImpedanceLoop::Twist::tube_and_gear
                                   : BenchImpedanceLoop::Twist::tube};
}

double current(const BenchImpedanceLoop& loop, const Measurement& measured) {
  return loop.step(kGoal_rad, measured.motor_angle_rad, measured.middle_angle_rad,
                   measured.joint_angle_rad);
}

BenchProgram human_torque(const DataSheet& sheet, const ExperimentSpec& spec) {
  const double frequency_Hz = spec.frequency_Hz.value_or(kHumanFrequency_Hz);
  return {.start = {},
          .load_cell = LoadCell::external,
          .duration_s = 600.0,
          .command_channels = {kGoalAngle},
          .next = [loop = impedance_loop(sheet, spec.is_impedance_zero),
                   // Not the numbers that the sensors' noise is made of.
                   hand = QuasiPeriodic(
                       {.amplitude = spec.torque_amplitude_Nm.value_or(kHumanTorque_Nm),
                        .frequency_Hz = frequency_Hz,
                        .seed = Random(spec.seed).bits()},
                       kBenchRate_Hz)](const Measurement& measured) mutable -> BenchAction {
            return {.command = {.current_A = current(loop, measured)},
                    .load = {.external_torque_Nm = hand.step()},
                    .commanded = {kGoal_rad}};
          }};
}

BenchProgram harmonic_drive_static_cycle(const DataSheet& sheet, const ExperimentSpec& /*spec*/) {
  return static_cycle_program(sheet.sensors.torque_range_Nm.value, LoadCell::external);
}

BenchProgram harmonic_drive_hold(const DataSheet& sheet, const ExperimentSpec& spec) {
  return {.start = {},
          .load_cell = LoadCell::external,
          .duration_s = 60.0,
          .command_channels = {kGoalAngle},
          .next = [loop = impedance_loop(sheet, spec.is_impedance_zero),
                   load = Load{.external_torque_Nm = spec.torque_amplitude_Nm.value_or(0.0)}](
                      const Measurement& measured) -> BenchAction {
            return {.command = {.current_A = current(loop, measured)},
                    .load = load,
                    .commanded = {kGoal_rad}};
          }};
}

constexpr auto kHarmonicDriveTable = std::to_array<ExperimentEntry>({
    {.info = {.name = "human-torque",
              .actuators = kHarmonicDriveActuators,
              .description =
                  "a hand pushes the output back and forth, about +-20 Nm at 0.4 Hz, against "
                  "the impedance controller",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::harmonic_drive,
     .highest_torque_Nm = kHighestHumanTorque_Nm,
     .has_frequency = true,
     .has_impedance = true,
     .program = human_torque},
    {.info = {.name = "static-cycle",
              .actuators = kHarmonicDriveActuators,
              .description =
                  "rotor held, a torque ramp over the load cell's range of +-100 Nm pulls "
                  "on the output at 0.05 Hz"},
     .family = ActuatorFamily::harmonic_drive,
     .program = harmonic_drive_static_cycle},
    {.info = {.name = "hold",
              .actuators = kHarmonicDriveActuators,
              .description = "the impedance controller holds the output, against a constant torque "
                             "if an amplitude is given",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::harmonic_drive,
     .highest_torque_Nm = kHighestHumanTorque_Nm,
     .has_impedance = true,
     .program = harmonic_drive_hold},
});

}  // namespace

std::span<const ExperimentEntry> harmonic_drive_experiments() noexcept {
  return kHarmonicDriveTable;
}

}  // namespace torsio
