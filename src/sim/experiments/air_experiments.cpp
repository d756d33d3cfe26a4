#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sim/experiments/experiment_table.hpp"
#include "sim/experiments/torque_references.hpp"
#include "sim/loops/bench_pd_loop.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"

// A lever with a known mass in the air: what a joint without a torque sensor can do. The drive follows an angle by a law
// that the log states, so that a reader can repeat the run from its command alone.

namespace torsio {
namespace {

constexpr double kAirDuration_s = 60.0;
constexpr double kAirAmplitude_rad = rad_from_deg(20.0);
constexpr double kLowestOfAir_Hz = 0.1;
constexpr double kHighestOfAir_Hz = 8.0;
/// Above it the amplitude falls with the frequency, so that the speed stays: at 20 deg 0.9 rad/s, below the rated
/// speed of every actuator that states one.
constexpr double kConstantSpeed_Hz = 0.4;
constexpr double kLeverShare = 0.3;  // share of the rated torque that its weight is, held level
constexpr double kElastomerMass_kg = 1.0;  // 9 kg would hang at 2 cm
constexpr double kStepHold_s = 1.0;
constexpr std::size_t kTonesOfAir = 12;
constexpr double kMultisineFade_s = 1.0;
constexpr double kReleaseAngle_rad = rad_from_deg(60.0);
constexpr double kHeld_s = 1.0;
constexpr double kRelease_s = 6.0;

struct Band {
  double lowest_Hz;
  double highest_Hz;
};

Band band(const ExperimentSpec& spec) {
  const Band of{spec.lowest_frequency_Hz.value_or(kLowestOfAir_Hz),
                spec.highest_frequency_Hz.value_or(kHighestOfAir_Hz)};
  if (of.lowest_Hz < of.highest_Hz) return of;
  throw UsageError(
      {.place = fmt::format("{} lowest", spec.experiment),
       .expected = fmt::format("a frequency below the highest one, {:.6g} Hz", of.highest_Hz),
       .found = fmt::format("{:.6g} Hz", of.lowest_Hz),
       .advice = fmt::format("The band is {} to {} Hz if neither is given.", kLowestOfAir_Hz,
                             kHighestOfAir_Hz)});
}

/// Share of the amplitude at a frequency.
double share_at(double frequency_Hz) { return std::min(1.0, kConstantSpeed_Hz / frequency_Hz); }

/// An angle as a function of time. The lever is where it hangs at its beginning.
using GoalAngle = std::function<double()>;

/// Every octave has the same length.
GoalAngle chirp_goal(const ExperimentSpec& spec, double amplitude_rad, double duration_s) {
  const Band of = band(spec);
  LogSweep sweep({.amplitude = amplitude_rad,
                  .start_Hz = of.lowest_Hz,
                  .end_Hz = of.highest_Hz,
                  .duration_s = duration_s},
                 kBenchRate_Hz);
  return [=, octaves = std::log(of.highest_Hz / of.lowest_Hz),
          clock = detail::SampleClock(kBenchRate_Hz)]() mutable {
    const double passed = std::min(clock.next_s() / duration_s, 1.0);
    return share_at(of.lowest_Hz * std::exp(octaves * passed)) * sweep.step();
  };
}

/// Levels that the seed draws, each held for a second.
GoalAngle step_goal(const ExperimentSpec& spec, double amplitude_rad, double duration_s) {
  Random random(~spec.seed);  // the sensors draw from `seed` itself
  std::vector<double> levels_rad(static_cast<std::size_t>(std::ceil(duration_s / kStepHold_s)));
  for (double& level_rad : levels_rad) level_rad = amplitude_rad * (2.0 * random.uniform() - 1.0);
  return [steps = Steps({.levels = std::move(levels_rad), .hold_s = kStepHold_s},
                        kBenchRate_Hz)]() mutable { return steps.step(); };
}

/// Sines at equal ratios of frequency, whose phases the seed draws; together they reach the amplitude.
GoalAngle multisine_goal(const ExperimentSpec& spec, double amplitude_rad, double duration_s) {
  const auto [lowest_Hz, highest_Hz] = band(spec);
  Multisine::Parameters tones{.frequencies_Hz = {}, .amplitudes = {}, .seed = ~spec.seed};
  for (std::size_t tone = 0; tone < kTonesOfAir; ++tone) {
    const double place = static_cast<double>(tone) / static_cast<double>(kTonesOfAir - 1);
    tones.frequencies_Hz.push_back(lowest_Hz * std::pow(highest_Hz / lowest_Hz, place));
    tones.amplitudes.push_back(share_at(tones.frequencies_Hz.back()));
  }
  Multisine trial(tones, kBenchRate_Hz);
  double largest = 0.0;
  const auto ticks = static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
  for (std::size_t tick = 0; tick < ticks; ++tick)
    largest = std::max(largest, std::abs(trial.step()));
  for (double& amplitude : tones.amplitudes) amplitude *= amplitude_rad / largest;
  return [sum = Multisine(std::move(tones), kBenchRate_Hz),
          clock = detail::SampleClock(kBenchRate_Hz)]() mutable {
    return std::min(clock.next_s() / kMultisineFade_s, 1.0) * sum.step();
  };
}

double air_mass(const DataSheet& sheet, const ExperimentSpec& spec) {
  return spec.mass_kg.value_or(sheet.family == ActuatorFamily::elastomer ? kElastomerMass_kg
                                                                         : kLeverMass_kg);
}

/// The length that was asked for, or one in whole centimetres.
double air_lever(const DataSheet& sheet, const ExperimentSpec& spec, double mass_kg) {
  if (spec.lever_m) return *spec.lever_m;
  const double length_m = kLeverMass_kg / mass_kg * lever_m(sheet, kLeverShare);
  return std::max(std::round(100.0 * length_m), 1.0) / 100.0;
}

struct Air {
  Load load;
  BenchPdLoop loop;
  double amplitude_rad;  ///< goals that begin where the lever hangs
};

/// The lever, its law, and what the log states of both.
Air air(const DataSheet& sheet, const ExperimentSpec& spec, BenchProgram& program) {
  const double mass_kg = air_mass(sheet, spec);
  const double length_m = air_lever(sheet, spec, mass_kg);
  const Load load = bearable_lever(sheet, spec, mass_kg, length_m);
  const PlantParameters plant = plant_parameters(sheet);
  const BenchPdLoop::Gains gains =
      BenchPdLoop::gains(plant, load.inertia_kg_m2, sheet.rating.torque_Nm.value);
  program.start = load;
  program.command_channels = {kGoalAngle, "command_torque_Nm"};
  program.log_conditions = {{"kp_Nm_rad", gains.kp_Nm_rad},
                            {"kd_Nms_rad", gains.kd_Nms_rad},
                            {"torque_limit_Nm", gains.torque_limit_Nm},
                            {"gear_ratio_1", total_ratio(plant)},
                            {"lever_m", length_m},
                            {"mass_kg", mass_kg},
                            {"inclination_rad", spec.inclination_rad}};
  return {load, BenchPdLoop(plant, gains, kBenchRate_Hz),
          spec.angle_amplitude_rad.value_or(kAirAmplitude_rad)};
}

template <GoalAngle (*goal_of)(const ExperimentSpec&, double, double)>
BenchProgram in_air(const DataSheet& sheet, const ExperimentSpec& spec) {
  BenchProgram program{.start = {}, .duration_s = kAirDuration_s, .next = {}};
  const Air of = air(sheet, spec, program);
  program.next = [load = of.load, loop = of.loop,
                  goal = goal_of(spec, of.amplitude_rad, spec.duration_s.value_or(kAirDuration_s))](
                     const Measurement& measured) mutable -> BenchAction {
    const double goal_rad = goal();
    const double torque_Nm = loop.step(goal_rad, measured.motor_angle_rad);
    return {.command = {.current_A = loop.current(torque_Nm)},
            .load = load,
            .commanded = {goal_rad, torque_Nm}};
  };
  return program;
}

/// The lever is held, then the power goes off with the winding open: the only run in which friction alone brakes.
BenchProgram air_release(const DataSheet& sheet, const ExperimentSpec& spec) {
  BenchProgram program{.start = {}, .duration_s = kRelease_s, .next = {}};
  const Air of = air(sheet, spec, program);
  const double goal_rad = spec.angle_amplitude_rad.value_or(kReleaseAngle_rad);
  program.start_angle_rad = goal_rad;
  program.command_channels.emplace_back("enabled_1");
  program.next = [load = of.load, loop = of.loop, goal_rad,
                  clock = detail::SampleClock(kBenchRate_Hz)](
                     const Measurement& measured) mutable -> BenchAction {
    const bool is_on = clock.next_s() < kHeld_s;
    const double torque_Nm = is_on ? loop.step(goal_rad, measured.motor_angle_rad) : 0.0;
    return {.command = {.current_A = loop.current(torque_Nm)},
            .load = load,
            .commanded = {goal_rad, torque_Nm, is_on ? 1.0 : 0.0}};
  };
  return program;
}

struct AirFamily {
  ActuatorFamily family;
  std::string_view actuators;
};

constexpr ExperimentEntry air_entry(const AirFamily& of, std::string_view name,
                                    std::string_view description, bool has_band,
                                    BenchProgram (*program)(const DataSheet&,
                                                            const ExperimentSpec&)) {
  return {.info = {.name = name,
                   .actuators = of.actuators,
                   .description = description,
                   .amplitude_unit = "rad"},
          .family = of.family,
          .has_lever = true,
          .highest_angle_rad = rad_from_deg(90.0),
          .has_band = has_band,
          .program = program};
}

constexpr auto air_table() {
  constexpr std::array<AirFamily, 3> kFamilies{
      {{ActuatorFamily::series_elastic, "dfki-*"},
       {ActuatorFamily::elastomer, "elastomer"},
       {ActuatorFamily::harmonic_drive, "harmonic-drive"}}};
  std::array<ExperimentEntry, 4 * kFamilies.size()> all;
  for (std::size_t i = 0; i < kFamilies.size(); ++i) {
    all[i] = air_entry(kFamilies[i], "air-chirp",
                       "a lever with a known mass in the air follows an angle, 20 deg from 0.1 to "
                       "8 Hz, by a PD law whose gains are logged",
                       true, in_air<chirp_goal>);
    all[kFamilies.size() + i] =
        air_entry(kFamilies[i], "air-steps",
                  "as air-chirp, with a new angle within 20 deg every second, drawn from the seed",
                  false, in_air<step_goal>);
    all[2 * kFamilies.size() + i] =
        air_entry(kFamilies[i], "air-multisine",
                  "as air-chirp, with twelve sines at once whose phases are drawn from the seed",
                  true, in_air<multisine_goal>);
    all[3 * kFamilies.size() + i] =
        air_entry(kFamilies[i], "air-release",
                  "the lever of air-chirp is held at 60 deg for a second, then the power goes off "
                  "and it falls",
                  false, air_release);
  }
  return all;
}

constexpr auto kAirTable = air_table();

}  // namespace

std::span<const ExperimentEntry> air_experiments() noexcept { return kAirTable; }

}  // namespace torsio
