#include "torsio/sim/closed_loop/impedance_tracking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <utility>
#include <variant>

#include "core/report_progress.hpp"
#include "evaluate/fit_and_score.hpp"
#include "sim/bench/bench.hpp"
#include "sim/closed_loop/impedance_checks.hpp"
#include "sim/closed_loop/impedance_loop.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr std::uint64_t kLineSeed = 1;
constexpr double kFurthest_rad = 200.0;       // 30 turns: beyond it the loop diverges
constexpr double kImpedanceSettling_s = 3.0;  // ten times M / d of the output
constexpr double kPeriods = 8.0;
constexpr double kShortestMeasured_s = 4.0;
// A whole number of ticks a period, so that the harmonics are orthogonal to each other and to a
// constant.
constexpr std::array kFrequencies_Hz = {0.1, 0.2, 0.4, 0.5, 0.8, 1.0, 2.0, 4.0, 5.0, 8.0, 10.0};

/// The bench under impedance control, tick by tick.
class ImpedanceBench {
 public:
  ImpedanceBench(const ImpedancePlan& plan, double duration_s, std::uint64_t seed)
      : bench_(
            *plan.sheet,
            {.name = kImpedance,
             .duration_s = duration_s,
             .seed = seed,
             .conditions = {},
             .faults = no_faults_},
            {.start = {}, .load_cell = LoadCell::external, .duration_s = duration_s, .next = {}}),
        loop_(plan),
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
      const ImpedanceLoop::Output out = loop_.step(bench_.time_s(), measured);
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
  ImpedanceLoop loop_;
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
ImpedancePoint point_at(double frequency_Hz, const ImpedancePlan& plan, double amplitude_Nm,
                        std::uint64_t seed, Cycles& cycles, const Progress& progress) {
  const auto whole_periods_s = [&](double least_s) {
    return std::ceil(least_s * frequency_Hz) / frequency_Hz;
  };
  const double settling_s = whole_periods_s(kImpedanceSettling_s);
  const double measured_s = whole_periods_s(std::max(kShortestMeasured_s, kPeriods / frequency_Hz));
  const auto first = static_cast<std::size_t>(std::lround(settling_s * kBenchRate_Hz));
  ImpedanceBench bench(plan, settling_s + measured_s, seed);
  const double rad = kTurn * frequency_Hz / kBenchRate_Hz;
  Complex torque;
  Complex angle;
  std::size_t tick = 0;
  bench.run(
      [&](const PlantState&) { return amplitude_Nm * std::sin(rad * static_cast<double>(tick++)); },
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
          .linear_Nm_rad = LinearImpedance(plan).at(frequency_Hz),
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

void move_hand(ImpedanceRun& run, const ImpedancePlan& plan, Cycles& cycles,
               const Progress& progress) {
  const DataSheet& sheet = *plan.sheet;
  ImpedanceBench bench(plan, run.spec.duration_s, run.seed);
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
  const double arm = std::min(1.0, sheet.rating.torque_Nm.value / HandForces::kFullArm_Nm);
  of.arm_stiffness_Nm_rad *= arm;
  of.arm_damping_Nms_rad *= arm;
  bench.run(
      [&](const PlantState& state) {
        const double last_rad = std::exchange(hand_rad, path.step());
        const double hand_rad_s = (hand_rad - last_rad) * kBenchRate_Hz;
        return of.arm_stiffness_Nm_rad * (hand_rad - state.joint_angle_rad) +
               of.arm_damping_Nms_rad * (hand_rad_s - state.joint_speed_rad_s);
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

bool is_estimator(const std::optional<ImpedanceModel>& model) {
  return model && std::holds_alternative<Estimator>(model->use);
}

/// As `track_impedance`, whether or not anything uses the bandwidth of the correction.
ImpedanceRun run_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                           const std::optional<ImpedanceModel>& model, std::uint64_t seed,
                           const Progress& progress) {
  (void)checked_plan(sheet, spec, model, LinearInverse(1.0));  // before the line of the spring
  const bool is_own_inverse = model && std::holds_alternative<AnyInverse>(model->use);
  const bool needs_line = !has_tube(sheet) && !is_own_inverse;
  const std::size_t runs = kFrequencies_Hz.size() + (needs_line ? 2 : 1);
  std::size_t done = 0;
  const LinearInverse line =
      needs_line
          ? spring_line(sheet, kLineSeed, part_of(progress, done++, runs, "line of the spring"))
          : LinearInverse(1.0);
  const ImpedancePlan plan = checked_plan(sheet, spec, model, line);
  const LinearImpedance linear(plan);
  ImpedanceRun run{
      .actuator = sheet.serial ? fmt::format("{}#{:02}", sheet.name, *sheet.serial) : sheet.name,
      .variant = std::string(sheet.variant),
      .spec = spec,
      .seed = seed,
      .model = model ? model->name : std::string(needs_line ? kSweepLineName : ""),
      .model_reason = model ? model->reason : std::string(),
      .correction_rad_s =
          plan.estimator ? std::optional(plan.correction.bandwidth_rad_s) : std::nullopt,
      .amplitude_Nm = impedance_amplitude_Nm(sheet, spec),
      .stiffness_Nm_rad = plan.stiffness_Nm_rad(),
      .damping_Nms_rad = plan.damping_Nms_rad(),
      .passive_to_Hz = linear.passive_to_Hz(),
      .passive_goal_Hz =
          has_tube(sheet) ? ImpedanceRun::kPassiveTo_Hz : ImpedanceRun::kPassiveSpringTo_Hz,
      .record = Recording("", kBenchRate_Hz)};
  if (const auto* const spring = std::get_if<ImpedancePlan::Spring>(&plan.controller)) {
    run.deflection = DeflectionController::gains_for(spring->torque.deflection);
    run.bandwidth_rad_s = spring->torque.deflection.bandwidth_rad_s;
  } else {
    run.tube = std::get<TubeImpedance::Settings>(plan.controller).gains;
  }
  run.largest_passive_Nm_rad = plan.largest_passive_Nm_rad(run.passive_goal_Hz);
  Cycles cycles;
  for (const double frequency_Hz : kFrequencies_Hz) {
    run.points.push_back(
        point_at(frequency_Hz, plan, run.amplitude_Nm, seed, cycles,
                 part_of(progress, done++, runs, fmt::format("{:g} Hz", frequency_Hz))));
    run.points.back().wanted_Nm_rad = {run.stiffness_Nm_rad,
                                       kTurn * frequency_Hz * run.damping_Nms_rad};
  }
  move_hand(run, plan, cycles, part_of(progress, done, runs, "hand"));
  run.limited_share = static_cast<double>(cycles.limited) / static_cast<double>(cycles.all);
  return run;
}

}  // namespace

ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                             const std::optional<ImpedanceModel>& model, std::uint64_t seed,
                             const Progress& progress) {
  require_used_correction(spec, is_estimator(model));
  return run_impedance(sheet, spec, model, seed, progress);
}

std::vector<ImpedanceRun> track_impedances(const DataSheet& sheet, const ImpedanceSpec& spec,
                                           std::span<const ImpedanceModel> models,
                                           std::uint64_t seed, const Progress& progress) {
  std::vector<std::optional<ImpedanceModel>> all = {std::nullopt};
  all.insert(all.end(), models.begin(), models.end());
  require_used_correction(spec, std::ranges::any_of(all, is_estimator));
  for (const auto& model : all) (void)checked_plan(sheet, spec, model, LinearInverse(1.0));
  std::vector<ImpedanceRun> runs;
  runs.reserve(all.size());
  for (const auto& model : all)
    runs.push_back(run_impedance(
        sheet, spec, model, seed,
        part_of(progress, runs.size(), all.size(), model ? model->name : "without a model")));
  return runs;
}

}  // namespace torsio
