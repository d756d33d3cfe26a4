#include "torsio/sim/closed_loop/impedance_tracking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <variant>

#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "core/report_progress.hpp"
#include "evaluate/fit_and_score.hpp"
#include "sim/bench/bench.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

constexpr auto kImpedance = "impedance";
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kLargestAmplitude_Nm = 50.0;  // as the experiments of the bench
constexpr double kShortestImpedance_s = 10.0;
constexpr double kLongestImpedance_s = 3600.0;
constexpr double kFurthest_rad = 200.0;       // 30 turns: beyond it the loop diverges
constexpr double kImpedanceSettling_s = 3.0;  // ten times M / d of the output
constexpr double kPeriods = 8.0;
constexpr double kShortestMeasured_s = 4.0;
// A whole number of ticks a period, so that the harmonics are orthogonal to each other and to a
// constant.
constexpr std::array kFrequencies_Hz = {0.1, 0.2, 0.4, 0.5, 0.8, 1.0, 2.0, 4.0, 5.0, 8.0, 10.0};

struct Linear {
  SeriesElasticJoint joint;
  JointFeedback feedback;

  explicit Linear(const TubeImpedance::Settings& settings)
      : joint(TubeImpedance::joint_of(settings)),
        feedback(TubeImpedance::feedback_of(settings, kBenchRate_Hz)) {}

  [[nodiscard]] double passive_to_Hz() const {
    for (const JointOutput output : {JointOutput::locked, JointOutput::free})
      if (!is_stable_closed(open_loop(joint, feedback, output))) return 0.0;
    return passivity(joint, feedback).passive_to_rad_s / kTurn;
  }
  /// Torque over angle at the output.
  [[nodiscard]] Complex at(double frequency_Hz) const {
    const double rad_s = kTurn * frequency_Hz;
    const Complex s(0.0, rad_s);
    return s * (impedance(joint, feedback, rad_s) + s * joint.joint_inertia_kg_m2 +
                joint.joint_viscous_Nms_rad);
  }
};

void require_setting(bool holds, const char* what, std::string_view expected, double found) {
  require<UsageError>(holds, fmt::format("{} {}", kImpedance, what), expected, found);
}

void check(const ImpedanceSpec& spec) {
  require_setting(spec.stiffness_Nm_rad >= 0.0 && std::isfinite(spec.stiffness_Nm_rad), "stiffness",
                  "0 Nm/rad or more", spec.stiffness_Nm_rad);
  require_setting(spec.damping_Nms_rad >= 0.0 && std::isfinite(spec.damping_Nms_rad), "damping",
                  "0 Nms/rad or more", spec.damping_Nms_rad);
  require_setting(spec.torque_gain_Nm_rad > 0.0 && std::isfinite(spec.torque_gain_Nm_rad),
                  "torque gain", "above 0 Nm/rad", spec.torque_gain_Nm_rad);
  require_setting(spec.amplitude_Nm > 0.0 && spec.amplitude_Nm <= kLargestAmplitude_Nm, "amplitude",
                  fmt::format("above 0 and at most {:g} Nm", kLargestAmplitude_Nm),
                  spec.amplitude_Nm);
  require_setting(
      spec.duration_s >= kShortestImpedance_s && spec.duration_s <= kLongestImpedance_s, "duration",
      fmt::format("{:g} to {:g} s", kShortestImpedance_s, kLongestImpedance_s), spec.duration_s);
}

double largest_passive_Nm_rad(const TubeImpedance::Settings& settings, double damping_Nms_rad) {
  return passive_stiffness(settings, damping_Nms_rad, kTurn * ImpedanceRun::kPassiveTo_Hz,
                           kBenchRate_Hz);
}

void require_passive(const TubeImpedance::Settings& settings, const ImpedanceSpec& spec) {
  const double passive_to_Hz = Linear(settings).passive_to_Hz();
  if (passive_to_Hz >= ImpedanceRun::kPassiveTo_Hz) return;
  const double largest_Nm_rad = largest_passive_Nm_rad(settings, spec.damping_Nms_rad);
  const std::string with = fmt::format("a damping of {:g} Nms/rad and a torque gain of {:g} Nm/rad",
                                       spec.damping_Nms_rad, spec.torque_gain_Nm_rad);
  const std::string unstable = "unstable without dry friction";
  throw UsageError(
      {.place = kImpedance,
       .problem = fmt::format("not passive up to {:g} Hz", ImpedanceRun::kPassiveTo_Hz),
       .expected = largest_Nm_rad > 0.0
                       ? fmt::format("at most {:.4g} Nm/rad with {}", largest_Nm_rad, with)
                       : fmt::format("another damping or torque gain: no stiffness is passive with "
                                     "{}",
                                     with),
       .found = fmt::format(
           "{:g} Nm/rad, {}", spec.stiffness_Nm_rad,
           passive_to_Hz > 0.0 ? fmt::format("passive up to {:.3g} Hz", passive_to_Hz) : unstable),
       .advice = "Take less stiffness, or a torque gain of 1 Nm/rad or less."});
}

/// The bench under impedance control, tick by tick.
class ImpedanceBench {
 public:
  ImpedanceBench(const DataSheet& sheet, const TubeImpedance::Settings& settings, double duration_s,
                 std::uint64_t seed)
      : bench_(
            sheet,
            {.name = kImpedance,
             .duration_s = duration_s,
             .seed = seed,
             .conditions = {},
             .faults = no_faults_},
            {.start = {}, .load_cell = LoadCell::external, .duration_s = duration_s, .next = {}}),
        controller_(settings, kBenchRate_Hz),
        ticks_(static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz))) {}

  /// @param torque_of the torque [Nm] of the environment on the output in this tick, for its state
  /// @param observe called with this torque at every tick
  template <class TorqueOf, class Observe>
  void run(const TorqueOf& torque_of, const Observe& observe, const Progress& progress) {
    for (std::size_t tick = 0; tick < ticks_; ++tick) {
      if (tick % 1000 == 0)
        report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks_),
                        "rendering the impedance");
      const Measurement measured = bench_.sense();
      const BenchTruth truth = bench_.truth();
      const PlantState& state = truth.plant.state();
      if (!(std::abs(state.joint_angle_rad) < kFurthest_rad))
        throw Error({.place = fmt::format("{} at {:g} s", kImpedance, bench_.time_s()),
                     .problem = "the angle of the joint grows without bound",
                     .expected = fmt::format("an angle within {:g} rad", kFurthest_rad),
                     .found = fmt::format("{:g} rad", state.joint_angle_rad)});
      const TubeImpedance::Output out = controller_.step(0.0, 0.0,
                                                         {.rotor_rad = measured.motor_angle_rad,
                                                          .middle_rad = measured.middle_angle_rad,
                                                          .joint_rad = measured.joint_angle_rad});
      limited_ += out.is_limited ? 1 : 0;
      const double torque_Nm = torque_of(state);
      observe(tick, torque_Nm, measured, truth);
      bench_.act(
          {.command = {.current_A = out.current_A}, .load = {.external_torque_Nm = torque_Nm}});
    }
  }
  [[nodiscard]] std::size_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] std::size_t limited() const noexcept { return limited_; }

 private:
  const FaultSchedule no_faults_ = {};
  Bench bench_;
  TubeImpedance controller_;
  std::size_t ticks_;
  std::size_t limited_ = 0;
};

struct Cycles {
  std::size_t all = 0;
  std::size_t limited = 0;
  void add(const ImpedanceBench& bench) {
    all += bench.ticks();
    limited += bench.limited();
  }
};

/// First harmonics of torque and angle, over whole periods after the settling.
ImpedancePoint point_at(double frequency_Hz, const DataSheet& sheet,
                        const TubeImpedance::Settings& settings, const ImpedanceSpec& spec,
                        std::uint64_t seed, Cycles& cycles, const Progress& progress) {
  const auto whole_periods_s = [&](double least_s) {
    return std::ceil(least_s * frequency_Hz) / frequency_Hz;
  };
  const double settling_s = whole_periods_s(kImpedanceSettling_s);
  const double measured_s = whole_periods_s(std::max(kShortestMeasured_s, kPeriods / frequency_Hz));
  const auto first = static_cast<std::size_t>(std::lround(settling_s * kBenchRate_Hz));
  ImpedanceBench bench(sheet, settings, settling_s + measured_s, seed);
  const double rad = kTurn * frequency_Hz / kBenchRate_Hz;
  Complex torque;
  Complex angle;
  std::size_t tick = 0;
  bench.run(
      [&](const PlantState&) {
        return spec.amplitude_Nm * std::sin(rad * static_cast<double>(tick++));
      },
      [&](std::size_t at, double torque_Nm, const Measurement&, const BenchTruth& truth) {
        if (at < first) return;
        const Complex turn = std::polar(1.0, -rad * static_cast<double>(at));
        torque += torque_Nm * turn;
        angle += truth.plant.state().joint_angle_rad * turn;
      },
      progress);
  cycles.add(bench);
  // The torque is held for a tick: its first harmonic is later by half a tick, and a little smaller.
  const Complex hold = std::polar(std::sin(0.5 * rad) / (0.5 * rad), -0.5 * rad);
  return {.frequency_Hz = frequency_Hz,
          .wanted_Nm_rad = {},
          .linear_Nm_rad = Linear(settings).at(frequency_Hz),
          .rendered_Nm_rad = hold * torque / angle};
}

class Range {
 public:
  void add(double value) noexcept {
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  [[nodiscard]] double deg() const noexcept { return deg_from_rad(high_ - low_); }

 private:
  double low_ = 0.0;
  double high_ = 0.0;
};

void move_hand(ImpedanceRun& run, const DataSheet& sheet, const TubeImpedance::Settings& settings,
               Cycles& cycles, const Progress& progress) {
  ImpedanceBench bench(sheet, settings, run.spec.duration_s, run.seed);
  BenchLog log(sheet, bench.ticks(), true);
  // Not the numbers that the sensors' noise is made of.
  QuasiPeriodic path({.amplitude = HandForces::kAmplitude_rad,
                      .frequency_Hz = HandForces::kFrequency_Hz,
                      .seed = Random(run.seed).bits()},
                     kBenchRate_Hz);
  double hand_rad = 0.0;
  Range hand_range;
  Range joint_range;
  double torque_squares = 0.0;
  double excess_squares = 0.0;
  double work_J = 0.0;
  HandForces& of = run.hand;
  bench.run(
      [&](const PlantState& state) {
        const double last_rad = std::exchange(hand_rad, path.step());
        const double hand_rad_s = (hand_rad - last_rad) * kBenchRate_Hz;
        return HandForces::kArmStiffness_Nm_rad * (hand_rad - state.joint_angle_rad) +
               HandForces::kArmDamping_Nms_rad * (hand_rad_s - state.joint_speed_rad_s);
      },
      [&](std::size_t /*tick*/, double torque_Nm, const Measurement& measured,
          const BenchTruth& truth) {
        const PlantState& state = truth.plant.state();
        log.add(measured, truth);
        const double wanted_Nm = run.stiffness_Nm_rad * state.joint_angle_rad +
                                 run.damping_Nms_rad * state.joint_speed_rad_s;
        torque_squares += torque_Nm * torque_Nm;
        excess_squares += (torque_Nm - wanted_Nm) * (torque_Nm - wanted_Nm);
        work_J += torque_Nm * state.joint_speed_rad_s / kBenchRate_Hz;
        of.max_Nm = std::max(of.max_Nm, std::abs(torque_Nm));
        hand_range.add(hand_rad);
        joint_range.add(state.joint_angle_rad);
      },
      progress);
  cycles.add(bench);
  const auto ticks = static_cast<double>(bench.ticks());
  of.rms_Nm = std::sqrt(torque_squares / ticks);
  of.rms_to_wanted_Nm = std::sqrt(excess_squares / ticks);
  of.rms_N = of.rms_Nm / HandForces::kLever_m;
  of.max_N = of.max_Nm / HandForces::kLever_m;
  of.hand_range_deg = hand_range.deg();
  of.joint_range_deg = joint_range.deg();
  of.mean_power_W = work_J / run.spec.duration_s;
  run.record = log.finish(fmt::format("{} impedance seed {}", full_name(sheet), run.seed));
}

}  // namespace

TubeImpedance::Settings impedance_settings(const DataSheet& sheet, const ImpedanceSpec& spec) {
  if (sheet.family != ActuatorFamily::harmonic_drive)
    throw UsageError({.place = kImpedance,
                      .expected = "an actuator with a torsion tube before its harmonic drive, "
                                  "harmonic-drive",
                      .found = sheet.name,
                      .advice = "For a series-elastic actuator the library has JointImpedance on "
                                "a torque loop (docs/robot/control.md)."});
  check(spec);
  TubeImpedance::Settings settings = tube_impedance_settings(
      sheet, spec.kind == ImpedanceSpec::Kind::high ? TubeImpedance::kHigh : TubeImpedance::kZero);
  // A rigid tube twists too little for its encoders.
  if (sheet.variant == "rigid") settings.twist = TubeImpedance::Twist::tube_and_gear;
  settings.relies_on_friction = spec.kind == ImpedanceSpec::Kind::high;
  if (spec.kind != ImpedanceSpec::Kind::wanted) return settings;
  settings.gains = TubeImpedance::gains_for(settings, spec.stiffness_Nm_rad, spec.damping_Nms_rad,
                                            spec.torque_gain_Nm_rad);
  require_passive(settings, spec);
  return settings;
}

ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec, std::uint64_t seed,
                             const Progress& progress) {
  const TubeImpedance::Settings settings = impedance_settings(sheet, spec);
  ImpedanceRun run{
      .actuator = sheet.serial ? fmt::format("{}#{:02}", sheet.name, *sheet.serial) : sheet.name,
      .variant = std::string(sheet.variant),
      .spec = spec,
      .seed = seed,
      .gains = settings.gains,
      .stiffness_Nm_rad = TubeImpedance(settings, kBenchRate_Hz).stiffness(),
      .damping_Nms_rad = spec.kind == ImpedanceSpec::Kind::wanted ? spec.damping_Nms_rad : 0.0,
      .passive_to_Hz = Linear(settings).passive_to_Hz(),
      .record = Recording("", kBenchRate_Hz)};
  run.largest_passive_Nm_rad = largest_passive_Nm_rad(settings, run.damping_Nms_rad);
  const std::size_t runs = kFrequencies_Hz.size() + 1;
  Cycles cycles;
  for (const double frequency_Hz : kFrequencies_Hz) {
    run.points.push_back(
        point_at(frequency_Hz, sheet, settings, spec, seed, cycles,
                 part_of(progress, run.points.size(), runs, fmt::format("{:g} Hz", frequency_Hz))));
    run.points.back().wanted_Nm_rad = {run.stiffness_Nm_rad,
                                       kTurn * frequency_Hz * run.damping_Nms_rad};
  }
  move_hand(run, sheet, settings, cycles, part_of(progress, runs - 1, runs, "hand"));
  run.limited_share = static_cast<double>(cycles.limited) / static_cast<double>(cycles.all);
  return run;
}

}  // namespace torsio
