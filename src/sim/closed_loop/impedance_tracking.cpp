#include "torsio/sim/closed_loop/impedance_tracking.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <variant>

#include "core/checks.hpp"
#include "core/report_progress.hpp"
#include "evaluate/fit_and_score.hpp"
#include "sim/bench/bench.hpp"
#include "sim/closed_loop/impedance_loop.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;

constexpr auto kImpedance = "impedance";
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr std::uint64_t kLineSeed = 1;
constexpr double kLargestAmplitude_Nm = 50.0;  // as the experiments of the bench
constexpr double kTubeAmplitude_Nm = 20.0;
constexpr double kAmplitudeShare = 0.2;  // share of the rated torque
constexpr double kShortestImpedance_s = 10.0;
constexpr double kLongestImpedance_s = 3600.0;
constexpr double kFurthest_rad = 200.0;       // 30 turns: beyond it the loop diverges
constexpr double kImpedanceSettling_s = 3.0;  // ten times M / d of the output
constexpr double kPeriods = 8.0;
constexpr double kShortestMeasured_s = 4.0;
// A whole number of ticks a period, so that the harmonics are orthogonal to each other and to a
// constant.
constexpr std::array kFrequencies_Hz = {0.1, 0.2, 0.4, 0.5, 0.8, 1.0, 2.0, 4.0, 5.0, 8.0, 10.0};

void require_setting(bool holds, const char* what, std::string_view expected, double found) {
  require<UsageError>(holds, fmt::format("{} {}", kImpedance, what), expected, found);
}

bool has_tube(const DataSheet& sheet) { return sheet.family == ActuatorFamily::harmonic_drive; }

double amplitude_of(const DataSheet& sheet, const ImpedanceSpec& spec) {
  return spec.amplitude_Nm.value_or(
      has_tube(sheet) ? kTubeAmplitude_Nm : kAmplitudeShare * sheet.rating.torque_Nm.value);
}

void check(const DataSheet& sheet, const ImpedanceSpec& spec) {
  require_setting(spec.stiffness_Nm_rad >= 0.0 && std::isfinite(spec.stiffness_Nm_rad), "stiffness",
                  "0 Nm/rad or more", spec.stiffness_Nm_rad);
  require_setting(spec.damping_Nms_rad >= 0.0 && std::isfinite(spec.damping_Nms_rad), "damping",
                  "0 Nms/rad or more", spec.damping_Nms_rad);
  const auto require_above_zero = [](const std::optional<double>& value, const char* what,
                                     std::string_view expected) {
    if (value) require_setting(*value > 0.0 && std::isfinite(*value), what, expected, *value);
  };
  require_above_zero(spec.torque_gain_Nm_rad, "torque gain", "above 0 Nm/rad");
  require_above_zero(spec.bandwidth_rad_s, "bandwidth", "above 0 rad/s");
  require_above_zero(spec.loop_damping, "damping of the torque loop", "above 0");
  const double largest_Nm = has_tube(sheet) ? kLargestAmplitude_Nm : sheet.rating.torque_Nm.value;
  const double amplitude_Nm = amplitude_of(sheet, spec);
  require_setting(amplitude_Nm > 0.0 && amplitude_Nm <= largest_Nm, "amplitude",
                  fmt::format("above 0 and at most {:g} Nm", largest_Nm), amplitude_Nm);
  require_setting(
      spec.duration_s >= kShortestImpedance_s && spec.duration_s <= kLongestImpedance_s, "duration",
      fmt::format("{:g} to {:g} s", kShortestImpedance_s, kLongestImpedance_s), spec.duration_s);
}

bool is_stable_with(ImpedancePlan plan, const JointImpedance::Gains& gains) {
  std::get<ImpedancePlan::Spring>(plan.controller).gains = gains;
  return LinearImpedance(plan).is_stable();
}

/// @param stable @param other gains, of which only the first is stable
/// @returns the stable gain next to the boundary between them
template <class GainsOf>
double stable_up_to(const ImpedancePlan& plan, double stable, double other,
                    const GainsOf& gains_of) {
  constexpr int kHalvings = 20;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = std::sqrt(stable * other);
    (is_stable_with(plan, gains_of(middle)) ? stable : other) = middle;
  }
  return stable;
}

/// The values of a gain from below, geometrically up to the first that is (not) stable, then by
/// bisection: the result depends on `lowest` only if it is stable in several ranges.
/// @returns the least stable one, or the largest below those that are not; none if there is none
template <class GainsOf>
std::optional<double> find_gain(const ImpedancePlan& plan, double lowest, double highest,
                                bool looks_for_stable, const GainsOf& gains_of) {
  constexpr double kGainStep = 1.1;
  std::optional<double> last;
  for (double value = lowest; value > 0.0 && value <= highest; value *= kGainStep) {
    const bool is_stable = is_stable_with(plan, gains_of(value));
    if (looks_for_stable && is_stable)
      return last ? stable_up_to(plan, value, *last, gains_of) : value;
    if (!looks_for_stable && !is_stable)
      return last ? std::optional(stable_up_to(plan, *last, value, gains_of)) : std::nullopt;
    last = value;
  }
  return looks_for_stable ? std::nullopt : last;
}

/// With three digits, none of them rounded up, or none down.
double three_digits(double value, bool rounds_up) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  return unit * (rounds_up ? std::ceil(value / unit) : std::floor(value / unit));
}

double spring_stiffness_Nm_rad(const ImpedancePlan& plan) {
  return std::get<ImpedancePlan::Spring>(plan.controller).torque.deflection.joint.stiffness_Nm_rad;
}

/// The least damping that makes a stiffness stable; none if there is none.
std::optional<double> stable_damping(const ImpedancePlan& plan, double stiffness_Nm_rad) {
  constexpr double kShortest_s = 1e-5;
  constexpr double kLongest_s = 1.0;
  const auto found = find_gain(plan, kShortest_s * spring_stiffness_Nm_rad(plan),
                               kLongest_s * stiffness_Nm_rad, true, [&](double value) {
                                 return JointImpedance::Gains{stiffness_Nm_rad, value};
                               });
  return found ? std::optional(three_digits(*found, true)) : std::nullopt;
}

std::string stable_gains(const ImpedancePlan& plan, const JointImpedance::Gains& gains) {
  constexpr double kSmallest = 1e-4;
  constexpr double kFirstStep = 1.1;
  const auto stiffness = find_gain(plan, kSmallest * spring_stiffness_Nm_rad(plan),
                                   kFirstStep * gains.stiffness_Nm_rad, false, [&](double value) {
                                     return JointImpedance::Gains{value, gains.damping_Nms_rad};
                                   });
  const auto damping = stable_damping(plan, gains.stiffness_Nm_rad);
  std::vector<std::string> ways;
  double less_Nms_rad = gains.damping_Nms_rad / kFirstStep;
  const auto with_damping = [&](double value) {
    return JointImpedance::Gains{gains.stiffness_Nm_rad, value};
  };
  for (int n = 0; n < 100 && less_Nms_rad > 0.0; ++n, less_Nms_rad /= kFirstStep)
    if (is_stable_with(plan, with_damping(less_Nms_rad))) {
      const double largest_Nms_rad =
          stable_up_to(plan, less_Nms_rad, kFirstStep * less_Nms_rad, with_damping);
      ways.push_back(
          fmt::format("a damping of at most {:.3g} Nms/rad", three_digits(largest_Nms_rad, false)));
      break;
    }
  if (damping && gains.damping_Nms_rad < *damping)
    ways.push_back(fmt::format("a damping from {:.3g} Nms/rad on", *damping));
  if (stiffness)
    ways.push_back(
        fmt::format("at most {:.3g} Nm/rad with this damping", three_digits(*stiffness, false)));
  double softer_Nm_rad = 0.5 * gains.stiffness_Nm_rad;
  for (int n = 0; ways.empty() && n < 10; ++n, softer_Nm_rad *= 0.5)
    if (const auto found = stable_damping(plan, softer_Nm_rad))
      ways.push_back(
          fmt::format("for example {:.3g} Nm/rad with {:.3g} Nms/rad", softer_Nm_rad, *found));
  return ways.empty() ? "another bandwidth" : fmt::format("{}", fmt::join(ways, ", or "));
}

void require_stable(const ImpedancePlan& plan) {
  if (LinearImpedance(plan).is_stable()) return;
  const JointImpedance::Gains gains = std::get<ImpedancePlan::Spring>(plan.controller).gains;
  throw UsageError(
      {.place = kImpedance,
       .problem = "the loop is unstable without dry friction, with the output locked or free",
       .expected = stable_gains(plan, gains),
       .found =
           fmt::format("{:g} Nm/rad, {:g} Nms/rad{}", gains.stiffness_Nm_rad, gains.damping_Nms_rad,
                       plan.estimator ? fmt::format(", corrected by an estimate below {:.3g} Hz",
                                                    plan.correction.bandwidth_rad_s / kTurn)
                                      : std::string())});
}

void require_passive(const ImpedancePlan& plan, const LinearImpedance& linear,
                     const ImpedanceSpec& spec) {
  const double passive_to_Hz = linear.passive_to_Hz();
  if (passive_to_Hz >= ImpedanceRun::kPassiveTo_Hz) return;
  const double largest_Nm_rad = plan.largest_passive_Nm_rad(ImpedanceRun::kPassiveTo_Hz);
  const double gain_Nm_rad = std::get<TubeImpedance::Settings>(plan.controller).gains.torque_Nm_rad;
  const std::string with = fmt::format("a damping of {:g} Nms/rad and a torque gain of {:g} Nm/rad",
                                       spec.damping_Nms_rad, gain_Nm_rad);
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
       .advice = plan.estimator && largest_Nm_rad >= spec.stiffness_Nm_rad
                     ? "Without the model it is passive: the estimate corrects too fast for it."
                     : "Take less stiffness, or a torque gain of 1 Nm/rad or less."});
}

/// The checked plan.
ImpedancePlan plan_of(const DataSheet& sheet, const ImpedanceSpec& spec,
                      const std::optional<ImpedanceModel>& model, const LinearInverse& line) {
  check(sheet, spec);
  ImpedancePlan plan = impedance_plan(sheet, spec, model ? &*model : nullptr, line);
  if (!has_tube(sheet))
    require_stable(plan);
  else if (spec.kind == ImpedanceSpec::Kind::wanted)
    require_passive(plan, LinearImpedance(plan), spec);
  (void)ImpedanceLoop(plan);
  return plan;
}

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

}  // namespace

namespace {

/// A discrete model with memory runs at the rate of its training, which the loop holds.
double estimator_rate_Hz(const ModelFile& model) {
  const double ticks = std::round(kBenchRate_Hz / model.settings.sample_rate_Hz);
  const bool is_whole =
      ticks >= 1.0 && std::abs(ticks * model.settings.sample_rate_Hz - kBenchRate_Hz) < 1e-6;
  return is_whole ? model.settings.sample_rate_Hz : kBenchRate_Hz;
}

/// One sentence, without the place and the advice of the error.
std::string reason_of(const ErrorReport& report) {
  std::string reason = "the model has no inverse";
  for (const auto& [word, part] : {std::pair(": ", &report.problem),
                                   {": expected ", &report.expected},
                                   {", found ", &report.found}})
    if (!part->empty()) reason += word + part->substr(0, part->find('\n'));
  return reason;
}

}  // namespace

ImpedanceModel impedance_model(std::string name, const ModelFile& model, const DataSheet& sheet) {
  std::string reason = "the torque of this actuator's tube is controlled by its twist";
  if (!has_tube(sheet)) {
    try {
      AnyInverse inverse = inverse_of(model);
      return {.name = std::move(name), .use = std::move(inverse)};
    } catch (const Error& error) {
      reason = reason_of(error.report());
    }
  }
  Estimator estimator = make_estimator(model, estimator_rate_Hz(model));
  const EstimatorSettings& settings = estimator.settings();
  if (settings.target != "torque_Nm")
    throw Error({.place = kImpedance,
                 .expected = "a model of torque_Nm, or one with an inverse",
                 .found = fmt::format("a model of {}; {}", settings.target, reason)});
  for (const std::string& channel : settings.zeroed_channels) estimator.set_zero(channel, 0.0);
  (void)sensed_inputs(sheet, estimator.raw_inputs(), kImpedance);
  return {.name = std::move(name), .use = std::move(estimator), .reason = std::move(reason)};
}

LinearInverse spring_line(const DataSheet& sheet, std::uint64_t seed, const Progress& progress) {
  if (has_tube(sheet))
    throw UsageError({.place = kImpedance,
                      .expected = "an actuator whose spring is at the joint",
                      .found = sheet.name});
  if (sheet.family == ActuatorFamily::series_elastic) return sweep_line(sheet, seed, progress);
  Dataset cycle;
  Recording recording = simulate(sheet, {.experiment = "static-cycle", .seed = seed}, progress);
  const std::size_t samples = recording.size();
  cycle.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  const char* const twist = sheet.family == ActuatorFamily::rubber_clutch
                                ? "input_angle_rad - joint_angle_rad"
                                : "spring_deflection_rad";
  const TrainedModel trained =
      train_model(cycle, {.family = "linear", .features = resolve_inputs(cycle, {twist})}, seed);
  const LinearFallback& line = trained.file.settings.fallback;
  return LinearInverse(line.slope.front(), line.intercept);
}

ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                             const std::optional<ImpedanceModel>& model, std::uint64_t seed,
                             const Progress& progress) {
  (void)plan_of(sheet, spec, model, LinearInverse(1.0));  // before the line of the spring
  const bool is_own_inverse = model && std::holds_alternative<AnyInverse>(model->use);
  const bool needs_line = !has_tube(sheet) && !is_own_inverse;
  const std::size_t runs = kFrequencies_Hz.size() + (needs_line ? 2 : 1);
  std::size_t done = 0;
  const LinearInverse line =
      needs_line
          ? spring_line(sheet, kLineSeed, part_of(progress, done++, runs, "line of the spring"))
          : LinearInverse(1.0);
  const ImpedancePlan plan = plan_of(sheet, spec, model, line);
  const LinearImpedance linear(plan);
  ImpedanceRun run{
      .actuator = sheet.serial ? fmt::format("{}#{:02}", sheet.name, *sheet.serial) : sheet.name,
      .variant = std::string(sheet.variant),
      .spec = spec,
      .seed = seed,
      .model = model ? model->name : std::string(needs_line ? kSweepLineName : ""),
      .model_reason = model ? model->reason : std::string(),
      .amplitude_Nm = amplitude_of(sheet, spec),
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

std::vector<ImpedanceRun> track_impedances(const DataSheet& sheet, const ImpedanceSpec& spec,
                                           std::span<const ImpedanceModel> models,
                                           std::uint64_t seed, const Progress& progress) {
  std::vector<std::optional<ImpedanceModel>> all = {std::nullopt};
  all.insert(all.end(), models.begin(), models.end());
  for (const auto& model : all) (void)plan_of(sheet, spec, model, LinearInverse(1.0));
  std::vector<ImpedanceRun> runs;
  runs.reserve(all.size());
  for (const auto& model : all)
    runs.push_back(track_impedance(
        sheet, spec, model, seed,
        part_of(progress, runs.size(), all.size(), model ? model->name : "without a model")));
  return runs;
}

}  // namespace torsio
