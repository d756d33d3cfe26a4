#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <optional>

#include "core/report_progress.hpp"
#include "duty_bench.hpp"
#include "joint_monitor.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 36000.0;

}  // namespace

Recording duty_recording(const DataSheet& sheet, const DutyRun& run, const Progress& progress) {
  if (!(run.duration_s >= 1.0 / kBenchRate_Hz && run.duration_s <= kLongest_s))
    throw UsageError({.place = "duration of the work",
                      .expected = fmt::format("{} to {} s", 1.0 / kBenchRate_Hz, kLongest_s),
                      .found = fmt::format("{}", run.duration_s)});
  static_cast<void>(
      FaultInjector(run.faults, sheet, run.duration_s));  // refuses what is beyond the run
  DutyBench bench(
      {{.sheet = sheet, .seed = run.seed, .settings = run.settings, .faults = run.faults}},
      {.is_electrical = run.is_electrical, .is_single = true, .has_brakes = run.guard != nullptr});
  std::optional<JointMonitor> guard;
  if (run.guard != nullptr) guard.emplace(*run.guard, sheet, run.is_electrical);
  const auto ticks = static_cast<std::size_t>(std::lround(run.duration_s * kBenchRate_Hz));
  BenchLog log(with_duty_bench(sheet), ticks, run.with_truth, run.is_electrical);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    if (tick % 1000 == 0)
      report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                      "simulating");
    bench.sense();
    if (guard && guard->step(bench.time_s(), bench.measured(0)) == Monitor::State::stopped)
      bench.cut(0);
    log.add(bench.measured(0),
            {*bench.plants().single(0), bench.torque_Nm(0), bench.duty(0).temperature_K()});
    bench.act();
  }
  return log.finish(fmt::format("{} duty seed {}", full_name(sheet), run.seed));
}

}  // namespace torsio
