#include "fault_free_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "duty_bench.hpp"

namespace torsio {
namespace {

// A joint's measurements of so many ticks are taken before its monitor reads them, which has its models in
// the cache then.
constexpr std::size_t kBlock = 50;

std::string cause(const Monitor& monitor) {
  const MonitorEvent& event = monitor.reason();
  const MonitorSettings& settings = monitor.settings();
  std::string text(name(event.check));
  switch (event.check) {
    case MonitorCheck::period: return text;
    case MonitorCheck::disagreement:
    case MonitorCheck::drift:
    case MonitorCheck::sign:
      return fmt::format("{} {} {}", text, settings.sources[event.first],
                         settings.sources[event.second]);
    case MonitorCheck::source_lost:
    case MonitorCheck::source_fault:
    case MonitorCheck::novelty: return fmt::format("{} {}", text, settings.sources[event.first]);
    default: break;
  }
  if (event.first < settings.signals.size()) text += " " + settings.signals[event.first].name;
  return text;
}

}  // namespace

FaultFreeOutcome run_fault_free(const FaultFreeRun& run) {
  std::vector<DutyLane> lanes;
  for (std::size_t i = 0; i < run.sheets.size(); ++i)
    lanes.push_back({.sheet = run.sheets[i], .seed = run.seed + i, .settings = run.settings});
  std::vector<JointMonitor> monitors(lanes.size(), run.monitor);
  std::vector<std::array<Measurement, kBlock>> blocks(lanes.size());
  DutyBench bench(lanes, {.is_electrical = run.is_electrical});
  FaultFreeOutcome outcome;
  for (std::size_t tick = 0; tick < run.ticks;) {
    const double start_s = bench.time_s();
    const std::size_t count = std::min(kBlock, run.ticks - tick);
    for (std::size_t k = 0; k < count; ++k) {
      bench.sense();
      for (std::size_t lane = 0; lane < blocks.size(); ++lane) {
        blocks[lane][k] = bench.sound(lane);
        if (bench.duty(lane).has_impact_begun()) ++outcome.impacts;
      }
      bench.act();
    }
    for (std::size_t lane = 0; lane < blocks.size(); ++lane) {
      for (std::size_t k = 0; k < count; ++k) {
        const double t_s = start_s + static_cast<double>(k) / 1000.0;
        const Monitor::State state = monitors[lane].step(t_s, blocks[lane][k]);
        if (state == Monitor::State::watching) ++outcome.watched_ticks;
        if (state != Monitor::State::stopped) continue;
        ++outcome.alarms[cause(monitors[lane].monitor())];
        monitors[lane].restart(t_s);
      }
    }
    tick += count;
  }
  outcome.ticks = run.ticks * blocks.size();
  return outcome;
}

DataSheet with_hysteresis(const DataSheet& sheet, double factor) {
  DataSheet changed = sheet;
  const auto scale = [factor](SheetValue& value) { value = assumed(factor * value.value); };
  std::visit(
      [&](auto& stage) {
        if constexpr (requires { stage.load_friction; }) {
          scale(stage.friction_Nm);
          scale(stage.load_friction);
        } else if constexpr (requires { stage.hysteresis_rad; }) {
          scale(stage.hysteresis_rad);
        } else if constexpr (requires { stage.slip_Nm.value; }) {
          scale(stage.slip_Nm);
        } else {
          for (SheetValue& slip_Nm : stage.slip_Nm) scale(slip_Nm);
        }
      },
      changed.second);
  return changed;
}

}  // namespace torsio
