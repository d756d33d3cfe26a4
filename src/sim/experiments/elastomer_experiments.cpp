#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "sim/experiments/experiment_table.hpp"
#include "sim/experiments/torque_references.hpp"
#include "sim/loops/bench_torque_loop.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

constexpr std::string_view kElastomerActuators = "elastomer";
constexpr Load kLocked{.is_locked = true};
constexpr double kLowestTriangle_Hz = 0.4;
constexpr double kHighestTriangle_Hz = 4.0;
constexpr double kTriangleAmplitude_Nm = 5.0;
constexpr double kTriangles_s = 30.0;
constexpr double kCycle_Hz = 0.05;
constexpr double kSlowCycles = 30.0;
constexpr double kPhase_s = 60.0;  // duration of a phase of `elastomer_hold`
constexpr double kHoldRamp_Nm_s = 10.0;
constexpr double kWalkAmplitude_Nm = 2.0;

/// Triangles one after the other and again from the first, each from 0 to 0.
class Triangles {
 public:
  struct Segment {
    double frequency_Hz;
    double amplitude_Nm;
    double cycles;
  };

  explicit Triangles(const std::vector<Segment>& segments) {
    for (const Segment& segment : segments) {
      const double samples = segment.cycles / segment.frequency_Hz * kBenchRate_Hz;
      runs_.push_back({Triangle({segment.amplitude_Nm, segment.frequency_Hz}, kBenchRate_Hz),
                       static_cast<std::size_t>(std::lround(samples))});
    }
  }

  double step() noexcept {
    if (sample_ == runs_[run_].samples) {
      run_ = (run_ + 1) % runs_.size();
      runs_[run_].triangle.reset();
      sample_ = 0;
    }
    ++sample_;
    return runs_[run_].triangle.step();
  }

 private:
  struct Run {
    Triangle triangle;
    std::size_t samples;
  };
  std::vector<Run> runs_;
  std::size_t run_ = 0;
  std::size_t sample_ = 0;
};

/// The torque loop on this coupling; K is what its chain has when nothing creeps.
BenchTorqueLoop torque_loop(const DataSheet& sheet) {
  const PlantParameters plant = plant_parameters(sheet);
  const ElastomerCoupling coupling(std::get<ElastomerCoupling::Parameters>(plant.second));
  return {plant, coupling.chain().stiffness(), kBenchRate_Hz};
}

/// Output locked, the motor making the load cell follow a reference.
BenchProgram torque_tracking(const DataSheet& sheet, double duration_s, auto reference) {
  return {.start = kLocked,
          .duration_s = duration_s,
          .command_channels = {kGoalTorque},
          .next = [reference = std::move(reference),
                   loop = torque_loop(sheet)](const Measurement& measured) mutable -> BenchAction {
            const double wanted_Nm = reference.step();
            const double current_A =
                loop.step(wanted_Nm, measured.torque_Nm, measured.motor_angle_rad);
            return {.command = {.current_A = current_A}, .load = kLocked, .commanded = {wanted_Nm}};
          }};
}

BenchProgram triangles(const DataSheet& sheet, const ExperimentSpec& spec) {
  const double amplitude_Nm = spec.torque_amplitude_Nm.value_or(kTriangleAmplitude_Nm);
  if (!spec.frequency_Hz) {
    // The training data of the prototype of specification 4.3, in shares of 5 Nm.
    std::vector<Triangles::Segment> segments = {{0.4, 1.0, 4.0},  {1.0, 0.8, 4.0}, {2.0, 0.6, 6.0},
                                                {4.0, 0.4, 12.0}, {0.6, 0.6, 4.0}, {1.5, 1.0, 5.0}};
    for (auto& segment : segments) segment.amplitude_Nm *= amplitude_Nm;
    return torque_tracking(sheet, kTriangles_s, Triangles(segments));
  }
  if (*spec.frequency_Hz < kLowestTriangle_Hz || *spec.frequency_Hz > kHighestTriangle_Hz) {
    throw UsageError(
        {.place = "triangles frequency",
         .expected = fmt::format("{} to {} Hz", kLowestTriangle_Hz, kHighestTriangle_Hz),
         .found = fmt::format("{} Hz", *spec.frequency_Hz),
         .advice = "leave it out for the sequence of 0.4 to 4 Hz; slow-cycles is slower"});
  }
  return torque_tracking(sheet, kTriangles_s,
                         Triangle({amplitude_Nm, *spec.frequency_Hz}, kBenchRate_Hz));
}

/// Glue that creeps carries less with each cycle, and the output curve ends near the rated torque:
/// a loop that asks for more turns the coupling without end. So the rated torque times what the
/// last cycle leaves of the glue is asked.
BenchProgram slow_cycles(const DataSheet& sheet, const ExperimentSpec& spec) {
  const double duration_s = spec.duration_s.value_or(kSlowCycles / kCycle_Hz);
  const double creep = std::get<ElastomerSheet>(sheet.second).creep_per_cycle.value;
  const double left = std::pow(1.0 - creep, duration_s * kCycle_Hz);
  const double highest_Nm = left * sheet.rating.torque_Nm.value;
  const double amplitude_Nm = spec.torque_amplitude_Nm.value_or(highest_Nm);
  if (amplitude_Nm > highest_Nm) {
    throw UsageError({.place = "slow-cycles amplitude",
                      .problem = "the glue would creep until the coupling cannot carry it",
                      .expected = fmt::format("at most {:.4g} Nm for {} s", highest_Nm, duration_s),
                      .found = fmt::format("{} Nm", amplitude_Nm),
                      .advice = "lower the amplitude, or shorten the duration"});
  }
  return torque_tracking(sheet, duration_s, Triangle({amplitude_Nm, kCycle_Hz}, kBenchRate_Hz));
}

BenchProgram elastomer_static_cycle(const DataSheet& /*sheet*/, const ExperimentSpec& spec) {
  return static_cycle_program(spec.torque_amplitude_Nm.value_or(kTriangleAmplitude_Nm));
}

BenchProgram chirp(const DataSheet& sheet, const ExperimentSpec& spec) {
  return torque_tracking(sheet, kTorqueTest_s,
                         Chirp({.amplitude = spec.torque_amplitude_Nm.value_or(3.0),
                                .start_Hz = 0.05,
                                .end_Hz = 8.0,
                                .duration_s = kTorqueTest_s},
                               kBenchRate_Hz));
}

BenchProgram random_walk(const DataSheet& sheet, const ExperimentSpec& spec) {
  return torque_tracking(
      sheet, kTorqueTest_s,
      torque_walk(spec.torque_amplitude_Nm.value_or(kWalkAmplitude_Nm), spec.seed));
}

BenchProgram multisine(const DataSheet& sheet, const ExperimentSpec& spec) {
  // Spread evenly over the decades; none is an odd multiple of another, where a cubic output curve
  // would answer.
  const std::vector<double> frequencies_Hz = {0.05, 0.11, 0.23, 0.52, 1.1, 2.3, 4.7, 7.9};
  const double each_Nm =
      spec.torque_amplitude_Nm.value_or(4.0) / static_cast<double>(frequencies_Hz.size());
  return torque_tracking(
      sheet, kTorqueTest_s,
      Multisine({.frequencies_Hz = frequencies_Hz,
                 .amplitudes = std::vector<double>(frequencies_Hz.size(), each_Nm),
                 .seed = ~spec.seed},  // the sensors draw from `seed` itself
                kBenchRate_Hz));
}

/// Creep under a torque, relaxation with the rotor clamped where it came to, recovery without load.
BenchProgram elastomer_hold(const DataSheet& sheet, const ExperimentSpec& spec) {
  const double amplitude_Nm = spec.torque_amplitude_Nm.value_or(3.0);
  return {
      .start = kLocked,
      .duration_s = 3.0 * kPhase_s,
      .command_channels = {kGoalTorque},
      .next = [amplitude_Nm, clock = detail::SampleClock(kBenchRate_Hz),
               loop = torque_loop(sheet)](const Measurement& measured) mutable -> BenchAction {
        const double time_s = clock.next_s();
        if (time_s >= kPhase_s && time_s < 2.0 * kPhase_s) {
          loop.reset();
          // The torque that the rotor was brought to; from now on nothing follows it.
          return {.command = {.is_motor_held = true}, .load = kLocked, .commanded = {amplitude_Nm}};
        }
        const double wanted_Nm =
            time_s < kPhase_s ? std::min(amplitude_Nm, kHoldRamp_Nm_s * time_s) : 0.0;
        const double current_A = loop.step(wanted_Nm, measured.torque_Nm, measured.motor_angle_rad);
        return {.command = {.current_A = current_A}, .load = kLocked, .commanded = {wanted_Nm}};
      }};
}

constexpr auto kElastomerTable = std::to_array<ExperimentEntry>({
    {.info = {.name = "triangles",
              .actuators = kElastomerActuators,
              .description = "a PI torque loop makes triangles, output locked: a sequence of 0.4 "
                             "to 4 Hz and 5 to 2 Nm",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 1.0,
     .has_frequency = true,
     .program = triangles},
    {.info =
         {.name = "slow-cycles",
          .actuators = kElastomerActuators,
          .description =
              "30 triangles at 0.05 Hz, output locked, of 6 Nm or what creeping glue lets reach",
          .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 1.0,
     .program = slow_cycles},
    {.info = {.name = "static-cycle",
              .actuators = kElastomerActuators,
              .description = "rotor held, a torque ramp of +-5 Nm pulls on the output at 0.05 Hz",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 0.9,
     .program = elastomer_static_cycle},
    {.info = {.name = "chirp",
              .actuators = kElastomerActuators,
              .description = "the torque loop follows a chirp of 3 Nm, 0.05 to 8 Hz in 100 s",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 1.0,
     .program = chirp},
    {.info = {.name = "random-walk",
              .actuators = kElastomerActuators,
              .description =
                  "the torque loop follows noise below 1 Hz with the RMS of a chirp of 2 Nm",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = kWalkAmplitude,
     .program = random_walk},
    {.info = {.name = "multisine",
              .actuators = kElastomerActuators,
              .description =
                  "the torque loop follows eight sines, 0.05 to 8 Hz and together at most 4 Nm",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 1.0,
     .program = multisine},
    {.info = {.name = "hold",
              .actuators = kElastomerActuators,
              .description =
                  "3 Nm are held for 60 s, then the rotor for 60 s, then no torque for 60 s",
              .amplitude_unit = "Nm"},
     .family = ActuatorFamily::elastomer,
     .highest_torque_share = 0.9,
     .program = elastomer_hold},
});

}  // namespace

std::span<const ExperimentEntry> elastomer_experiments() noexcept { return kElastomerTable; }

}  // namespace torsio
