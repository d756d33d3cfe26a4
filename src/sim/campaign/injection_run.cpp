#include "injection_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "duty_bench.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "stop_energy.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kSettle_s = 2.0;  // filters and memory of the sources
constexpr double kLatestStart_s = 20.0;
constexpr double kWindow_s = 20.0;      // in which the disagreement must reach its limit
constexpr double kSmallWindow_s = 5.0;  // a small one need not reach it
constexpr double kMissed_s = 1.0;
constexpr double kPause_s = 0.005;  // after which a disagreement has ended
constexpr double kNearImpact_s = 0.1;
constexpr double kSearchImpact_s = 30.0;
constexpr int kMaxAttempts = 8;
constexpr double kLargerAgain = 1.5;
constexpr std::size_t kNearImpactEvery = 4;  // injections, of which one is put near an impact
constexpr double kImpactsPerMin = 12.0;

using Outcome = InjectionOutcome;

std::size_t ticks_of(double time_s) {
  return static_cast<std::size_t>(std::lround(time_s * kBenchRate_Hz));
}

/// The seed of one attempt of one injection.
std::uint64_t attempt_seed(std::uint64_t seed, std::size_t index, int attempt) {
  Random random(seed + 0x9e3779b97f4a7c15U * (index + 1));
  for (int i = 1; i < attempt; ++i) static_cast<void>(random.bits());
  return random.bits();
}

/// One injection on its way.
struct Trial {
  std::size_t index = 0;
  Outcome outcome;
};

/// One attempt on the bench.
struct Attempt {
  Attempt(const InjectionRun& run, const Trial& trial)
      : seed(attempt_seed(run.seed, trial.index, trial.outcome.attempts)), monitor(run.monitor) {
    Random random(~seed);
    double size = run.size * (0.8 + 0.4 * random.uniform());
    if (run.size == 0.0)
      size = (0.25 + 0.75 * random.uniform()) * std::pow(kLargerAgain, trial.outcome.attempts - 1);
    drawn = run.fault.draw(random, size);
    settings.impacts_per_min = kImpactsPerMin;
    start_tick = ticks_of(kSettle_s + (kLatestStart_s - kSettle_s) * random.uniform());
    const double after_impact_s = kNearImpact_s * random.uniform();
    if (trial.index % kNearImpactEvery == 0)
      start_tick = impact_tick(run.sheet, start_tick) + ticks_of(after_impact_s);
    if (run.fault.onset == FaultOnset::start) start_tick = 0;
    for (ScheduledFault& fault : drawn.faults)
      fault.start_s = static_cast<double>(start_tick) / kBenchRate_Hz;
    end_tick = start_tick + ticks_of(run.size == 0.0 ? kWindow_s : kSmallWindow_s);
  }

  /// The beginning of the first impact after this tick.
  [[nodiscard]] std::size_t impact_tick(const DataSheet& sheet, std::size_t after) const {
    Duty duty(sheet, settings, duty_seed(seed));
    const std::size_t last = after + ticks_of(kSearchImpact_s);
    for (std::size_t tick = 0; tick < last; ++tick) {
      duty.step();
      if (tick >= after && duty.has_impact_begun()) return tick;
    }
    return after;
  }

  [[nodiscard]] DutyLane lane(const InjectionRun& run) const {
    return {.sheet = run.sheet,
            .seed = seed,
            .settings = settings,
            .faults = {drawn.faults},
            .is_loop_sound = run.fault.is_loop_sound};
  }

  std::uint64_t seed;
  DutySettings settings = {};
  DrawnFault drawn;
  std::size_t start_tick = 0;
  std::size_t end_tick = 0;
  JointMonitor monitor;
  std::optional<JointMonitor> sound;           ///< with the sound signals, since the injection
  std::optional<std::size_t> onset_tick = {};  ///< begin of the disagreement in progress
  std::size_t reached_tick = 0;                ///< the last one in which it was at the limit
  bool is_lasting = false;     ///< it has lasted as long as a stop may take, and counts
  std::size_t late_steps = 0;  ///< steps of the loop since an overrun began
  // A fault at power-up may cause several disagreements before it ends.
  int watched_ticks = 0;          ///< in the disagreement in progress
  bool would_watch = false;       ///< with the sound signals, in that disagreement
  int longest_watched_ticks = 0;  ///< the most in a disagreement that lasted
  bool has_lasted = false;        ///< in one of them the monitor would have watched
  bool is_done = false;
};

class Injections {
 public:
  explicit Injections(const InjectionRun& run)
      : run_(run),
        rated_Nm_(run.sheet.rating.torque_Nm.value),
        largest_twist_rad_(largest_twist(run.sheet)) {}

  std::vector<Outcome> all() {
    std::vector<Trial> trials(run_.count);
    for (std::size_t i = 0; i < trials.size(); ++i) trials[i].index = run_.first + i;
    std::vector<Trial*> open;
    open.reserve(trials.size());
    for (Trial& trial : trials) open.push_back(&trial);
    while (!open.empty()) {
      attempt(open);
      std::erase_if(open, [this](Trial* trial) { return !is_to_repeat(*trial); });
    }
    std::vector<Outcome> outcomes;
    outcomes.reserve(trials.size());
    for (const Trial& trial : trials) outcomes.push_back(trial.outcome);
    return outcomes;
  }

 private:
  /// Counts the next attempt.
  bool is_to_repeat(Trial& trial) const {
    if (trial.outcome.kind != Outcome::Kind::unreached || run_.size != 0.0) return false;
    if (trial.outcome.attempts == kMaxAttempts) return false;
    ++trial.outcome.attempts;
    return true;
  }

  void attempt(const std::vector<Trial*>& trials) {
    std::vector<Attempt> attempts;
    std::vector<DutyLane> lanes;
    attempts.reserve(trials.size());
    for (const Trial* trial : trials) {
      attempts.emplace_back(run_, *trial);
      lanes.push_back(attempts.back().lane(run_));
    }
    DutyBench bench(lanes, {.is_electrical = run_.is_electrical});
    std::size_t left = attempts.size();
    for (std::size_t tick = 0; left > 0; ++tick) {
      bench.sense();
      for (std::size_t lane = 0; lane < attempts.size(); ++lane) {
        if (attempts[lane].is_done) continue;
        step(bench, lane, tick, attempts[lane], trials[lane]->outcome);
        if (!attempts[lane].is_done) continue;
        bench.cut(lane);
        --left;
      }
      bench.act();
    }
  }

  void step(const DutyBench& bench, std::size_t lane, std::size_t tick, Attempt& of,
            Outcome& outcome) const {
    if (tick == of.start_tick) begin(of, outcome);
    if (of.is_done) return;
    const bool is_injected = tick >= of.start_tick;
    if (is_injected && of.drawn.late_ticks > 0) {
      if ((tick - of.start_tick) % of.drawn.late_ticks != of.drawn.late_ticks - 1) return;
      ++of.late_steps;
    }
    of.monitor.step(bench.time_s(), bench.measured(lane));
    if (!is_injected) return;
    find_onset(bench, lane, tick, of, outcome);
    decide(bench, lane, tick, of, outcome);
  }

  // A monitor that does not watch cannot be tested: another joint is taken.
  void begin(Attempt& of, Outcome& outcome) const {
    outcome.disagreement = 0.0;
    outcome.energy_gain = kNotMeasured;
    outcome.near_impact = false;
    outcome.brief = 0;
    if (!of.monitor.monitor().is_watching() && run_.fault.onset != FaultOnset::start) {
      outcome.kind = Outcome::Kind::unreached;
      of.is_done = true;
    }
    if (of.drawn.failed_model) of.monitor.monitored().sources().fail_model(*of.drawn.failed_model);
    if (run_.fault.onset == FaultOnset::sensors || run_.fault.onset == FaultOnset::start)
      of.sound = of.monitor;
    if (run_.fault.onset == FaultOnset::injection) {
      of.onset_tick = of.start_tick;
      of.is_lasting = true;
    }
  }

  // A disagreement that ends by itself sooner than a stop may take is counted, but is not an onset.
  void find_onset(const DutyBench& bench, std::size_t lane, std::size_t tick, Attempt& of,
                  Outcome& outcome) const {
    bool is_reached = false;
    if (of.sound) {
      of.sound->step(bench.time_s(), bench.sound(lane),
                     bench.condition(lane).torque_constant_factor);
      const double difference =
          of.monitor.changed_difference_Nm(*of.sound, run_.fault.onset != FaultOnset::start) /
          rated_Nm_;
      if (std::isfinite(difference))
        outcome.disagreement = std::max(outcome.disagreement, difference);
      is_reached = !(difference < run_.limit_share);
    } else if (run_.fault.onset == FaultOnset::parts) {
      const double difference = of.monitor.difference_Nm() / rated_Nm_;
      outcome.disagreement = std::max(outcome.disagreement, difference);
      const SensedPlant plant = bench.plants().sensed(lane);
      is_reached =
          !(difference < run_.limit_share) || std::abs(plant.second_twist_rad) > largest_twist_rad_;
    }
    if (is_reached) of.reached_tick = tick;
    if (is_reached && !of.onset_tick) of.onset_tick = tick;
    if (of.onset_tick == tick)
      outcome.near_impact = bench.duty(lane).since_impact_s() < kNearImpact_s;
    const bool is_start = run_.fault.onset == FaultOnset::start;
    if (!of.onset_tick || (of.is_lasting && !is_start)) return;
    if (is_reached) {
      of.is_lasting = of.is_lasting || tick - *of.onset_tick >= ticks_of(run_.fault.limit_s);
    } else if (tick - of.reached_tick > ticks_of(kPause_s)) {
      if (!of.is_lasting) ++outcome.brief;
      of.onset_tick.reset();
      of.is_lasting = false;
      of.watched_ticks = 0;
      of.would_watch = false;
    }
  }

  void decide(const DutyBench& bench, std::size_t lane, std::size_t tick, Attempt& of,
              Outcome& outcome) const {
    if (run_.fault.onset == FaultOnset::start) return decide_start(tick, of, outcome);
    if (!of.monitor.monitor().is_watching()) {
      const std::size_t onset = std::min(of.onset_tick.value_or(tick), tick);
      outcome.latency_ticks =
          static_cast<int>(of.drawn.late_ticks > 0 ? of.late_steps : tick - onset);
      outcome.kind = run_.fault.must_stop ? Outcome::Kind::detected : Outcome::Kind::stopped;
      outcome.check = static_cast<int>(of.monitor.monitor().reason().check);
      if (!of.onset_tick) outcome.near_impact = bench.duty(lane).since_impact_s() < kNearImpact_s;
      if (run_.fault.onset != FaultOnset::parts && !run_.is_electrical)
        outcome.energy_gain = stop_energy_gain(run_.sheet, bench.plants().sensed(lane).state,
                                               bench.duty(lane).load());
      of.is_done = true;
    } else if (of.is_lasting && tick >= *of.onset_tick + ticks_of(kMissed_s)) {
      outcome.kind = run_.fault.must_stop ? Outcome::Kind::missed : Outcome::Kind::quiet;
      of.is_done = true;
    } else if (tick >= of.end_tick) {
      outcome.kind = run_.size == 0.0 ? Outcome::Kind::unreached : Outcome::Kind::missed;
      of.is_done = true;
    }
  }

  // Not to be armed is right as long as the sensor is not; to watch is wrong while a disagreement lasts. A
  // joint whose monitor would not watch with the sound signals either shows nothing.
  static void decide_start(std::size_t tick, Attempt& of, Outcome& outcome) {
    const ScheduledFault& fault = of.drawn.faults.front();
    const bool is_faulty = static_cast<double>(tick) < *fault.duration_s * kBenchRate_Hz;
    const Monitor& monitor = of.monitor.monitor();
    if (is_faulty && of.onset_tick) {
      of.watched_ticks += monitor.is_watching() ? 1 : 0;
      of.would_watch = of.would_watch || of.sound->monitor().is_watching();
      if (of.is_lasting && of.would_watch) {
        of.longest_watched_ticks = std::max(of.longest_watched_ticks, of.watched_ticks);
        of.has_lasted = true;
      }
    }
    if (is_faulty) return;
    of.is_done = true;
    outcome.latency_ticks = of.longest_watched_ticks;
    if (monitor.latest().action != MonitorAction::off)
      outcome.check = static_cast<int>(monitor.latest().check);
    if (!of.has_lasted) {
      outcome.kind = Outcome::Kind::unreached;
    } else {
      outcome.kind = of.longest_watched_ticks < static_cast<int>(ticks_of(kMissed_s))
                         ? Outcome::Kind::detected
                         : Outcome::Kind::missed;
    }
  }

  const InjectionRun& run_;
  double rated_Nm_;
  double largest_twist_rad_;
};

}  // namespace

std::vector<InjectionOutcome> run_injections(const InjectionRun& run) {
  return Injections(run).all();
}

}  // namespace torsio
