#include "torsio/sim/experiment.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

#include "bench_log.hpp"
#include "experiment_table.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 36000.0;

void check(const ExperimentSpec& spec, const ExperimentEntry& entry, const DataSheet& sheet) {
  const auto require = [&](bool holds, const char* option, const std::string& expected,
                           const std::string& found) {
    if (holds) return;
    throw UsageError({.place = fmt::format("{} {}", entry.info.name, option),
                      .expected = expected,
                      .found = found});
  };
  const auto text = [](double value) { return fmt::format("{}", value); };
  if (spec.duration_s) {
    require(
        *spec.duration_s >= 1.0 / sheet.sensors.log_rate_Hz.value && *spec.duration_s <= kLongest_s,
        "duration", fmt::format("{} to {} s", 1.0 / sheet.sensors.log_rate_Hz.value, kLongest_s),
        text(*spec.duration_s));
  }
  if (spec.lever_m) {
    require(entry.has_lever, "lever", "none: this experiment has no lever", text(*spec.lever_m));
    require(*spec.lever_m > 0.0 && *spec.lever_m <= 2.0, "lever", "0 < metres <= 2",
            text(*spec.lever_m));
  }
  const double inclination_deg = deg_from_rad(spec.inclination_rad);
  require(entry.has_lever || spec.inclination_rad == 0.0, "inclination",
          "none: this experiment has no lever", text(inclination_deg));
  require(std::abs(inclination_deg) <= 90.0, "inclination", "-90 to 90 deg", text(inclination_deg));
  if (spec.amplitude) {
    require(!entry.info.amplitude_unit.empty(), "amplitude",
            "none: this experiment has an amplitude of its own", text(*spec.amplitude));
    const double highest = entry.highest_amplitude *
                           (entry.info.amplitude_unit == "Nm" ? sheet.rating.torque_Nm.value : 1.0);
    require(*spec.amplitude > 0.0 && *spec.amplitude <= highest, "amplitude",
            fmt::format("0 < {} <= {:.4g}", entry.info.amplitude_unit, highest),
            text(*spec.amplitude));
  }
  if (spec.frequency_Hz) {
    require(entry.has_frequency, "frequency", "none: this experiment has a frequency of its own",
            text(*spec.frequency_Hz));
    require(*spec.frequency_Hz >= 0.0 && *spec.frequency_Hz <= 10.0, "frequency", "0 to 10 Hz",
            text(*spec.frequency_Hz));
  }
  require(entry.has_impedance || !spec.is_impedance_zero, "impedance",
          "none: no impedance controller runs in this experiment", "zero");
}

double load_cell_torque(LoadCell cell, const Plant& plant, const Load& load) {
  switch (cell) {
    case LoadCell::external: return load.external_torque_Nm;
    case LoadCell::wall: return plant.torques().wall_Nm;
    case LoadCell::joint: break;
  }
  return plant.torques().joint_Nm;
}

}  // namespace

Recording simulate(const ExperimentSpec& spec, const Progress& progress) {
  return simulate(data_sheet(spec.actuator), spec, progress);
}

Recording simulate(const DataSheet& sheet, const ExperimentSpec& spec, const Progress& progress) {
  const ExperimentEntry& entry = experiment_entry(spec.experiment, sheet);
  check(spec, entry, sheet);
  BenchProgram program = entry.program(sheet, spec);
  Plant plant(plant_parameters(sheet));
  plant.reset(program.start_angle_rad, program.start);
  Load load = program.start;
  SensorSet sensors(sheet, kBenchRate_Hz, spec.seed);
  sensors.reset(load_cell_torque(program.load_cell, plant, load));

  const double duration_s = spec.duration_s.value_or(program.duration_s);
  const auto ticks = static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
  const auto ticks_a_sample =
      static_cast<std::size_t>(std::lround(kBenchRate_Hz / sheet.sensors.log_rate_Hz.value));
  BenchLog log(sheet, ticks / ticks_a_sample + 1, spec.with_truth);
  bool is_torque_fresh = false;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    if (tick % 1000 == 0) {
      report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                      "simulating");
    }
    const double torque_Nm = load_cell_torque(program.load_cell, plant, load);
    const Measurement measured = sensors.step(plant, torque_Nm);
    is_torque_fresh = is_torque_fresh || measured.is_torque_fresh;
    if (tick % ticks_a_sample == 0) {
      log.add(measured, is_torque_fresh, plant, torque_Nm);
      is_torque_fresh = false;
    }
    const BenchAction action = program.next(measured);
    load = action.load;
    const Fault fault = plant.step(action.command, load, 1.0 / kBenchRate_Hz);
    if (fault != Fault::none)
      throw Error({.place = fmt::format("{} at {} s", entry.info.name,
                                        static_cast<double>(tick) / kBenchRate_Hz),
                   .problem = fmt::format("the plant refuses its command or load: {}",
                                          torsio::name(fault))});
  }
  return log.finish(fmt::format("{} {} seed {}", full_name(sheet), entry.info.name, spec.seed));
}

}  // namespace torsio
