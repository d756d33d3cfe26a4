#include "torsio/sim/experiments/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/report_progress.hpp"
#include "sim/bench/bench.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/bench_log.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 36000.0;
constexpr double kLowest_Hz = 0.001;  // a thousand seconds a period
constexpr double kHighestOfBand_Hz = 20.0;
constexpr double kHeaviest_kg = 100.0;

void check_band(const ExperimentSpec& spec, const ExperimentEntry& entry) {
  for (const auto& [value, option] : {std::pair{spec.lowest_frequency_Hz, "lowest"},
                                      std::pair{spec.highest_frequency_Hz, "highest"}}) {
    if (!value) continue;
    const std::string place = fmt::format("{} {}", entry.info.name, option);
    require<UsageError>(entry.has_band, place, "none: this experiment has no band of frequencies",
                        as_text(*value));
    require<UsageError>(*value >= kLowest_Hz && *value <= kHighestOfBand_Hz, place,
                        fmt::format("{} to {} Hz", kLowest_Hz, kHighestOfBand_Hz), as_text(*value));
  }
}

void check(const ExperimentSpec& spec, const ExperimentEntry& entry, const DataSheet& sheet) {
  const auto require_option = [&](bool holds, const char* option, const std::string& expected,
                                  const std::string& found) {
    require<UsageError>(holds, fmt::format("{} {}", entry.info.name, option), expected, found);
  };
  if (spec.duration_s) {
    require_option(
        *spec.duration_s >= 1.0 / sheet.sensors.log_rate_Hz.value && *spec.duration_s <= kLongest_s,
        "duration", fmt::format("{} to {} s", 1.0 / sheet.sensors.log_rate_Hz.value, kLongest_s),
        as_text(*spec.duration_s));
  }
  if (spec.lever_m) {
    require_option(entry.has_lever, "lever", "none: this experiment has no lever",
                   as_text(*spec.lever_m));
    require_option(*spec.lever_m > 0.0 && *spec.lever_m <= 2.0, "lever", "0 < metres <= 2",
                   as_text(*spec.lever_m));
  }
  if (spec.mass_kg) {
    require_option(entry.has_lever, "mass", "none: this experiment has no lever",
                   as_text(*spec.mass_kg));
    require_option(*spec.mass_kg > 0.0 && *spec.mass_kg <= kHeaviest_kg, "mass",
                   fmt::format("0 < kg <= {}", kHeaviest_kg), as_text(*spec.mass_kg));
  }
  check_band(spec, entry);
  const double inclination_deg = deg_from_rad(spec.inclination_rad);
  require_option(entry.has_lever || spec.inclination_rad == 0.0, "inclination",
                 "none: this experiment has no lever", as_text(inclination_deg));
  require_option(std::abs(inclination_deg) <= 90.0, "inclination", "-90 to 90 deg",
                 fmt::format("{:.6g} deg (a number without unit is radians)", inclination_deg));
  const auto require_amplitude = [&](const std::optional<double>& value, std::string_view unit,
                                     double highest, double shown, const char* shown_unit) {
    if (!value) return;
    const auto shown_text = [&](double of) {
      return fmt::format("{:.6g} {}", shown * of, shown_unit);
    };
    require_option(!entry.info.amplitude_unit.empty(), "amplitude",
                   "none: the amplitude of this experiment is fixed", shown_text(*value));
    require_option(entry.info.amplitude_unit == unit, "amplitude",
                   fmt::format("one in {}", entry.info.amplitude_unit), shown_text(*value));
    require_option(*value > 0.0 && *value <= highest, "amplitude",
                   "above 0 and at most " + shown_text(highest), shown_text(*value));
  };
  require_amplitude(
      spec.torque_amplitude_Nm, "Nm",
      std::min(entry.highest_torque_share * sheet.rating.torque_Nm.value, entry.highest_torque_Nm),
      1.0, "Nm");
  require_amplitude(spec.angle_amplitude_rad, "rad", entry.highest_angle_rad, deg_from_rad(1.0),
                    "deg");
  if (spec.frequency_Hz) {
    require_option(entry.has_frequency, "frequency",
                   "none: the frequency of this experiment is fixed", as_text(*spec.frequency_Hz));
    require_option(*spec.frequency_Hz >= kLowest_Hz && *spec.frequency_Hz <= 10.0, "frequency",
                   fmt::format("{} to 10 Hz", kLowest_Hz), as_text(*spec.frequency_Hz));
  }
  require_option(entry.has_impedance || !spec.is_impedance_zero, "impedance",
                 "none: no impedance controller runs in this experiment", "zero");
}

/// The input of the bench's loop: if a sensor gives NaN, its last number.
Measurement with_last_numbers(Measurement measured, const Measurement& last,
                              std::span<const SensedChannel> channels) {
  for (const SensedChannel& channel : channels)
    if (!std::isfinite(measured.*channel.value)) measured.*channel.value = last.*channel.value;
  return measured;
}

}  // namespace

Recording simulate(const ExperimentSpec& spec, const Progress& progress) {
  return simulate(data_sheet(spec.actuator), spec, progress);
}

Recording simulate(const DataSheet& nominal, const ExperimentSpec& spec, const Progress& progress) {
  check(spec.conditions);
  const DataSheet sheet = aged(nominal, spec.conditions.age);
  const ExperimentEntry& entry = experiment_entry(spec.experiment, sheet);
  check(spec, entry, sheet);
  BenchProgram program = entry.program(sheet, spec);
  const double duration_s = spec.duration_s.value_or(program.duration_s);
  Bench bench(sheet,
              {.name = std::string(entry.info.name),
               .duration_s = duration_s,
               .seed = spec.seed,
               .conditions = spec.conditions,
               .is_electrical = spec.is_electrical,
               .faults = spec.faults},
              program);
  const auto ticks = static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
  const std::vector<SensedChannel> channels = sensed_channels(sheet);
  Measurement seen;
  BenchLog log(sheet, ticks, spec.with_truth, spec.is_electrical, program.command_channels);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    if (tick % 1000 == 0) {
      report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                      "simulating");
    }
    const Measurement measured = bench.sense();
    seen = with_last_numbers(measured, tick == 0 ? bench.sound() : seen, channels);
    const BenchAction action = program.next(seen);
    log.add(measured, bench.truth(), action.commanded);
    bench.act(action);
  }
  Recording recording =
      log.finish(fmt::format("{} {} seed {}", full_name(sheet), entry.info.name, spec.seed));
  for (const auto& [name, value] : program.log_conditions) recording.add_condition(name, value);
  return recording;
}

std::vector<double> measured_twist(const DataSheet& sheet, const Recording& recording) {
  const auto difference = [&](const char* of, double scale, const char* minus) {
    std::vector<double> twist = recording.channel(of).values;
    const std::vector<double>& other = recording.channel(minus).values;
    for (std::size_t i = 0; i < twist.size(); ++i) twist[i] = scale * twist[i] - other[i];
    return twist;
  };
  switch (sheet.family) {
    case ActuatorFamily::elastomer: return recording.channel("spring_deflection_rad").values;
    case ActuatorFamily::rubber_clutch:
      return difference("input_angle_rad", 1.0, "joint_angle_rad");
    case ActuatorFamily::harmonic_drive:
      return difference("motor_angle_rad", 1.0 / std::get<TubeSheet>(sheet.first).ratio.value,
                        "wave_generator_angle_rad");
    case ActuatorFamily::series_elastic: break;
  }
  return difference("gear_angle_rad", 1.0, "joint_angle_rad");
}

PlantFigures plant_figures(const DataSheet& sheet) {
  const PlantParameters parameters = plant_parameters(sheet);
  return {.natural_frequencies_Hz = natural_frequencies(parameters),
          .longest_step_s = Plant::step_limit(parameters)};
}

}  // namespace torsio
